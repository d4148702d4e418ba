"""The network that pdtui ships and trains: a multilayer perceptron with a Gaussian or a plain head."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Literal

import torch
from torch import nn

from pdtui.errors import PolicyError

ACTIVATIONS: dict[str, type[nn.Module]] = {"tanh": nn.Tanh, "relu": nn.ReLU, "elu": nn.ELU}
Head = Literal["squashed_gaussian", "mean"]


@dataclass(frozen=True)
class NetworkSpec:
    """Everything but the weights.

    Attributes:
        robot: the robot that the policy drives.
        observations: length of the observation.
        layers: widths of the hidden layers.
        activation: one of `ACTIVATIONS`.
        actions: length of the action.
        head: ``squashed_gaussian`` puts out mean and log standard deviation, the action being tanh of a
            sample, rescaled to the bounds; ``mean`` puts out the action itself, clipped to the bounds.
        action_low, action_high: bounds of each action.
        command: command line that trained it.
        score: what the training measured of it.
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

    def __post_init__(self) -> None:
        if self.activation not in ACTIVATIONS:
            known = ", ".join(ACTIVATIONS)
            raise PolicyError(f"unknown activation function '{self.activation}'; there are {known}")
        if self.head not in ("squashed_gaussian", "mean"):
            raise PolicyError(f"unknown head '{self.head}'; there are squashed_gaussian, mean")
        if len(self.action_low) != self.actions or len(self.action_high) != self.actions:
            raise PolicyError(
                f"expected {self.actions} action bounds, "
                f"got {len(self.action_low)} and {len(self.action_high)}"
            )


class Normaliser(nn.Module):
    """``(observation − mean) / std``."""

    mean: torch.Tensor
    std: torch.Tensor

    def __init__(self, observations: int) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(observations))
        self.register_buffer("std", torch.ones(observations))

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        return (observation - self.mean) / self.std


class PolicyNetwork(nn.Module):
    """observation → normaliser → (linear → activation) × L → head.

    The normaliser is skipped unless the weights bring one.
    """

    def __init__(self, spec: NetworkSpec) -> None:
        super().__init__()
        self.spec = spec
        self.normaliser = Normaliser(spec.observations)
        widths = [spec.observations, *spec.layers]
        self.hidden = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(widths))
        self.activations = nn.ModuleList(ACTIVATIONS[spec.activation]() for _ in spec.layers)
        outputs = spec.actions * (2 if spec.head == "squashed_gaussian" else 1)
        self.head = nn.Linear(widths[-1], outputs)
        self.normalises = False

    def load_tensors(self, tensors: dict[str, torch.Tensor]) -> None:
        """Take weights by name.

        Raises:
            PolicyError: a tensor is missing, superfluous, of another shape or not finite.
        """
        expected = {name: tuple(tensor.shape) for name, tensor in self.state_dict().items()}
        found = {name: tuple(tensor.shape) for name, tensor in tensors.items()}
        for name in sorted(expected.keys() | found.keys()):
            if expected.get(name) != found.get(name):
                raise PolicyError(
                    f"tensor '{name}': expected shape {expected.get(name, 'none')}, "
                    f"found {found.get(name, 'none')}"
                )
            if not bool(torch.isfinite(tensors[name]).all()):
                raise PolicyError(f"tensor '{name}': expected finite numbers, found NaN or infinity")
        self.load_state_dict(tensors)
        mean, std = self.normaliser.mean, self.normaliser.std
        self.normalises = bool((mean != 0).any() or (std != 1).any())

    def stages(self) -> list[nn.Module]:
        """The submodules in the order in which `forward` calls them."""
        pairs = zip(self.hidden, self.activations, strict=True)
        first: list[nn.Module] = [self.normaliser] if self.normalises else []
        return [*first, *(stage for pair in pairs for stage in pair), self.head]

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        """Head output for observations of shape (..., observations)."""
        x = observation
        for stage in self.stages():
            x = stage(x)
        return x
