"""The trajectory of a drive, as arrays with one row per control step."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats, attribute_column
from pdtui.core.drive_events import DriveEvent
from pdtui.core.outcome import Outcome, count_outcomes, describe_outcomes
from pdtui.core.step_record import ReplacedAction, StepRecord
from pdtui.core.units import Stimulation, parse_unit
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.headless_drive import drive_from_keystrokes, end_after, open_step_recorder
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.writer.step_recorder import StepRecorder
from pdtui.stimulation.behavior_colors import BEHAVIOR_COLORS

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class DriveArrays:
    """The S control steps of one drive.

    ``drive["vx"]`` is the series of an attribute, ``drive.unit("0:12")`` that of a hidden unit, shape (S,).

    Attributes:
        info: everything that determined the run, besides its events.
        attributes: attributes after each step, in their units, shape (S, J).
        activations: activations of all hidden units as the next layer saw them, shape (S, U), float32.
        actions: what the robot was given, by the policy or during a takeover by the operator, shape (S, A),
            float32.
        rewards, costs: shape (S,).
        episodes: number of the episode, shape (S,).
        digests: digest of the simulator's state after each step, shape (S,).
        behaviors: names of the behaviors active in each step.
        stimulations: units and the values that overwrote them in each step.
        events: everything that changed the run, in order.
        endings: why an episode ended, by its last step.
        outcomes: how an episode ended, or that it arrived and went on, by the step in which it did.
        replaced_actions: components of each step's action that the operator had taken over.
    """

    info: DriveInfo
    attributes: Floats = field(repr=False)
    activations: NDArray[np.float32] = field(repr=False)
    actions: NDArray[np.float32] = field(repr=False)
    rewards: Floats = field(repr=False)
    costs: Floats = field(repr=False)
    episodes: NDArray[np.int64] = field(repr=False)
    digests: NDArray[np.int64] = field(repr=False)
    behaviors: tuple[tuple[str, ...], ...] = field(repr=False)
    stimulations: tuple[Stimulation, ...] = field(repr=False)
    events: tuple[DriveEvent, ...] = field(repr=False)
    endings: dict[int, str] = field(repr=False)
    outcomes: dict[int, Outcome] = field(repr=False)
    replaced_actions: tuple[tuple[ReplacedAction, ...], ...] = field(repr=False)

    def __len__(self) -> int:
        return len(self.digests)

    def __getitem__(self, attribute: str) -> Floats:
        return self.attributes[:, attribute_column(attribute, self.info.attributes, self.info.robot)]

    def __repr__(self) -> str:
        seconds = len(self) * self.info.dt
        return (
            f"<Drive of {self.info.robot} by {self.info.policy}: {len(self)} steps ({seconds:g} s), "
            f"{len(self.events)} events, {describe_outcomes(count_outcomes(self.outcomes.values()))}>"
        )

    def _repr_html_(self) -> str:
        """Show the attributes as curves in a notebook."""
        from pdtui.notebook.drive_display import drive_html

        title, facts = repr(self).strip("<>"), self.info
        return drive_html(title, facts.dt, facts.attributes, self.attributes, self.behaviors, BEHAVIOR_COLORS)

    def to_pandas(self) -> pd.DataFrame:
        """Return a data frame with a row for each control step, which is its index.

        Its columns are ``time`` in s, the attributes by their names, ``reward``, ``cost``, ``episode``,
        ``behaviors`` (joined by commas), and the actions, ``action 0`` and so on.

        Raises:
            PdtuiError: pandas is not installed.
        """
        from pdtui.notebook.data_frames import make_data_frame

        names = [attribute.name for attribute in self.info.attributes]
        columns: dict[str, Any] = {"time": (np.arange(len(self)) + 1) * self.info.dt}
        columns |= dict(zip(names, self.attributes.T, strict=True))
        columns |= {"reward": self.rewards, "cost": self.costs, "episode": self.episodes}
        columns["behaviors"] = [", ".join(active) for active in self.behaviors]
        actions = self.actions.reshape(len(self), -1).T
        columns |= {f"action {number}": column for number, column in enumerate(actions)}
        return make_data_frame(columns, "step")

    def unit(self, address: str) -> NDArray[np.float32]:
        """Return the activations of one unit, shape (S,); a `PolicyError` says that there is no such unit."""
        return self.activations[:, parse_unit(address, self.info.layers)]


def collect_drive_arrays(
    loop: ControlLoop,
    keys: Mapping[int, str | Sequence[str]],
    steps: int,
    recorder: StepRecorder | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
    minutes: float | None = None,
) -> DriveArrays:
    """Drive from keystrokes as fast as possible and return the trajectory.

    Args:
        loop: the drive, before its first step.
        keys: one key or several for each control step before which they are pressed.
        steps: control steps.
        recorder: records every step, and is closed however the drive ends.
        progress: called with the number of steps done and the total.
        minutes: time after which the drive ends with the steps done so far.

    Raises:
        KeystrokeError: a key means nothing in the state at its step.
        SimulationDiverged: the simulation cannot go on; the recording is complete all the same.
    """
    presses = {step: [pressed] if isinstance(pressed, str) else pressed for step, pressed in keys.items()}
    records: list[StepRecord] = []
    with open_step_recorder(recorder) as record_step:
        for record in end_after(drive_from_keystrokes(loop, presses, steps), minutes):
            records.append(record)
            record_step(record)
            if progress is not None:
                progress(len(records), steps)
    return _stack_records(loop, records)


def _stack_records(loop: ControlLoop, records: Sequence[StepRecord]) -> DriveArrays:
    def stack(values: list[Any], kind: Any, *width: int) -> NDArray[Any]:
        return np.array(values, kind).reshape(len(records), *width)

    return DriveArrays(
        info=loop.info,
        attributes=stack([record.attributes for record in records], np.float64, len(loop.robot.attributes)),
        activations=stack([record.activations for record in records], np.float32, loop.policy.units),
        actions=np.array([record.action for record in records], np.float32),
        rewards=stack([record.reward for record in records], np.float64),
        costs=stack([record.cost for record in records], np.float64),
        episodes=stack([record.episode for record in records], np.int64),
        digests=stack([record.digest for record in records], np.int64),
        behaviors=tuple(tuple(one.name for one in record.behaviors) for record in records),
        stimulations=tuple(record.stimulation for record in records),
        events=tuple(event for record in records for event in record.events),
        endings={record.step: record.ended for record in records if record.ended},
        outcomes={record.step: record.outcome for record in records if record.outcome is not None},
        replaced_actions=tuple(record.replaced for record in records),
    )
