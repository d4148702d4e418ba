"""The widgets of the drive's screen, one per file."""
