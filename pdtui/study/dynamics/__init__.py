"""Learning dynamics: motor primitives over the checkpoints of a training run, as in figure 5 of the paper."""
