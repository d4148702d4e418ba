"""Run a network one control step at a time, overwriting hidden units on the way."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from pdtui.errors import PolicyError
from pdtui.policies.units import NO_STIMULATION, Stimulation, describe_layers

ACTIVATION_TYPES: tuple[type[nn.Module], ...] = (
    nn.Tanh,
    nn.ReLU,
    nn.ELU,
    nn.GELU,
    nn.SiLU,
    nn.LeakyReLU,
    nn.SELU,
    nn.Sigmoid,
    nn.Softplus,
)

Decoder = Callable[[torch.Tensor, np.random.Generator | None], NDArray[np.float32]]


class PolicyStep(NamedTuple):
    """What one control step of a policy gives.

    Attributes:
        action: shape (A,), float32.
        activations: output of every hidden unit as the next layer saw it, shape (U,), float32.
        natural: what the stimulated units would have put out, in the order of the stimulation.
    """

    action: NDArray[np.float32]
    activations: NDArray[np.float32]
    natural: tuple[float, ...]


def mean_action(output: torch.Tensor, rng: np.random.Generator | None) -> NDArray[np.float32]:
    """The network's output is the action."""
    del rng
    action: NDArray[np.float32] = output.reshape(-1).numpy().astype(np.float32)
    return action


def chain_of(module: nn.Module) -> list[tuple[Callable[[torch.Tensor], torch.Tensor], bool]] | None:
    """The module as plain calls, each with whether it puts out hidden units; None if it is no chain.

    Calling the same PyTorch functions without the machinery of `nn.Module` gives the same bits in half the
    time, which counts at this size. A module is a chain if it is an `nn.Sequential`, or has a method
    ``stages()`` that lists its submodules in their order.
    """
    if isinstance(module, nn.Sequential):
        stages: list[nn.Module] = list(module)
    elif hasattr(module, "stages"):
        stages = cast(Any, module).stages()
    else:
        return None
    if any(len(list(stage.children())) > 0 for stage in stages):
        return None
    return [(_plain_call(stage), isinstance(stage, ACTIVATION_TYPES)) for stage in stages]


def _plain_call(stage: nn.Module) -> Callable[[torch.Tensor], torch.Tensor]:
    if type(stage) is nn.Linear and stage.bias is not None:
        weight, bias = stage.weight.detach(), stage.bias.detach()
        return lambda x: torch.addmv(bias, weight, x)
    call: Callable[[torch.Tensor], torch.Tensor] = stage.forward
    return call


class Policy:
    """A network whose hidden units can be read and overwritten.

    A unit's output is taken after its activation function and before the next layer (section 3.3 of the
    paper). Layers count in the order in which the network calls them.

    Args:
        module: the network; it maps an observation, shape (observations,), to its output.
        observations: length of the observation.
        hidden: names of the submodules whose outputs are the units; by default every activation function.
        decode: turns the network's output into an action.
        name: for messages.
        sha256: hash of the file that it came from.

    Raises:
        PolicyError: a name in `hidden` does not exist, or there is no hidden layer.
    """

    def __init__(
        self,
        module: nn.Module,
        observations: int,
        *,
        hidden: Sequence[str] | None = None,
        decode: Decoder = mean_action,
        name: str = "policy",
        sha256: str = "",
    ) -> None:
        self.module, self.observations, self.name, self.sha256 = module.eval(), observations, name, sha256
        self._decode = decode
        self._pending: tuple[tuple[int, float], ...] = ()
        self._outputs: list[NDArray[np.float32]] = []
        self._natural: dict[int, float] = {}
        self._offset = 0
        self._chain = chain_of(self.module) if hidden is None else None
        if self._chain is not None and not self._same_bits():
            self._chain = None
        if self._chain is None:
            for child in self._unit_modules(hidden):
                child.register_forward_hook(lambda _module, _inputs, output: self._visit(output))
        self._outputs = []
        self._forward(np.zeros(observations))
        self.layers: tuple[int, ...] = tuple(output.size for output in self._outputs)
        if not self.layers:
            raise PolicyError(f"{name}: the network has no hidden layer to stimulate")
        self.units = sum(self.layers)

    def _same_bits(self) -> bool:
        """Whether the chain gives the module's own bits, on a few observations."""
        rng = np.random.default_rng(0)
        for observation in rng.normal(size=(8, self.observations)).astype(np.float32):
            with torch.inference_mode():
                expected: torch.Tensor = self.module(torch.from_numpy(observation))
            if not torch.equal(self._forward(observation), expected):
                return False
        return True

    def _unit_modules(self, hidden: Sequence[str] | None) -> list[nn.Module]:
        modules = dict(self.module.named_modules())
        if hidden is None:
            return [module for module in modules.values() if isinstance(module, ACTIVATION_TYPES)]
        missing = [name for name in hidden if name not in modules]
        if missing:
            known = ", ".join(name for name in modules if name)
            raise PolicyError(f"{self.name}: no submodule '{missing[0]}'; there are {known}")
        return [modules[name] for name in hidden]

    def _forward(self, observation: NDArray[Any]) -> torch.Tensor:
        x = torch.from_numpy(observation.astype(np.float32))
        if self._chain is None:
            with torch.inference_mode():
                output: torch.Tensor = self.module(x)
            return output
        for function, has_units in self._chain:
            x = function(x)
            if has_units:
                self._visit(x)
        return x

    def _visit(self, output: torch.Tensor) -> None:
        # The array shares the tensor's memory, so writing to it is what the next layer reads.
        values = output.numpy()
        low, high = self._offset, self._offset + values.size
        for unit, value in self._pending:
            if low <= unit < high:
                self._natural[unit] = float(values.flat[unit - low])
                values.flat[unit - low] = value
        self._outputs.append(values.reshape(-1))
        self._offset = high

    def act(
        self,
        observation: NDArray[Any],
        stimulation: Stimulation = NO_STIMULATION,
        rng: np.random.Generator | None = None,
    ) -> PolicyStep:
        """One control step.

        Args:
            observation: shape (observations,).
            stimulation: the units to overwrite.
            rng: draw the action from the policy's distribution with it; without, take the mean action.

        Raises:
            PolicyError: the observation has another length, or a unit does not exist.
        """
        if observation.shape != (self.observations,):
            raise PolicyError(
                f"{self.name}: expected an observation of shape ({self.observations},), "
                f"got {observation.shape}"
            )
        self._outputs, self._offset = [], 0
        if stimulation.units:
            self._pending = tuple(zip(stimulation.units, stimulation.values, strict=True))
            self._natural = {}
        elif self._pending:
            self._pending = ()
        action = self._decode(self._forward(observation), rng)
        activations = np.concatenate(self._outputs)
        try:
            natural = tuple([self._natural[unit] for unit in stimulation.units])
        except KeyError as error:
            raise PolicyError(
                f"{self.name}: unit number {error} does not exist; "
                f"the policy has {describe_layers(self.layers)}"
            ) from None
        return PolicyStep(action, activations, natural)
