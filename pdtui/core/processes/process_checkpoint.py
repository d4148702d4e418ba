"""A process that keeps its whole state while a copy of it goes on, and can be gone back to.

A library that cannot restore its state may still be copied as a whole: by the operating system, which copies
a process in milliseconds, memory page by memory page as they change. Linux only.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys

_AGAIN, _RELEASE = 77, 78
_PR_SET_PDEATHSIG = 1


def can_hold_state() -> bool:
    """Return whether a process can hold its state here."""
    return sys.platform == "linux"


def hold_state() -> None:
    """Keep the state of this process, and return in a copy of it.

    The copy goes on in the place of the process, with the same pipes, until it calls `return_to_held_state`
    or `return_and_release_state`. Then this function returns once more: in another copy, whose state is that
    of the first call, or in the process itself, which has that state, too. If the copy ends in another way,
    so does the process; if the process is killed, so is the copy.
    """
    while True:
        holder, copy = os.getpid(), os.fork()
        if copy == 0:
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
            if os.getppid() != holder:  # it was killed in between
                os._exit(1)
            return
        code = os.waitstatus_to_exitcode(os.waitpid(copy, 0)[1])
        if code == _RELEASE:
            return
        if code != _AGAIN:
            os._exit(1)


def return_to_held_state() -> None:
    """End this copy; another one goes on from the state that is held."""
    os._exit(_AGAIN)


def return_and_release_state() -> None:
    """End this copy; the process that held the state goes on from it itself."""
    os._exit(_RELEASE)
