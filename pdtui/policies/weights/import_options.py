"""What a weights file may leave open, and what the world says about it. Loads no heavy library."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from pdtui.core.errors import PolicyError

ACTIVATION_NAMES = ("tanh", "relu", "elu", "gelu", "silu", "leaky_relu", "selu", "sigmoid", "softplus")
SQUASH_NAMES = ("none", "tanh", "clip")
NO_NORMALISER = "none"


@dataclass(frozen=True)
class ImportOptions:
    """Answers to what a weights file does not state. An answer beats what the file says.

    Attributes:
        activation: function of the hidden layers, one of `ACTIVATION_NAMES`; empty: as the file says.
        squash: how the output becomes an action, one of `SQUASH_NAMES`: ``none`` takes it as it is, ``tanh``
            squashes it into the bounds, ``clip`` clips it to them; empty: as the file says.
        normaliser: file with the statistics of the observation; ``none`` for none at all; empty: those in
            the weights file, if any.
    """

    activation: str = ""
    squash: str = ""
    normaliser: str = ""

    def __post_init__(self) -> None:
        for what, value, names in (
            ("activation", self.activation, ACTIVATION_NAMES),
            ("squash", self.squash, SQUASH_NAMES),
        ):
            if value and value not in names:
                raise PolicyError(f"unknown {what} '{value}'; there are {', '.join(names)}")

    def over(self, others: ImportOptions) -> ImportOptions:
        """These choices, and the others where these are silent."""
        return ImportOptions(
            self.activation or others.activation,
            self.squash or others.squash,
            self.normaliser or others.normaliser,
        )


NO_OPTIONS = ImportOptions()


@dataclass(frozen=True)
class WorldSpaces:
    """What a world gives to a policy and takes from it.

    Attributes:
        owner: name of the world, for messages.
        observations: length of the observation.
        actions: length of the action; of a discrete action, 1.
        low, high: bounds of each action; empty where there are none, or where actions are discrete.
        discrete_actions: number of discrete actions; 0 where actions are continuous.
        shape: of the observation.
    """

    owner: str
    observations: int
    actions: int
    low: tuple[float, ...] = ()
    high: tuple[float, ...] = ()
    discrete_actions: int = 0
    shape: tuple[int, ...] = ()

    @classmethod
    def of(cls, owner: str, observation_space: Any, action_space: Any) -> WorldSpaces:
        """From Gymnasium's spaces, whose shapes are flattened.

        Raises:
            PolicyError: observations that are no array of numbers.
        """
        if observation_space.shape is None:
            raise PolicyError(f"{owner}: expected observations of one shape, found {observation_space}")
        shape = tuple(int(size) for size in observation_space.shape)
        observations = math.prod(shape)
        if hasattr(action_space, "start") and hasattr(action_space, "n"):
            return cls(owner, observations, 1, discrete_actions=int(action_space.n), shape=shape)
        actions = math.prod(action_space.shape or ())
        if not hasattr(action_space, "low"):
            return cls(owner, observations, actions, shape=shape)
        low, high = action_space.low.reshape(-1).tolist(), action_space.high.reshape(-1).tolist()
        if not all(map(math.isfinite, (*low, *high))):
            return cls(owner, observations, actions, shape=shape)
        return cls(owner, observations, actions, tuple(low), tuple(high), shape=shape)

    @classmethod
    def of_world(cls, world: Any) -> WorldSpaces:
        """Of a robot, by its name and spaces.

        Raises:
            PolicyError: as `of`.
        """
        return cls.of(world.name, world.observation_space, world.action_space)

    def check(self, source: str, observations: int, actions: int, discrete_actions: int) -> None:
        """See that a policy of these sizes fits.

        Raises:
            PolicyError: it does not; the message names both shapes.
        """
        if (observations, actions, discrete_actions) == (
            self.observations,
            self.actions,
            self.discrete_actions,
        ):
            return
        raise PolicyError(
            f"{source}: expected {_words(self.observations, self.actions, self.discrete_actions)}, as "
            f"{self.owner} has; the policy has {_words(observations, actions, discrete_actions)}"
        )


def _words(observations: int, actions: int, discrete_actions: int) -> str:
    acts = f"{discrete_actions} discrete actions" if discrete_actions else f"actions of shape ({actions},)"
    return f"observations of shape ({observations},) and {acts}"
