"""What differs between robots when their policies are trained."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class TrainingRecipe:
    """How a robot is trained unless the command line says otherwise.

    Attributes:
        options: for the robot's class.
        changes: of the algorithm's configuration; those that it does not have are left out.
        worlds: builds all worlds of a run at once, from their number, the seed and an episode's steps; None
            makes one robot each.
        begin: name of the weights that PPO begins from; none where empty.
    """

    options: dict[str, Any] = field(default_factory=dict)
    changes: dict[str, Any] = field(default_factory=dict)
    worlds: Callable[[int, int, int], Any] | None = None
    begin: str = ""


def _legged(name: str, commands: int) -> Callable[[int, int, int], Any]:
    def build(count: int, seed: int, episode: int) -> Any:
        from pdtui.training.legged_worlds import LeggedWorldBatch

        return LeggedWorldBatch(name, commands, count, seed, episode)

    return build


_LEGGED = {
    "worlds": 256,
    "minibatch": 2048,
    "layers": (128, 64, 32),
    "reward_scale": 2.0,
    "entropy": 0.004,
    "evaluate_every": 1_000_000,
    "evaluate_steps": 500,
}


# PyBullet holds on to Python while it steps, and its steps are dear: smaller batches than the paper's 16384
# learn from fewer of them, and a world takes 70 MB.
_BULLET = {
    "layers": (256, 256, 256, 256),
    "processes": True,
    "worlds": 32,
    "chunk": 128,
    "minibatch": 512,
    "total_steps": 6_000_000,
    "evaluate_every": 163_840,
    "evaluate_steps": 400,
}
# Faster, and no driver could steer it between trees.
_A1_SPEED = 2.0

# Falling costs the bipedal walker 100, as much as a third of the way earns.
RECIPES: dict[str, TrainingRecipe] = {
    "a1": TrainingRecipe({"terrain": "rough", "top_speed": _A1_SPEED}, _BULLET),
    "a1-vision": TrainingRecipe(
        {"terrain": "forest", "top_speed": _A1_SPEED}, _BULLET | {"learning_rate": 1e-4}, begin="a1"
    ),
    "ant": TrainingRecipe(options={"forward": "x"}),
    "anymal": TrainingRecipe({"random_commands": True}, _LEGGED, _legged("anymal", 3)),
    "anymal-forward": TrainingRecipe({"random_commands": True}, _LEGGED, _legged("anymal-forward", 1)),
    "bipedal_walker": TrainingRecipe(changes={"reward_scale": 0.1, "evaluate_steps": 1600}),
    "walker": TrainingRecipe(options={"alternate": True, "top_speed": 3.4}, changes={"discount": 0.995}),
}
