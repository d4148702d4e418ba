"""Names in a session file: the entities, properties and columns that are written and read."""

from __future__ import annotations

from typing import Literal, get_args

from pdtui.core.printable_text import make_printable

APP = "pdtui"
"""The application of a session, or how its name begins: see `rerun_application_id`."""
SCHEMA = 1
STEP, TIME = "step", "time"

DRIVE = "/drive"
"""One row per control step, in one entity: another would cost a kilobyte per batch, a column a hundred
bytes."""

EVENTS = "/events"
ENDINGS = "/endings"
OUTCOMES = "/outcomes"
"""One row per outcome of an episode; a word that ends none has a line for the viewer, too."""

BEHAVIORS = "/behaviors"
VIEWS = "/view/"
ROBOT = "/view/robot"
PATH = "/view/path"
OBSTACLES = "/view/obstacles"
OBSTACLES_ABOVE = "/view/obstacles_above"
ROAD_LINES = "/view/road_lines"
TRAFFIC = "/view/traffic"
UNITS = "/view/units"
TARGETS = "/view/targets"
MAGNITUDES = "/view/magnitudes"
HEAT_MAP = "/view/activations"
TABLE = "/view/table"

INFO, VERSIONS, OUTCOME, REPAIR = "drive", "versions", "outcome", "repair"

ACTIVATIONS, HALF_ACTIVATIONS = "activations", "activations_float16"
"""Activations as float32 and as float16. A column has the same type in all sessions, or no viewer could show
two of them together; earlier versions wrote both into the first."""

REWARD_COST_ACTION, DIGEST_EPISODE = "reward_cost_action", "digest_episode"

ACTIVE_FIELDS = ("remaining", "factor", "target", "value", "error", "magnitude", "waiting")
"""Fields in the column ``active``: those of an `ActiveBehavior` except its name, with NaN for None."""

ExportFormat = Literal["parquet", "csv", "mcap"]
"""Formats into which streams are exported."""

EXPORT_FORMATS: tuple[ExportFormat, ...] = get_args(ExportFormat)

LEROBOT = "lerobot"
"""Format of a whole session as a dataset, in a folder."""

ActivationsKept = Literal["all", "half", "off"]
"""How activations are recorded: as float32, as float16, or not at all."""

ACTIVATIONS_KEPT: tuple[ActivationsKept, ...] = get_args(ActivationsKept)


def rerun_application_id(robot: str, created: str, recording_id: str) -> str:
    """Return the name of the application that a session is a recording of: one of its own.

    A viewer has one layout for all recordings of an application, and takes them for one data set.

    Args:
        robot: name of the robot.
        created: date and time at which the drive began, ISO 8601.
        recording_id: identifier of the recording.
    """
    began = created.replace("T", " ")[:19]
    return " ".join(make_printable(f"{APP} {robot[:60]} {began} {recording_id[:6]}").split())


def is_session_application_id(name: str) -> bool:
    """Return whether recordings of an application are sessions; those of earlier versions shared one."""
    return name == APP or name.startswith(f"{APP} ")
