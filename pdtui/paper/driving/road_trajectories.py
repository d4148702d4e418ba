"""The figure of the paper's appendix: where the car drove, from above, and which behavior acted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.step_record import StepRecord
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop
from pdtui.paper.driving.drive_operators import SharedControl, make_operator
from pdtui.paper.driving.driving_episode import TEST_STARTS, drive_episode
from pdtui.paper.driving.driving_results import DrivingExperimentResult
from pdtui.paper.driving.key_effects import KeyEffects
from pdtui.paper.driving.operator_memory import sample_judgment_errors
from pdtui.paper.driving.sight_reader import read_boxes
from pdtui.robots.robot import Robot

_MOST_SCENES = 6
_STOOD = 1.0
"""Farthest that something moves that counts as standing, m."""


class DriveWatcher:
    """Notes where the car and what is around it have been."""

    def __init__(self) -> None:
        self.lines: tuple[Floats, ...] = ()
        self.places: list[Floats] = []
        self.behaviors: list[str] = []
        self._others: dict[tuple[str, int], list[Floats]] = {}

    def watch(self, record: StepRecord) -> None:
        """Note what is there after a step."""
        self.places.append(record.poses[0, :2].copy())
        acting = record.behaviors[-1].name if record.behaviors else ""
        self.behaviors.append("operator" if record.replaced else acting)
        if not self.lines:
            self.lines = tuple(line.points[:, :2] for line in record.scenery.lines if line.kind != "route")
        for key, box in read_boxes(record.scenery, record.traffic).items():
            self._others.setdefault(key, []).append(box)

    def standing(self) -> Floats:
        """Return the boxes that have not moved: x, y (m), yaw (rad), length and width (m), shape (K, 5)."""
        return np.array([boxes[0] for boxes in self._others.values() if _stood(boxes)]).reshape(-1, 5)

    def tracks(self) -> tuple[Floats, ...]:
        """Return the ways of the others, x and y in m, shape (N, 2) each."""
        return tuple(np.array(boxes)[:, :2] for boxes in self._others.values() if not _stood(boxes))


def choose_scenes(result: DrivingExperimentResult, policy: str) -> list[str]:
    """Return the scenes to draw: those in which the policy alone fails, else the first ones."""
    alone = next((row for row in result.rows if (row.policy, row.control) == (policy, "alone")), None)
    failed = [one.scene for one in alone.scores if not one.success] if alone is not None else []
    return (failed or list(result.scenes))[:_MOST_SCENES]


def draw_trajectories(paths: Sequence[Path], config: DriveConfig, result: DrivingExperimentResult) -> None:
    """Drive the scenes to draw once more, alone and with keys, and draw the ways.

    Raises:
        PdtuiError: As `evaluate_driving`, or a picture cannot be written.
    """
    if not paths:
        return
    from pdtui.pictures.road_pictures import RoadPicture, draw_road_pictures

    policy = Path(config.stimulation_map.source).stem
    effects = result.effects.get(policy)
    control: SharedControl = "keys" if effects is not None else "takeover"
    pictures, robot = [], None
    for scene in choose_scenes(result, policy):
        alone, ended, robot = _drive(config, robot, scene, "alone", None)
        shared, reached, robot = _drive(config, robot, scene, control, effects)
        title = f"{scene}: alone: {ended}; shared: {reached}"
        places = np.array(alone.places), np.array(shared.places)
        behaviors = tuple(shared.behaviors)
        pictures.append(
            RoadPicture(title, shared.lines, shared.standing(), shared.tracks(), *places, behaviors)
        )
    if robot is not None:
        robot.close()
    draw_road_pictures(paths, f"{config.robot}, driven by {policy} and an operator", pictures)


def _drive(
    config: DriveConfig, robot: Robot | None, scene: str, control: SharedControl, effects: KeyEffects | None
) -> tuple[DriveWatcher, str, Robot]:
    loop = build_control_loop(replace(config, start=scene), robot)
    judgment = sample_judgment_errors(0, TEST_STARTS.index(scene))
    watcher = DriveWatcher()
    score = drive_episode(loop, make_operator(control, loop, effects, judgment), watcher.watch)
    return watcher, score.outcome, loop.robot


def _stood(boxes: Sequence[Floats]) -> bool:
    path = np.array(boxes)[:, :2]
    return bool(np.hypot(*(path - path[0]).T).max() < _STOOD)
