"""Generates two pages of the guide: the commands from click, the Python reference from docstrings."""
