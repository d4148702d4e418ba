"""Stimulated roll-outs of the Ant on an accelerator, by MJX: all at once, in float32, from common starts."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import redirect_stdout
from io import StringIO
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from pdtui.benchmarks.accelerator.jax_ant_formulas import JaxAntFormulas
from pdtui.core.attributes import Floats
from pdtui.core.errors import PdtuiError
from pdtui.policies.runtime.jax_multilayer_perceptron import (
    ARRAY_ACTIVATIONS,
    apply_mlp,
    network_to_mlp_parameters,
)
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.policy_network import PolicyNetwork
from pdtui.probing.start_states import StartState
from pdtui.robots.ant import Ant

with redirect_stdout(StringIO()):  # it prints which of its back ends are not installed
    from mujoco import mjx

NO_UNIT = -1
"""The number of a unit that does not exist: nothing is overwritten."""


class MjxOutcomes(NamedTuple):
    """What n roll-outs measure, as `RolloutOutcome` does.

    Attributes:
        means: Mean of each attribute over the measured control steps, shape (n, J); NaN without any.
        falls: Whether it fell, shape (n,).
    """

    means: Floats
    falls: NDArray[np.bool_]


class _RolloutState(NamedTuple):
    """What one roll-out carries from control step to control step."""

    data: Any
    attributes: Any
    turned: Any
    total: Any
    counted: Any
    fallen: Any


class MjxRollouts:
    """Runs roll-outs that overwrite one unit by a constant.

    The physics is MJX's: the model's own solver, in float32, with friction pyramids that are turned
    differently from MuJoCo's. Single roll-outs therefore go other ways; what is compared are effects.

    Args:
        ant: The robot.
        policy: Its policy, a multilayer perceptron.
        steps: Control steps of a roll-out.
        measure_from: First control step that is measured.

    Raises:
        PdtuiError: The policy is no such network.
    """

    def __init__(self, ant: Ant, policy: Policy, steps: int, measure_from: int) -> None:
        network = policy.module
        if not isinstance(network, PolicyNetwork) or network.spec.activation not in ARRAY_ACTIVATIONS:
            known = ", ".join(ARRAY_ACTIVATIONS)
            raise PdtuiError(
                f"{policy.name}: expected a multilayer perceptron with {known} for the accelerator; "
                "this policy is another network"
            )
        self._ant, self._network, self._layers = ant, network, network_to_mlp_parameters(network)
        self._formulas, self._steps, self._measure_from = JaxAntFormulas(ant), steps, measure_from
        self._model = mjx.put_model(ant.model)
        # Without this, matrices are multiplied with 10 bits of mantissa on some accelerators.
        with jax.default_matmul_precision("highest"):
            self._run = jax.jit(jax.vmap(self._run_one))

    def run(
        self, starts: Sequence[StartState], units: NDArray[np.intp], outputs: Floats, rows: NDArray[np.intp]
    ) -> MjxOutcomes:
        """Run n roll-outs: each overwrites one unit by an output, from the start in one of the rows.

        The first call for a number of roll-outs compiles for about a minute.
        """
        poses, velocities = [], []
        for start in starts:
            self._ant.restore(start.snapshot)
            poses.append(self._ant.data.qpos.copy())
            velocities.append(self._ant.data.qvel.copy())
        with jax.default_matmul_precision("highest"):
            means, falls = self._run(
                jnp.asarray(np.array(poses)[rows], jnp.float32),
                jnp.asarray(np.array(velocities)[rows], jnp.float32),
                jnp.asarray(units, jnp.int32),
                jnp.asarray(outputs, jnp.float32),
            )
        return MjxOutcomes(np.asarray(means, np.float64), np.asarray(falls))

    def _run_one(self, pose: Any, velocity: Any, unit: Any, output: Any) -> tuple[Any, Any]:
        data = mjx.make_data(self._ant.model).replace(qpos=pose, qvel=velocity)
        before = self._formulas.read_attributes(data)
        nothing = jnp.zeros_like(before)
        state = _RolloutState(data, before, nothing, nothing, jnp.zeros(()), jnp.zeros((), bool))

        def advance(state: _RolloutState, step: Any) -> tuple[_RolloutState, None]:
            return self._advance(state, step, unit, output), None

        state, _ = jax.lax.scan(advance, state, jnp.arange(self._steps))
        counted = jnp.where(state.counted > 0, state.counted, jnp.nan)
        return state.total / counted, state.fallen

    def _advance(self, state: _RolloutState, step: Any, unit: Any, output: Any) -> _RolloutState:
        going = ~state.fallen
        moved = self._take_control_step(state.data, unit, output)
        attributes = self._formulas.read_attributes(moved)
        wraps = jnp.asarray(self._formulas.wraps)
        change = attributes - state.attributes
        turned = state.turned + jnp.where(wraps, jnp.arctan2(jnp.sin(change), jnp.cos(change)), 0.0)
        measured = going & (step >= self._measure_from)
        further = _RolloutState(
            data=moved,
            attributes=attributes,
            turned=turned,
            total=state.total + jnp.where(measured, jnp.where(wraps, turned, attributes), 0.0),
            counted=state.counted + measured,
            fallen=self._formulas.has_fallen(moved),
        )
        # One that has fallen stays as it is, so that it never holds numbers that are none.
        kept: _RolloutState = jax.tree.map(lambda new, old: jnp.where(going, new, old), further, state)
        return kept

    def _take_control_step(self, data: Any, unit: Any, output: Any) -> Any:
        data = data.replace(ctrl=self._act(self._formulas.observe(data), unit, output))
        physics_steps = self._formulas.physics_steps
        return jax.lax.fori_loop(0, physics_steps, lambda _, now: mjx.step(self._model, now), data)

    def _act(self, observation: Any, unit: Any, output: Any) -> Any:
        """Return the mean action with one unit overwritten, shape (A,)."""
        network, spec, x = self._network, self._network.spec, observation
        if network.normalizes:
            x = (x - network.normalizer.mean.numpy()) / network.normalizer.std.numpy()
            x = jnp.clip(x, -spec.observation_clip, spec.observation_clip) if spec.observation_clip else x

        def overwrite(outputs: Any, first: int) -> Any:
            return jnp.where(jnp.arange(len(outputs)) == unit - first, output, outputs)

        activation, _ = ARRAY_ACTIVATIONS[spec.activation]
        mean = apply_mlp(self._layers, x, activation, overwrite)[: spec.actions]
        mean = jnp.clip(mean, -spec.mean_limit, spec.mean_limit) if spec.mean_limit else mean
        low, high = np.array(spec.action_low, np.float32), np.array(spec.action_high, np.float32)
        if spec.head in ("squashed_gaussian", "tanh"):
            return (high + low) / 2 + (high - low) / 2 * jnp.tanh(mean)
        return jnp.clip(mean, low, high) if low.size else mean
