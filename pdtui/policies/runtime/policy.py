"""Policies: networks that act one control step at a time while hidden units are overwritten."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from pdtui.core.errors import PolicyError
from pdtui.core.units import NO_STIMULATION, LayerWidths, Stimulation, describe_layers
from pdtui.policies.runtime import recurrent_state
from pdtui.policies.runtime.action_decoders import Decoder, decode_mean_action
from pdtui.policies.runtime.fast_mlp import make_fast_mlp
from pdtui.policies.runtime.output_bounds import find_layer_bounds
from pdtui.policies.runtime.recurrent_state import PolicyState
from pdtui.policies.runtime.unit_layers import UnitHooks, find_hidden_modules, name_layers


@contextmanager
def _one_thread() -> Iterator[None]:
    """Let PyTorch compute with one thread: more would only cost time, and change the order of sums."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


class PolicyStep(NamedTuple):
    """Result of one control step of a policy.

    Attributes:
        action: The action, shape (A,), float32.
        activations: Output of every hidden unit as the next layer saw it, shape (U,), float32.
        stimulation: The units that were changed and the values that overwrote their outputs. Whatever an edit
            does, in one control step it comes to this.
        natural: Outputs that those units would have had, in the same order.
    """

    action: NDArray[np.float32]
    activations: NDArray[np.float32]
    stimulation: Stimulation
    natural: tuple[float, ...]


