"""Break recordings in every way, repair them, replay them, and count what is lost.

``python -m tests.faults`` prints the table; ``python -m tests.faults flips cuts`` only some of its rows.
"""
