"""Who presses keys in the forest in a person's place: the operator, and a placebo that sees nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from pdtui.core.attributes import Floats
from pdtui.driving.control_loop import ControlLoop
from pdtui.evaluation.protocol_settings import RandomPurpose, purpose_generator
from pdtui.paper.forest.key_motion_model import KeyMotionModel
from pdtui.paper.forest.operator_sight import STEPS_PER_FRAME, OperatorSight
from pdtui.paper.forest.scripted_operator import ScriptedOperator, operator_behaviors, operator_keys


class KeyPresser(Protocol):
    """Presses keys of a drive."""

    def press(self, step: int) -> str:
        """Return the key to press before a control step, or an empty string; call it once per step."""


class OperatorPresser:
    """The scripted operator before the screen of a drive that has not begun."""

    def __init__(self, loop: ControlLoop, key_models: Mapping[str, KeyMotionModel]) -> None:
        dt = loop.robot.control_dt
        periods = {
            task: max(1, round(one.period / dt))
            for task, one in operator_behaviors(loop.map).items()
            if task in key_models and one.period is not None
        }
        self._loop, self._keys = loop, operator_keys(loop.map)
        self._operator = ScriptedOperator(key_models, dt, periods)
        self._sight = OperatorSight(loop.robot.links, loop.robot.scenery.cylinders)
        self._yaw = loop.robot.attribute_index("yaw")
        self._trees: Floats = loop.robot.scenery.cylinders[:0]

    def press(self, step: int) -> str:
        poses = self._loop.robot.read_poses()
        if step % STEPS_PER_FRAME == 0:
            self._trees = self._sight.look(poses)
        x, y = poses[0, :2].tolist()
        name = self._operator.choose_key(x, y, float(self._loop.attributes[self._yaw]), self._trees)
        return self._keys[name] if name else ""


class PlaceboPresser:
    """Presses the keys that the operator pressed in the same forest, in random order and at random times.

    So it presses the same keys equally often and differs in one thing: it does not look. In a longer drive
    than the operator's, the keys come again, in another order and at other times.

    Args:
        keys: keys that the operator pressed.
        steps: control steps of the operator's drive.
        seed: seed of the forest; the placebo has a stream of its own.
    """

    def __init__(self, keys: Sequence[str], steps: int, seed: int) -> None:
        self._keys, self._steps = tuple(keys), steps
        self._rng = purpose_generator(RandomPurpose.PLACEBO_KEYS, seed)
        self._upcoming: dict[int, str] = {}

    def press(self, step: int) -> str:
        if step % self._steps == 0:
            times = self._rng.choice(self._steps, len(self._keys), replace=False)
            self._upcoming = {step + int(time): key for time, key in zip(times, self._keys, strict=True)}
        return self._upcoming.get(step, "")
