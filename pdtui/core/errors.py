"""The exceptions that pdtui raises on purpose.

Every message names the thing at fault, what was expected and what was found, so that the command line can
print the message alone.
"""

import traceback
from pathlib import PurePath


class PdtuiError(Exception):
    """Base class of all errors that a user can cause or needs to know about."""


class RobotError(PdtuiError):
    """A robot is unknown, is not installed, or does not support what was requested."""


class SimulationDiverged(RobotError):  # noqa: N818 - it names an event
    """The state of the simulator is no longer finite, so the episode cannot continue."""


class PolicyError(PdtuiError):
    """A policy file, a network or a unit address is invalid."""


class MapError(PdtuiError):
    """A stimulation-evoked map is missing, malformed or does not fit its policy."""


class KeystrokeError(PdtuiError):
    """A keystroke file or an event cannot be applied."""


class DriveEndedFromOutside(PdtuiError):  # noqa: N818 - it names an event
    """A drive was ended from outside; its recording is complete."""


class SessionError(PdtuiError):
    """A recording cannot be written, read or replayed."""


class RecordingEnded(SessionError):  # noqa: N818 - it names an event
    """A recording had to end before its drive; what was recorded is complete."""


class SeedError(PdtuiError):
    """Seeds are invalid, or reserved for another purpose."""


class PictureError(PdtuiError):
    """A picture cannot be drawn or written."""


class SettingsError(PdtuiError):
    """The user's settings are malformed, or name something that does not exist."""


class ScreenError(PdtuiError):
    """The terminal cannot show the screen."""


class TrainingError(PdtuiError):
    """A training run cannot start or continue."""


class StudyError(PdtuiError):
    """A study's plan, data or policies are missing or malformed."""


class WorkerError(PdtuiError):
    """A worker process died."""


def format_error_in_one_line(error: BaseException) -> str:
    """Format an exception and the place where it was raised in one line, for use without a traceback."""
    words = " ".join(traceback.format_exception_only(error)[-1].split())
    frames = traceback.extract_tb(error.__traceback__)
    if not frames:
        return words
    last = frames[-1]
    return f"{words} ({PurePath(last.filename).name}, line {last.lineno}, in {last.name})"
