"""Drive a trained neural controller from a terminal by stimulating its hidden units."""

__version__ = "0.1.0"
