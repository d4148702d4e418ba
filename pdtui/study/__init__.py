"""Studies over many policies and checkpoints. Nothing but their commands needs them."""
