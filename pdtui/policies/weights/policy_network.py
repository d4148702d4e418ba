"""The multilayer perceptron that pdtui trains and loads, and its specification."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Literal, get_args

import torch
from torch import nn

from pdtui.core.errors import PolicyError

ACTIVATIONS: dict[str, type[nn.Module]] = {
    "tanh": nn.Tanh,
    "relu": nn.ReLU,
    "elu": nn.ELU,
    "gelu": nn.GELU,
    "silu": nn.SiLU,
    "leaky_relu": nn.LeakyReLU,
    "selu": nn.SELU,
    "sigmoid": nn.Sigmoid,
    "softplus": nn.Softplus,
}
MAX_WIDTH, MAX_LAYERS = 1 << 20, 100
"""Limits beyond which a file is damaged or hostile."""
Head = Literal["squashed_gaussian", "tanh", "gaussian", "mean", "categorical"]
LogStd = Literal["output", "parameter"]


@dataclass(frozen=True)
class NetworkSpec:
    """Everything about a policy network but its weights.

    Attributes:
        robot: Robot that the policy drives; empty for any robot whose shapes fit.
        observations: Length of the observation.
        layers: Widths of the hidden layers.
        activation: Activation function, one of `ACTIVATIONS`.
        actions: Length of the action; with ``categorical``, the number of discrete actions.
        head: How the action is computed. ``squashed_gaussian`` is tanh of a Gaussian sample, rescaled to the
            bounds; ``gaussian`` is a Gaussian sample, clipped to the bounds; ``tanh`` and ``mean`` are these
            two without a distribution; ``categorical`` selects by logits, and the action is an index.
        action_low, action_high: Bounds of each action; both empty where there are none.
        command: Command line that trained the policy, or where it came from.
        score: What the training measured.
        log_std: Source of a Gaussian's log standard deviation: further outputs of the head, or parameters
            that do not depend on the observation.
        log_std_low, log_std_high: Range of the log standard deviation.
        log_std_rule: How it is brought into the range: by clipping or by tanh.
        mean_limit: Limit of the magnitude of the mean before tanh; 0 for none.
        observation_clip: Limit of the magnitude of normalized observations; 0 for none.
    """

    robot: str
    observations: int
    layers: tuple[int, ...]
    activation: str
    actions: int
    head: Head
    action_low: tuple[float, ...]
    action_high: tuple[float, ...]
    command: str = ""
    score: dict[str, Any] = field(default_factory=dict)
    log_std: LogStd = "output"
    log_std_low: float = -5.0
    log_std_high: float = 2.0
    log_std_rule: Literal["clip", "tanh"] = "clip"
    mean_limit: float = 0.0
    observation_clip: float = 0.0

    def __post_init__(self) -> None:
        for what, value, known in (
            ("activation function", self.activation, tuple(ACTIVATIONS)),
            ("head", self.head, get_args(Head)),
            ("source of the log standard deviation", self.log_std, get_args(LogStd)),
            ("rule for the log standard deviation", self.log_std_rule, ("clip", "tanh")),
        ):
            if value not in known:
                raise PolicyError(f"unknown {what} '{value}'; available: {', '.join(known)}")
        squashed = self.head in ("squashed_gaussian", "tanh")
        allowed = {0} if self.head == "categorical" else {self.actions} if squashed else {0, self.actions}
        if len(self.action_low) not in allowed or len(self.action_high) != len(self.action_low):
            low, high = len(self.action_low), len(self.action_high)
            raise PolicyError(f"expected {max(allowed)} action bounds, got {low} and {high}")

    def check_values(self) -> None:
        """Check every field, since a file may hold anything; a wrong one is a `PolicyError`."""
        sizes = (self.observations, self.actions, *self.layers)
        if not all(type(size) is int and 0 < size <= MAX_WIDTH for size in sizes):
            raise PolicyError(f"expected sizes of 1 to {MAX_WIDTH}, found {str(sizes)[:80]}")
        if not 0 < len(self.layers) <= MAX_LAYERS:
            raise PolicyError(f"expected 1 to {MAX_LAYERS} hidden layers, found {len(self.layers)}")
        limits = (self.log_std_low, self.log_std_high, self.mean_limit, self.observation_clip)
        for value in (*limits, *self.action_low, *self.action_high):
            if type(value) not in (int, float) or not -1e30 < value < 1e30:
                raise PolicyError(f"expected bounds and limits that are numbers, found {str(value)[:40]}")
        if not isinstance(self.robot, str) or not isinstance(self.command, str):
            raise PolicyError("expected robot and command as text")
        if not isinstance(self.score, dict):
            raise PolicyError("expected a score by name")

    @property
    def gaussian(self) -> bool:
        """Whether the policy has a Gaussian distribution of actions."""
        return self.head in ("squashed_gaussian", "gaussian")

    @property
    def action_size(self) -> int:
        """Length of the action: 1 for a discrete one."""
        return 1 if self.head == "categorical" else self.actions


class Normalizer(nn.Module):
    """Computes ``(observation − mean) / std``, clipped to ± `clip` unless that is 0."""

    mean: torch.Tensor
    std: torch.Tensor

    def __init__(self, observations: int, clip: float = 0.0) -> None:
        super().__init__()
        self.clip = clip
        self.register_buffer("mean", torch.zeros(observations))
        self.register_buffer("std", torch.ones(observations))

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        x = (observation - self.mean) / self.std
        return x.clamp(-self.clip, self.clip) if self.clip else x


class PolicyNetwork(nn.Module):
    """The network: observation → normalizer → (linear → activation) × L → head.

    The normalizer is skipped unless the weights contain one. `log_std`, shape (actions,), exists where the
    specification says that it is a parameter.
    """

    log_std: torch.Tensor

    def __init__(self, spec: NetworkSpec) -> None:
        super().__init__()
        self.spec = spec
        self.normalizer = Normalizer(spec.observations, spec.observation_clip)
        widths = [spec.observations, *spec.layers]
        self.hidden = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(widths))
        self.activations = nn.ModuleList(ACTIVATIONS[spec.activation]() for _ in spec.layers)
        wide = spec.gaussian and spec.log_std == "output"
        self.head = nn.Linear(widths[-1], spec.actions * (2 if wide else 1))
        if spec.gaussian and spec.log_std == "parameter":
            self.register_buffer("log_std", torch.zeros(spec.actions))
        self.normalizes = False

    def load_tensors(self, tensors: dict[str, torch.Tensor]) -> None:
        """Load weights by name.

        A tensor that is missing, superfluous, of another shape or not finite is a `PolicyError`.
        """
        check_tensor_shapes(self.state_dict(), tensors)
        for name, tensor in tensors.items():
            if not bool(torch.isfinite(tensor).all()):
                raise PolicyError(f"tensor '{name}': expected finite numbers, found NaN or infinity")
        self.load_state_dict(tensors)
        mean, std = self.normalizer.mean, self.normalizer.std
        moved = bool((mean != 0).any() or (std != 1).any())
        self.normalizes = moved or self.normalizer.clip > 0

    def stages(self) -> list[nn.Module]:
        """Return the submodules in the order in which `forward` calls them."""
        pairs = zip(self.hidden, self.activations, strict=True)
        first: list[nn.Module] = [self.normalizer] if self.normalizes else []
        return [*first, *(stage for pair in pairs for stage in pair), self.head]

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        """Return the head's output for observations of shape (..., observations)."""
        for stage in self.stages():
            observation = stage(observation)
        return observation


def check_tensor_shapes(expected: Mapping[str, torch.Tensor], found: Mapping[str, torch.Tensor]) -> None:
    """Check that tensors have the expected names and shapes; others are a `PolicyError`."""
    shapes, others = ({name: tuple(one.shape) for name, one in all.items()} for all in (expected, found))
    for name in sorted(shapes.keys() | others.keys()):
        if shapes.get(name) != others.get(name):
            wanted, there = (all.get(name, "none") for all in (shapes, others))
            raise PolicyError(f"tensor '{name}': expected shape {wanted}, found {there}")
