"""The journal of an evaluation."""
