"""Pictures of studies over many policies and checkpoints."""