class Policy:
    """A network whose hidden units can be read and overwritten.

    A unit's output is taken after its activation function and before the next layer (section 3.3 of the
    paper). Layers count in the order in which the network calls them; the units of a layer of any shape count
    in C order. The units of a recurrent layer are its output h: the next layer reads the overwritten h, while
    the state that the recurrent layer is fed in the next step keeps the natural one. (A cell's h is
    recognized in the returned state if it is there by itself, not stacked with others.)

    A network with a hidden state is called ``module(observation, state) -> (output, state)``. The state is
    part of the run: call `reset` when the world is reset, and `restore` when it is restored.

    Args:
        module: The network, which maps a float32 observation to its output; the policy works on a copy.
        observations: Length or shape of the observation.
        hidden: Names of the submodules whose outputs are units; by default every activation function and
            every recurrent layer.
        decode: Turns the network's output into an action. It must copy: the next step overwrites the output.
        batched: Whether the network expects a leading axis of length 1.
        initial_state: First state of a recurrent network: a tensor, or tuples of tensors.
        name: Name for messages.
        sha256: Hash of the file that the network came from.

    Raises:
        PolicyError: A name in `hidden` does not exist, there is no hidden layer, or the network cannot take
            such an observation or returns a state of another shape.
    """

    def __init__(
        self,
        module: nn.Module,
        observations: int | Sequence[int],
        *,
        hidden: Sequence[str] | None = None,
        decode: Decoder = decode_mean_action,
        batched: bool = False,
        initial_state: Any = None,
        name: str = "policy",
        sha256: str = "",
    ) -> None:
        self.module, self.name, self.sha256 = copy.deepcopy(module).eval(), name, sha256
        self.shape = (observations,) if isinstance(observations, int) else tuple(observations)
        self.decode, self._batched = decode, batched
        self._initial = (
            None if initial_state is None else recurrent_state.clone_recurrent_state(initial_state)
        )
        self._state = self._initial
        self._hooks = UnitHooks()
        plain = hidden is None and initial_state is None and not batched and len(self.shape) == 1
        with _one_thread():
            self._fast_mlp = make_fast_mlp(self.module, self.shape[0]) if plain else None
            if self._fast_mlp is not None:
                self.layers = LayerWidths(self._fast_mlp.layers, [])
                self.output_bounds = self._fast_mlp.output_bounds
            else:
                names = self._watch_units(hidden)
                self._try_network()
                self.layers = LayerWidths((output.size for output in self._hooks.outputs), names)
                self.output_bounds = find_layer_bounds(self.module, names)
        if not self.layers:
            raise PolicyError(
                f"{name}: the network has no hidden layer to stimulate: no submodule is an activation "
                "function or a recurrent layer; name the submodules whose outputs are units as `hidden`"
            )
        self.units = sum(self.layers)
        self.reset()

    @property
    def recurrent(self) -> bool:
        """Whether the network has a recurrent state."""
        return self._initial is not None

    def reset(self) -> None:
        """Return to the initial recurrent state, for a new episode."""
        if self._initial is not None:
            self._state = recurrent_state.clone_recurrent_state(self._initial)

    def snapshot(self) -> PolicyState:
        """Return a copy of the recurrent state; empty for a network without one."""
        return () if self._initial is None else recurrent_state.recurrent_state_to_arrays(self._state)

    def restore(self, state: PolicyState) -> None:
        """Return to a recurrent state that `snapshot` gave; that of another network is a `PolicyError`."""
        expected, found = recurrent_state.state_shapes(self._initial), [array.shape for array in state]
        if expected != found:
            raise PolicyError(f"{self.name}: expected a recurrent state of shapes {expected}, got {found}")
        if state:
            tensors = (torch.from_numpy(array.copy()) for array in state)
            self._state = recurrent_state.rebuild_recurrent_state(self._initial, tensors)

    def _watch_units(self, hidden: Sequence[str] | None) -> list[list[str]]:
        chosen = find_hidden_modules(self.module, hidden, self.name)
        names = name_layers(self.module, chosen, self._try_network)
        for child in chosen:
            child.register_forward_hook(lambda _module, _inputs, output: self._hooks.replace(output))
        return names

    def _try_network(self) -> None:
        self._hooks.begin()
        try:
            self._run_network(np.zeros(self.shape))
            recurrent_state.check_recurrent_state(self._initial, self._state)
        except PolicyError as error:
            raise type(error)(f"{self.name}: {error}") from error
        except (RuntimeError, TypeError, ValueError, IndexError) as error:
            reason = str(error).strip().split("\n")[0]
            raise PolicyError(
                f"{self.name}: the network cannot take an observation of shape {self.shape} "
                f"({'with' if self._batched else 'without'} a batch axis, "
                f"{'with' if self.recurrent else 'without'} a recurrent state): {reason}"
            ) from error

    def _run_network(self, observation: NDArray[Any]) -> torch.Tensor:
        x = torch.from_numpy(observation.astype(np.float32))
        if self._batched:
            x = x.unsqueeze(0)
        with torch.inference_mode():
            if self._initial is None:
                output: torch.Tensor = self.module(x)
                return output
            output, state = self.module(x, self._state)
        self._state = recurrent_state.rebuild_recurrent_state(
            state, iter(self._hooks.natural_of(recurrent_state.flatten_recurrent_state(state)))
        )
        return output

    def act(
        self,
        observation: NDArray[Any],
        stimulation: Stimulation = NO_STIMULATION,
        rng: np.random.Generator | None = None,
    ) -> PolicyStep:
        """Act for one control step.

        Args:
            observation: An observation of the policy's shape.
            stimulation: The units to overwrite, and the edits to make.
            rng: Generator with which the action is drawn from the policy's distribution; without it, the mean
                action is taken.

        Raises:
            PolicyError: The observation has another shape, or a unit does not exist.
        """
        if observation.shape != self.shape:
            raise PolicyError(
                f"{self.name}: expected an observation of shape {self.shape}, got {observation.shape}"
            )
        if torch.get_num_threads() != 1:
            with _one_thread():
                return self.act(observation, stimulation, rng)
        if not stimulation:
            output, activations, _ = self._forward(observation, stimulation)
            return PolicyStep(self.decode(output, rng), activations, stimulation, ())
        places = stimulation.touched_units()
        # For a few units, Python's own functions are faster than NumPy's.
        own = stimulation.units
        ends = (int(places.min()), int(places.max())) if stimulation.edits else (min(own), max(own))
        for unit in ends:
            if not 0 <= unit < self.units:
                raise PolicyError(
                    f"{self.name}: unit number {unit} does not exist; "
                    f"the policy has {describe_layers(self.layers)}"
                )
        if stimulation.edits:
            edits = tuple([edit.prepare(observation, self.activations_for) for edit in stimulation.edits])
            stimulation = Stimulation(stimulation.units, stimulation.values, edits)
        output, activations, natural = self._forward(observation, stimulation)
        if stimulation.edits:
            stimulation = Stimulation(tuple(places.tolist()), tuple(activations[places].tolist()))
        action = self.decode(output, rng)
        return PolicyStep(action, activations, stimulation, tuple(natural[places].tolist()))

    def activations_for(self, observation: NDArray[Any], last_unit: int | None = None) -> NDArray[np.float32]:
        """Return what the hidden units would put out for an observation, shape (U,).

        Nothing is overwritten, and the recurrent state stays as it is.

        Args:
            observation: An observation of the policy's shape.
            last_unit: Flat index of the last unit that is asked for; layers after its own are undefined.
        """
        if self._fast_mlp is not None:
            return self._fast_mlp.run_layers(observation, self.units - 1 if last_unit is None else last_unit)
        state = self.snapshot()
        activations = self._forward(observation, NO_STIMULATION)[1]
        self.restore(state)
        return activations

    def _forward(
        self, observation: NDArray[Any], stimulation: Stimulation
    ) -> tuple[torch.Tensor, NDArray[np.float32], NDArray[np.float32]]:
        """Return the output, and the activations after and before the stimulation changed them."""
        if self._fast_mlp is not None:
            return self._fast_mlp.run(observation, stimulation)
        self._hooks.begin(stimulation)
        output = self._run_network(observation)
        return output, np.concatenate(self._hooks.outputs), np.concatenate(self._hooks.natural)
