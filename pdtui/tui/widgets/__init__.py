"""The parts of the drive's screen, one a file."""
