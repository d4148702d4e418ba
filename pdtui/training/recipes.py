"""What differs between robots when their policies are trained."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Recipe:
    """How a robot is trained unless the command line says otherwise.

    Attributes:
        options: for the robot's class.
        changes: of the algorithm's configuration; those that it does not have are left out.
    """

    options: dict[str, Any] = field(default_factory=dict)
    changes: dict[str, Any] = field(default_factory=dict)


# Falling costs the bipedal walker 100, as much as a third of the way earns.
RECIPES: dict[str, Recipe] = {
    "ant": Recipe(options={"forward": "x"}),
    "bipedal_walker": Recipe(changes={"reward_scale": 0.1, "evaluate_steps": 1600}),
    "walker": Recipe(options={"alternate": True, "top_speed": 3.4}, changes={"discount": 0.995}),
}
