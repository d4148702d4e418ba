"""Names inside a session file: what the recorder writes and the reader looks for."""

from __future__ import annotations

from typing import Literal, get_args

APP = "pdtui"
SCHEMA = 1
STEP, TIME = "step", "time"

DRIVE = "/drive"
"""One row a control step: an entity more would cost over a kilobyte a batch, a column a hundred bytes."""

EVENTS = "/events"
ENDINGS = "/endings"
BEHAVIORS = "/behaviors"
VIEWS = "/view/"
ROBOT = "/view/robot"
PATH = "/view/path"
OBSTACLES = "/view/obstacles"
OBSTACLES_ABOVE = "/view/obstacles_above"
UNITS = "/view/units"
TARGETS = "/view/targets"
MAGNITUDES = "/view/magnitudes"
HEAT_MAP = "/view/activations"

INFO, VERSIONS, OUTCOME = "drive", "versions", "outcome"

REWARD_COST_ACTION, DIGEST_EPISODE = "reward_cost_action", "digest_episode"

ACTIVE_FIELDS = ("remaining", "factor", "target", "value", "error", "magnitude")
"""Columns of `active`: an `ActiveBehavior` without its name; NaN where it has None."""

OVERWRITE_FIELDS = ("unit", "overwritten", "natural")
"""Columns of `stimulation`."""

ActivationsKept = Literal["all", "half", "off"]
"""How activations are recorded: as they are, as float16, or not at all."""

ACTIVATIONS_KEPT: tuple[ActivationsKept, ...] = get_args(ActivationsKept)
