"""Consecutive control steps of a session, stream by stream, as a session keeps them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate, chain, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.outcome import Outcome
from pdtui.core.step_record import ActiveBehavior, ReplacedAction, StepRecord
from pdtui.core.units import Stimulation
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.session_schema import ACTIVE_FIELDS
from pdtui.sessions.viewer.link_shape_poses import place_link_shapes


@dataclass(frozen=True, kw_only=True)
class StepBlock:
    """The data of n control steps, of J attributes and A actions, as they are recorded.

    Attributes:
        steps: numbers of the control steps, shape (n,), int64.
        digests: digest of the simulator's state after each step, shape (n,), int64.
        episodes: number of the episode of each step, shape (n,), int64.
        attributes: attributes after each step, shape (n, J).
        actions: action of each step, shape (n, A), with what the operator had taken over: float32 values,
            which a session keeps as float64.
        rewards, costs: reward and cost of each step, shape (n,).
        behavior_counts: number of active behaviors of each step, shape (n,).
        behavior_names: their names, step after step.
        behavior_states: their `ACTIVE_FIELDS`, with NaN for None, shape (sum of the counts, 7).
        stimulated_counts: number of stimulated units of each step, shape (n,).
        stimulated: flat index, overwritten and natural output of each, shape (sum of the counts, 3).
        replaced_counts: number of components of each step's action that the operator had taken over, shape
            (n,).
        replaced: index in the action and the policy's value of each, shape (sum of the counts, 2).
        activations: output of every hidden unit, shape (n, U), float32, or float16 if recorded by half; None
            if they were not recorded or not asked for.
        pose_steps: the steps for which the session has the poses of the robot's shapes, shape (p,).
        poses: those poses as in `place_link_shapes`, shape (p, shapes, vector length) each, float32; empty if
            they were not asked for.
        endings: why episodes ended by themselves, by the control step that ended each.
        outcomes: the outcomes of episodes, by control step.
    """

    steps: NDArray[np.int64]
    digests: NDArray[np.int64]
    episodes: NDArray[np.int64]
    attributes: Floats
    actions: Floats
    rewards: Floats
    costs: Floats
    behavior_counts: NDArray[np.int64]
    behavior_names: Sequence[str]
    behavior_states: Floats
    stimulated_counts: NDArray[np.int64]
    stimulated: Floats
    replaced_counts: NDArray[np.int64]
    replaced: Floats
    activations: NDArray[Any] | None = None
    pose_steps: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    poses: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    endings: Mapping[int, str] = field(default_factory=dict)
    outcomes: Mapping[int, Outcome] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.steps)

    @property
    def active(self) -> tuple[tuple[ActiveBehavior, ...], ...]:
        """The active behaviors of each step with their controllers, ordered by when they were latched."""
        flat = list(map(_decode_active_behavior, self.behavior_names, self.behavior_states.tolist()))
        return tuple(tuple(flat[start:stop]) for start, stop in _spans(self.behavior_counts))

    @property
    def stimulations(self) -> tuple[Stimulation, ...]:
        """For each step, the stimulated units and the values that overwrote their outputs."""
        units, values = self.stimulated[:, 0].astype(np.int64).tolist(), self.stimulated[:, 1].tolist()
        spans = _spans(self.stimulated_counts)
        return tuple(Stimulation(tuple(units[a:b]), tuple(values[a:b])) for a, b in spans)

    @property
    def natural(self) -> tuple[tuple[float, ...], ...]:
        """For each step, the outputs that the stimulated units would have had."""
        values = self.stimulated[:, 2].tolist()
        return tuple(tuple(values[start:stop]) for start, stop in _spans(self.stimulated_counts))

    @property
    def replaced_actions(self) -> tuple[tuple[ReplacedAction, ...], ...]:
        """For each step, the components of the action that the operator had taken over."""
        flat = [ReplacedAction(int(component), natural) for component, natural in self.replaced.tolist()]
        return tuple(tuple(flat[start:stop]) for start, stop in _spans(self.replaced_counts))

    @cached_property
    def behavior_row_indices(self) -> NDArray[np.int64]:
        """The row of the block to which each active behavior belongs, shape (sum of the counts,)."""
        return np.repeat(np.arange(len(self)), self.behavior_counts)

    @cached_property
    def stimulated_row_indices(self) -> NDArray[np.int64]:
        """The row of the block to which each stimulated unit belongs, shape (sum of the counts,)."""
        return np.repeat(np.arange(len(self)), self.stimulated_counts)

    @cached_property
    def replaced_row_indices(self) -> NDArray[np.int64]:
        """The row of the block to which each component that was taken over belongs."""
        return np.repeat(np.arange(len(self)), self.replaced_counts)

    def actions_as_float32(self) -> NDArray[np.float32]:
        """Return the actions as they acted; what exceeds float32, as damage may, is infinite."""
        with np.errstate(over="ignore"):
            return self.actions.astype(np.float32)

    def part(self, start: int, stop: int) -> StepBlock:
        """Return the rows from `start` up to, but not including, `stop`; arrays are views."""
        if (start, stop) == (0, len(self)):
            return self
        rows, steps = slice(start, stop), self.steps[start:stop]
        low, high = (steps[0], steps[-1]) if len(steps) else (0, -1)
        behaviors, units, components = (
            slice(int(counts[:start].sum()), int(counts[:stop].sum()))
            for counts in (self.behavior_counts, self.stimulated_counts, self.replaced_counts)
        )
        drawn = slice(*np.searchsorted(self.pose_steps, (low, high + 1)).tolist())
        return StepBlock(
            steps=steps,
            digests=self.digests[rows],
            episodes=self.episodes[rows],
            attributes=self.attributes[rows],
            actions=self.actions[rows],
            rewards=self.rewards[rows],
            costs=self.costs[rows],
            behavior_counts=self.behavior_counts[rows],
            behavior_names=self.behavior_names[behaviors],
            behavior_states=self.behavior_states[behaviors],
            stimulated_counts=self.stimulated_counts[rows],
            stimulated=self.stimulated[units],
            replaced_counts=self.replaced_counts[rows],
            replaced=self.replaced[components],
            activations=None if self.activations is None else self.activations[rows],
            pose_steps=self.pose_steps[drawn],
            poses={name: vectors[drawn] for name, vectors in self.poses.items()},
            endings={step: text for step, text in self.endings.items() if low <= step <= high},
            outcomes={step: word for step, word in self.outcomes.items() if low <= step <= high},
        )


def empty_step_block(info: DriveInfo) -> StepBlock:
    """Return a block without control steps, as a session without any has."""
    numbers = np.empty(0, np.int64)
    return StepBlock(
        steps=numbers,
        digests=numbers,
        episodes=numbers,
        attributes=np.empty((0, len(info.attributes))),
        actions=np.empty((0, 0)),
        rewards=np.empty(0),
        costs=np.empty(0),
        behavior_counts=numbers,
        behavior_names=[],
        behavior_states=np.empty((0, len(ACTIVE_FIELDS))),
        stimulated_counts=numbers,
        stimulated=np.empty((0, 3)),
        replaced_counts=numbers,
        replaced=np.empty((0, 2)),
        activations=np.empty((0, sum(info.layers)), np.float32),
    )


def step_block_of_records(
    records: Sequence[StepRecord], info: DriveInfo, pose_steps: NDArray[np.int64] | None = None
) -> StepBlock:
    """Return control steps as a session would keep them that records activations as `info` says.

    The poses are those of the `pose_steps`; without, there are none.
    """
    of: Any = StepRecord._make(zip(*records, strict=True))
    activations = None
    if info.activations != "off":
        activations = np.array(of.activations)
        if info.activations == "half":
            with np.errstate(over="ignore"):
                activations = activations.astype(np.float16)
    steps = np.array(of.step, np.int64)
    drawn = np.empty(0, np.int64) if pose_steps is None else pose_steps[np.isin(pose_steps, steps)]
    poses = [records[row].poses for row in np.searchsorted(steps, drawn)]
    active = list(chain.from_iterable(of.behaviors))
    states = [[getattr(one, name) for name in ACTIVE_FIELDS] for one in active]
    return StepBlock(
        steps=steps,
        digests=np.array(of.digest, np.int64),
        episodes=np.array(of.episode, np.int64),
        attributes=np.array(of.attributes),
        actions=np.array(of.action, np.float64),
        rewards=np.array(of.reward, np.float64),
        costs=np.array(of.cost, np.float64),
        behavior_counts=np.fromiter(map(len, of.behaviors), np.int64, len(records)),
        behavior_names=[one.name for one in active],
        # None becomes NaN.
        behavior_states=np.array(states, np.float64).reshape(-1, len(ACTIVE_FIELDS)),
        stimulated_counts=np.array([len(one.units) for one in of.stimulation], np.int64),
        stimulated=np.stack(
            [
                _concatenate([one.units for one in of.stimulation]),
                _concatenate([one.values for one in of.stimulation]),
                _concatenate(of.natural),
            ],
            axis=1,
        ),
        replaced_counts=np.fromiter(map(len, of.replaced), np.int64, len(records)),
        replaced=np.array(list(chain.from_iterable(of.replaced)), np.float64).reshape(-1, 2),
        activations=activations,
        pose_steps=drawn,
        poses=place_link_shapes(info.links, np.array(poses)) if poses else {},
        endings={record.step: record.ended for record in records if record.ended},
        outcomes={record.step: record.outcome for record in records if record.outcome is not None},
    )


def _concatenate(rows: Sequence[Sequence[float]]) -> Floats:
    return np.fromiter(chain.from_iterable(rows), np.float64)


def _spans(counts: NDArray[np.int64]) -> Sequence[tuple[int, int]]:
    return list(pairwise([0, *accumulate(counts.tolist())]))


def _decode_active_behavior(name: str, values: Sequence[float]) -> ActiveBehavior:
    remaining, factor, *controller, waiting = (None if math.isnan(value) else value for value in values)
    steps, until = (
        None if count is None or math.isinf(count) else int(count) for count in (remaining, waiting)
    )
    target, value, error, magnitude = controller
    own = math.nan if factor is None else factor
    return ActiveBehavior(name, steps, own, target, value, error, magnitude, until)
