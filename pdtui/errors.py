"""The exceptions that pdtui raises on purpose.

Every message names the thing at fault, what was expected of it and what is there, so that the command line
can print it as its only line.
"""


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


class EventError(PdtuiError):
    """A keystroke file or an event cannot be applied."""


class SessionError(PdtuiError):
    """A recording cannot be written, read or replayed."""


class PictureError(PdtuiError):
    """A picture cannot be drawn or written."""


class ScreenError(PdtuiError):
    """The terminal cannot show the screen."""


class TrainingError(PdtuiError):
    """A training run cannot start or go on."""
