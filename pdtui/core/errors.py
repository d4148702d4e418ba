"""The exceptions that pdtui raises on purpose.

Every message names the thing at fault, what was expected of it and what is there, so that the command line
can print it as its only line.
"""

import traceback
from pathlib import PurePath


class PdtuiError(Exception):
    """Base of every error that a user can cause or must hear of."""


class RobotError(PdtuiError):
    """A robot is unknown, not installed, or was used in a way that it does not offer."""


class SimulationDiverged(RobotError):  # noqa: N818 - it names what happened
    """The simulator's state is no longer finite; the episode cannot go on."""


class PolicyError(PdtuiError):
    """A policy file, a network or a unit address is not what was expected."""


class MapError(PdtuiError):
    """A stimulation-evoked map is missing, malformed or does not fit its policy."""


class KeystrokeError(PdtuiError):
    """A keystroke file or an event cannot be applied."""


class DriveEnded(PdtuiError):  # noqa: N818 - it names what happened
    """A drive was ended from outside; its recording is whole."""


class SessionError(PdtuiError):
    """A recording cannot be written, read or replayed."""


class RecordingEnded(SessionError):  # noqa: N818 - it names what happened
    """A recording had to end before its drive; what was recorded is whole."""


class PictureError(PdtuiError):
    """A picture cannot be drawn or written."""


class ScreenError(PdtuiError):
    """The terminal cannot show the screen."""


class TrainingError(PdtuiError):
    """A training run cannot start or go on."""


class WorkerError(PdtuiError):
    """A worker process died."""


def format_error_in_one_line(error: BaseException) -> str:
    """An exception in one line, for where no traceback can be printed: what it is and where it was raised."""
    words = " ".join(traceback.format_exception_only(error)[-1].split())
    frames = traceback.extract_tb(error.__traceback__)
    if not frames:
        return words
    last = frames[-1]
    return f"{words} ({PurePath(last.filename).name}, line {last.lineno}, in {last.name})"
