"""Directions of edits: which way a layer's outputs move, on average, when the observation is edited.

An imprint computes that anew in every control step; a direction is the mean over a walk. Language
models are steered likewise, along the mean difference of a layer's activations between two sets of texts
(Rimsky et al., "Steering Llama 2 via Contrastive Activation Addition", 2024). Here, both sides of the
difference are the same moments of the same walk.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.errors import RobotError
from pdtui.policies.runtime.policy import Policy
from pdtui.robots.observation_edits.observation_edit import ObservationEdit
from pdtui.robots.robot import Robot
from pdtui.stimulation.interventions.intervention import Intervention, LayerVectors

_FIRST, _EVERY = 100, 4
"""First control step of a walk whose observation counts, and control steps from one to the next."""


@dataclass(frozen=True, eq=False)
class ObservationEditDirection:
    """The mean change of one layer's outputs by edits of the observation.

    Attributes:
        layer: Index of the layer.
        change: Mean change, shape (n,) for a layer of n units.
        common: Share of the mean squared change that this mean is, 0 to 1. Where it is small, the edit does
            something else at each moment of the gait, and no direction can stand for it.
    """

    layer: int
    change: Floats
    common: float

    @property
    def length(self) -> float:
        """Length of the mean change."""
        return float(np.linalg.norm(self.change))

    def make_layer_vectors(self, name: str) -> LayerVectors:
        """Return the unit vector along it, as a map keeps it."""
        return LayerVectors(name, str(self.layer), (self.change / self.length)[None].astype(np.float32))

    def make_intervention(self, name: str, dose: float = 1.0) -> Intervention:
        """Return the intervention that adds the mean change times `dose`, along the vector called `name`."""
        return Intervention("direction", vectors=name, coordinates=(dose * self.length,))


def sample_walk_observations(robot: Robot, policy: Policy, seed: int, steps: int = 400) -> list[Floats]:
    """Return every fourth observation of a walk without interventions.

    Those of the first hundred control steps, in which the walk begins, are left out if it lasts longer.
    """
    observation, _ = robot.reset(seed=seed)
    policy.reset()
    found = []
    for step in range(steps):
        if step % _EVERY == 0:
            found.append(np.array(observation, np.float64))
        observation, _, ends = robot.step_without_reward(policy.act(observation).action)
        if ends:
            break
    return found[_FIRST // _EVERY :] or found


def fit_edit_direction(
    policy: Policy,
    observations: Sequence[Floats],
    edits: Sequence[ObservationEdit],
    sizes: Mapping[str, float],
    layer: int = 0,
) -> ObservationEditDirection:
    """Return the direction of edits in a layer.

    It is half the difference between what edits of these sizes and of their negatives make of the outputs.

    Args:
        policy: The policy; a recurrent one is in its present state.
        observations: Observations of a walk, as `sample_walk_observations` returns them.
        edits: The robot's edits of its observation.
        sizes: Sizes of edits by name, which are made one after the other.
        layer: Index of the layer.

    Raises:
        RobotError: The robot has no such edit.
    """
    by_name = {one.name: one for one in edits}
    for name in sizes:
        if name not in by_name:
            known = ", ".join(by_name) or "none"
            raise RobotError(f"no edit '{name}' of the observation; available: {known}")
    first = sum(policy.layers[:layer])
    units = slice(first, first + policy.layers[layer])

    def outputs(observation: Floats, sign: float) -> Floats:
        for name, size in sizes.items():
            observation = by_name[name].apply(observation, sign * size)
        return policy.activations_for(observation, units.stop - 1)[units].astype(np.float64)

    changes = np.array([0.5 * (outputs(one, 1.0) - outputs(one, -1.0)) for one in observations])
    mean, power = changes.mean(axis=0), float((changes**2).sum(axis=1).mean())
    return ObservationEditDirection(layer, mean, float((mean**2).sum()) / power if power else 0.0)
