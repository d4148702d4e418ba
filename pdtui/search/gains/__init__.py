"""Search for the gains of a controller, and the drives that compare them."""
