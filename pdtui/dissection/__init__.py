"""Policy Dissection: which hidden units move what. One module a step of the method, in the paper's order.

monitor -> spectrum -> matching -> phase (section 3.2 of the paper), then probe, combine and hold, which
measure what a stimulation does instead of guessing it; propose writes the map and report the tables.
"""
