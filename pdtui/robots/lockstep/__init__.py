"""Several copies of a robot that are stepped together, for roll-outs under different stimulations."""
