"""Answers to what a weights file leaves open: the user's options and the world's spaces."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

from pdtui.core.errors import PolicyError
from pdtui.policies.weights.weights_header import hash_file

ACTIVATION_NAMES = ("tanh", "relu", "elu", "gelu", "silu", "leaky_relu", "selu", "sigmoid", "softplus")
SQUASH_NAMES = ("none", "tanh", "clip")
NO_NORMALIZER = "none"


@dataclass(frozen=True)
class ImportOptions:
    """Answers to what a weights file does not state; they take precedence over the file.

    Attributes:
        activation: Activation function of the hidden layers, one of `ACTIVATION_NAMES`; empty for the file's.
        squash: How an output becomes an action, one of `SQUASH_NAMES`: ``none`` takes it as it is, ``tanh``
            squashes it into the bounds, ``clip`` clips it to them; empty for what the file says.
        normalizer: File with the statistics of the observation; ``none`` for no normalization; empty for the
            statistics in the weights file, if any.
    """

    activation: str = ""
    squash: str = ""
    normalizer: str = ""

    def __post_init__(self) -> None:
        for what, value, names in (
            ("activation", self.activation, ACTIVATION_NAMES),
            ("squash", self.squash, SQUASH_NAMES),
        ):
            if value and value not in names:
                raise PolicyError(f"unknown {what} '{value}'; available: {', '.join(names)}")

    def or_else(self, others: ImportOptions) -> ImportOptions:
        """Return these options, completed by the others where these are empty."""
        pairs = zip(astuple(self), astuple(others), strict=True)
        return ImportOptions(*(own or other for own, other in pairs))

    def identify(self) -> tuple[str, str, str]:
        """Return what makes two readings of one weights file differ, with the hash of the normalizer's file.

        Raises:
            PolicyError: That file cannot be read.
        """
        statistics = Path(self.normalizer)
        found = self.normalizer and statistics.is_file()
        return self.activation, self.squash, hash_file(statistics) if found else self.normalizer


NO_OPTIONS = ImportOptions()


@dataclass(frozen=True)
class ObservationActionSpaces:
    """The observations and actions of a world.

    Attributes:
        owner: Name of the world, for messages.
        observations: Length of the flattened observation.
        actions: Length of the action; 1 for a discrete action.
        low, high: Bounds of each action; empty where there are none, and for discrete actions.
        discrete_actions: Number of discrete actions; 0 where actions are continuous.
        shape: Shape of the observation.
    """

    owner: str
    observations: int
    actions: int
    low: tuple[float, ...] = ()
    high: tuple[float, ...] = ()
    discrete_actions: int = 0
    shape: tuple[int, ...] = ()

    @classmethod
    def of(cls, owner: str, observation_space: Any, action_space: Any) -> ObservationActionSpaces:
        """Return the description of Gymnasium's spaces, with flattened shapes.

        Observations that are not an array of numbers are a `PolicyError`.
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
    def of_world(cls, world: Any) -> ObservationActionSpaces:
        """Return the description of a robot's spaces, as `of` does."""
        return cls.of(world.name, world.observation_space, world.action_space)

    def check(self, source: str, observations: int, actions: int, discrete_actions: int) -> None:
        """Check that a policy of these sizes fits; otherwise a `PolicyError` states both."""
        expected = _describe_spaces(self.observations, self.actions, self.discrete_actions)
        found = _describe_spaces(observations, actions, discrete_actions)
        if expected != found:
            raise PolicyError(f"{source}: expected {expected}, as {self.owner} has; the policy has {found}")


def _describe_spaces(observations: int, actions: int, discrete_actions: int) -> str:
    acts = f"{discrete_actions} discrete actions" if discrete_actions else f"actions of shape ({actions},)"
    return f"observations of shape ({observations},) and {acts}"
