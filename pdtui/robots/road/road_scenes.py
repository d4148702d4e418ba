"""The scenes of the roads: which map a seed stands for, and what is on it."""

from __future__ import annotations

from dataclasses import dataclass

from pdtui.core.errors import RobotError

TEST_SCENES = 20
_FIRST_TEST_SCENE = 500
_TEST_PREFIX = "test-"


@dataclass(frozen=True)
class SceneKind:
    """A kind of scene.

    Attributes:
        first: MetaDrive's seed of its first scene.
        count: Number of its scenes.
        accident_probability: Probability of an accident or a construction site on a block of the road.
        traffic_density: Cars on 10 m of a lane.
        blocks: Blocks of the road: their number, or their letters in MetaDrive's notation.
        middle_lane: Whether the car starts in the middle of three lanes; otherwise in a random one.
    """

    first: int
    count: int
    accident_probability: float
    traffic_density: float
    blocks: int | str = 3
    middle_lane: bool = False


SCENE_KINDS = {
    "quiet": SceneKind(10_000, 10_000, 0.0, 0.05),
    "training": SceneKind(0, 50, 0.0, 0.1),
    "traffic": SceneKind(30_000, 10_000, 0.8, 0.1),
    "straight": SceneKind(50_000, 10_000, 0.0, 0.0, "SSSSSSSS", middle_lane=True),
    "test": SceneKind(_FIRST_TEST_SCENE, TEST_SCENES, 0.8, 0.1),
}
"""Kinds of scenes by name. ``test`` are those of the paper's experiment; ``training`` are the only ones that
policies are trained on; ``straight`` is a road of three lanes without traffic."""
SCENE_STARTS = (*SCENE_KINDS, *(f"{_TEST_PREFIX}{number}" for number in range(TEST_SCENES)))
"""Names of starts: a kind of scene, of which the seed chooses one, or one of the test scenes."""


def find_scene(start: str, seed: int) -> tuple[SceneKind, int]:
    """Return the kind of a start and MetaDrive's seed of the scene that a drive's seed chooses.

    Raises:
        RobotError: There is no such start.
    """
    if start not in SCENE_STARTS:
        raise RobotError(f"metadrive: no scenes '{start}'; available: {', '.join(SCENE_STARTS)}")
    if start in SCENE_KINDS:
        kind = SCENE_KINDS[start]
        return kind, kind.first + seed % kind.count
    return SCENE_KINDS["test"], _FIRST_TEST_SCENE + int(start.removeprefix(_TEST_PREFIX))
