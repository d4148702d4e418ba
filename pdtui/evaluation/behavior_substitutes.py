"""What stands in for a behavior's units: random units, a random direction, or a push on the actions.

A behavior says something about its units only if these do not do as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from pdtui.core.units import Stimulation, split_flat_index
from pdtui.driving.control_loop import PolicyAct
from pdtui.evaluation.disturbance_conditions import shift_action
from pdtui.evaluation.protocol_settings import RandomPurpose, purpose_generator
from pdtui.policies.runtime.policy import Policy, PolicyStep
from pdtui.robots.robot import Robot


class BehaviorSubstitute(Protocol):
    """Acts in a behavior's place while it is latched."""

    def act(self, policy: Policy, robot: Robot, observation: NDArray[Any]) -> PolicyStep:
        """Act for one control step."""
        ...


@dataclass(frozen=True)
class RandomUnits:
    """As many other units of the same layers, overwritten by the same outputs with random signs."""

    stimulation: Stimulation

    def act(self, policy: Policy, robot: Robot, observation: NDArray[Any]) -> PolicyStep:
        """Act with these units overwritten."""
        del robot
        return policy.act(observation, self.stimulation)


@dataclass(frozen=True)
class RandomDirection:
    """A random vector, added to all units of each layer that the behavior overwrites.

    Attributes:
        added: The vector of each layer, by layer.
    """

    added: dict[int, tuple[float, ...]]

    def act(self, policy: Policy, robot: Robot, observation: NDArray[Any]) -> PolicyStep:
        """Act with the vectors added to what the units put out, the lower layers first."""
        del robot
        values: dict[int, float] = {}
        state = policy.snapshot()
        for layer, vector in sorted(self.added.items()):
            first = sum(policy.layers[:layer])
            natural = policy.act(observation, Stimulation.of(values)).activations
            policy.restore(state)
            values |= {first + unit: float(natural[first + unit]) + add for unit, add in enumerate(vector)}
        return policy.act(observation, Stimulation.of(values))


@dataclass(frozen=True)
class ActionShift:
    """The mean change that the behavior makes to the action, added to the action of the untouched policy."""

    shift: tuple[float, ...]

    def act(self, policy: Policy, robot: Robot, observation: NDArray[Any]) -> PolicyStep:
        """Act with the action shifted."""
        acted = policy.act(observation)
        return shift_action(acted, robot, np.array(self.shift).reshape(acted.action.shape))


@dataclass(frozen=True)
class InterventionSize:
    """How far a behavior moves units and actions, on average over the steps in which it is held.

    Attributes:
        layers: Root mean square length of the change of each layer's units, by layer.
        action: Mean change of the action.
    """

    layers: dict[int, float]
    action: tuple[float, ...]


class InterventionSizeMeter:
    """Measures a `InterventionSize` and the spread of observations while it acts in the policy's place."""

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self._squares: dict[int, list[float]] = {}
        self._shifts: list[NDArray[Any]] = []
        self.observations: list[NDArray[Any]] = []

    def act(
        self, observation: NDArray[Any], stimulation: Stimulation, rng: np.random.Generator | None
    ) -> PolicyStep:
        """Act as the policy does, and note what the stimulation changed."""
        self.observations.append(observation.copy())
        state = self._policy.snapshot()
        acted = self._policy.act(observation, stimulation, rng)
        if stimulation:
            after = self._policy.snapshot()
            self._policy.restore(state)
            self._shifts.append(acted.action - self._policy.act(observation).action)
            self._policy.restore(after)
            lengths: dict[int, float] = {}
            changed = acted.stimulation
            for unit, value, natural in zip(changed.units, changed.values, acted.natural, strict=True):
                layer = split_flat_index(unit, self._policy.layers)[0]
                lengths[layer] = lengths.get(layer, 0.0) + (value - natural) ** 2
            for layer, length in lengths.items():
                self._squares.setdefault(layer, []).append(length)
        return acted

    def size(self) -> InterventionSize | None:
        """Return what was measured; None if no unit was overwritten."""
        if not self._shifts:
            return None
        layers = {layer: float(np.sqrt(np.mean(squares))) for layer, squares in self._squares.items()}
        return InterventionSize(layers, tuple(np.mean(self._shifts, axis=0).ravel().tolist()))


def mean_intervention_size(sizes: Sequence[InterventionSize]) -> InterventionSize:
    """Return the mean of what was measured on several seeds."""
    layers = {layer: float(np.mean([size.layers[layer] for size in sizes])) for layer in sizes[0].layers}
    return InterventionSize(layers, tuple(np.mean([size.action for size in sizes], axis=0).tolist()))


def draw_random_units(outputs: Stimulation, layers: Sequence[int], behavior: str, draw: int) -> RandomUnits:
    """Draw as many units per layer as a behavior overwrites, none of its own, for the same outputs.

    Where a layer has too few other units, some of the behavior's own are among them.
    """
    rng = purpose_generator(RandomPurpose.RANDOM_UNITS, draw, crc32(behavior.encode()))
    values: dict[int, float] = {}
    for layer, width in enumerate(layers):
        first = sum(layers[:layer])
        own = {
            unit: v
            for unit, v in zip(outputs.units, outputs.values, strict=True)
            if first <= unit < first + width
        }
        others = [unit for unit in range(first, first + width) if unit not in own]
        if len(others) < len(own):
            others = list(range(first, first + width))
        drawn = rng.choice(others, size=len(own), replace=False).tolist() if own else []
        signs = rng.choice([-1.0, 1.0], size=len(own)).tolist()
        values |= {u: s * v for u, s, v in zip(drawn, signs, own.values(), strict=True)}
    return RandomUnits(Stimulation.of(dict(sorted(values.items()))))


def draw_random_direction(
    size: InterventionSize, layers: Sequence[int], behavior: str, draw: int
) -> RandomDirection:
    """Draw a direction of each layer that a behavior overwrites, as long as its own change of that layer."""
    rng = purpose_generator(RandomPurpose.RANDOM_DIRECTION, draw, crc32(behavior.encode()))
    added = {}
    for layer, length in sorted(size.layers.items()):
        vector = rng.normal(size=layers[layer])
        added[layer] = tuple((vector * length / np.linalg.norm(vector)).tolist())
    return RandomDirection(added)


def act_in_place(
    act: PolicyAct, policy: Policy, robot: Robot, substitute: BehaviorSubstitute | None
) -> PolicyAct:
    """Return what acts with a substitute for the stimulation while there is one."""
    if substitute is None:
        return act

    def act_with_substitute(
        observation: NDArray[Any], stimulation: Stimulation, rng: np.random.Generator | None
    ) -> PolicyStep:
        if not stimulation:
            return act(observation, stimulation, rng)
        return substitute.act(policy, robot, observation)

    return act_with_substitute
