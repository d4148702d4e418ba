"""Write what only the viewer needs: the robot, what is around it, its path, stimulated units, controllers,
behaviors and heat map.

All of it follows from the data of the drive, so it is written in larger batches: a crash that loses the last
batch loses no information.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import rerun as rr

from pdtui.core.attributes import Floats
from pdtui.core.step_record import StepRecord
from pdtui.core.units import format_unit
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.session_schema import BEHAVIORS, HEAT_MAP, MAGNITUDES, PATH, ROBOT, TARGETS, UNITS
from pdtui.sessions.viewer.activation_heat_map import ActivationHeatMap
from pdtui.sessions.viewer.behavior_legend import BehaviorColorLegend
from pdtui.sessions.viewer.named_columns import NamedColumnWriter
from pdtui.sessions.viewer.scenery_writer import SceneryWriter
from pdtui.sessions.viewer.session_blueprint import BlueprintContent
from pdtui.sessions.viewer.traffic_writer import TrafficWriter
from pdtui.sessions.viewer.viewer_curves import Color, LogStatic, SendRows, ViewerCurves, pack_color
from pdtui.sessions.viewer.viewer_link_shapes import ViewerLinkShapes
from pdtui.sessions.writer.arrow_columns import number_list_column, polyline_column, text_column

_UNITS_DRAWN = 4
"""Number of units drawn per state. More would be a tangle, and the heat map shows them all."""
_DRAWN_APART = 0.04
"""Simulated time between two poses of the robot, s: 25 per second look smooth. Poses are the largest stream
after the activations, and a replay recomputes them."""


class ViewerDataWriter:
    """Collects control steps and writes what the viewer draws: rows, and data that apply at all times."""

    def __init__(self, info: DriveInfo, send: SendRows, log_static: LogStatic) -> None:
        self._send, self._log_static = send, log_static
        self._shapes = ViewerLinkShapes(info.links)
        self._draw_every = max(1, round(_DRAWN_APART / info.dt))
        for part in self._shapes.static():
            log_static(ROBOT, part)
        self._legend = BehaviorColorLegend(info)
        self._units = ViewerCurves[tuple[str, int]](
            UNITS,
            lambda key: f"{key[0]}, {format_unit(key[1], info.layers)}",
            lambda key: self._color(key[0]),
            ("natural", "overwritten"),
            send,
            log_static,
        )
        color = self._legend.color
        self._targets = ViewerCurves[str](TARGETS, str, color, ("target",), send, log_static)
        self._magnitudes = ViewerCurves[str](MAGNITUDES, str, color, ("",), send, log_static)
        self._scenery = SceneryWriter(send, log_static)
        self._traffic = TrafficWriter(self._draw_every, send)
        self._table = NamedColumnWriter(info, send)
        self._shown_units: dict[str, tuple[int, ...]] = {}
        self._left_out = False
        self._states: dict[str, tuple[str, ...]] = {name: (name,) for name in self._legend.names}
        self._state = ""
        self._new_state = bool(self._states)
        self._pending = 0
        self._changes: list[tuple[int, str]] = []
        self._drawn: list[tuple[int, Floats, str, bool]] = []
        self._here: Floats | None = None
        self._jumped = True
        self._episode = self._last = 0
        self._bounds = np.array([[np.inf] * 2, [-np.inf] * 2])
        self._heat = ActivationHeatMap()
        self._heat_drawn = False

    def add(self, records: Sequence[StepRecord]) -> None:
        """Add control steps."""
        self._pending += len(records)
        self._scenery.add(records)
        self._traffic.add(records)
        self._table.add(records)
        for record in records:
            self._last, behaviors, stimulation = record.step, record.behaviors, record.stimulation
            state = " + ".join([behavior.name for behavior in behaviors]) if behaviors else ""
            if state != self._state:
                self._changes.append((record.step, state))
                self._state = state
                if state and state not in self._states:
                    self._states[state] = tuple(behavior.name for behavior in behaviors)
                    self._new_state = True
            # The path does not connect to the place where an episode starts or to which a rewind leads.
            self._jumped |= record.episode != self._episode or any(event.jumps for event in record.events)
            self._episode = record.episode
            if record.step % self._draw_every == 0:
                self._drawn.append((record.step, record.poses, state, self._jumped))
                self._jumped = False
            if stimulation.units or self._units.drawing:
                self._units.add(record.step, self._outputs(state, record))
            if behaviors or self._magnitudes.drawing:
                targets = {one.name: (one.target,) for one in behaviors if one.target is not None}
                self._targets.add(record.step, targets)
                sizes = ((one, 1.0 if one.magnitude is None else one.magnitude) for one in behaviors)
                self._magnitudes.add(record.step, {one.name: (one.factor * size,) for one, size in sizes})
            self._heat.add(record.step, record.activations)

    @property
    def pending(self) -> int:
        """The number of control steps that are not written yet."""
        return self._pending

    def write(self) -> None:
        """Write what was added since the last call."""
        if self._drawn:
            steps, poses, states, jumps = zip(*self._drawn, strict=True)
            self._write_robot(steps, np.array(poses), states, np.array(jumps))
            self._drawn = []
        self._pending = 0
        self._traffic.write()
        self._table.write()
        for curves in (self._units, self._targets, self._magnitudes):
            curves.write()

    def write_changes(self) -> None:
        """Write the steps at which the active behaviors or the scenery changed."""
        self._scenery.write()
        if self._new_state:
            colors = [self._color(state) for state in self._states]
            self._log_static(BEHAVIORS, rr.StateConfiguration(values=list(self._states), colors=colors))
            self._new_state = False
        if self._changes:
            steps, states = zip(*self._changes, strict=True)
            self._send(BEHAVIORS, steps, [text_column(rr.StateChange.descriptor_state(), states)])
            self._changes = []

    def finish(self) -> None:
        """Write the rest, including what can only be drawn at the end."""
        self.write_changes()
        for curves in (self._units, self._targets, self._magnitudes):
            curves.finish(self._last)
        self.write()
        picture = self._heat.picture()
        if picture is not None:
            self._log_static(HEAT_MAP, rr.Tensor(picture, dim_names=("unit", "time")))
            self._heat_drawn = True

    def content(self) -> BlueprintContent:
        """Return what the blueprint has to lay out so far."""
        low, high = self._bounds
        return BlueprintContent(
            units=len(self._units.keys),
            units_left_out=self._left_out,
            targets=self._targets.keys,
            magnitudes=len(self._magnitudes.keys),
            heat_map=self._heat_drawn,
            path=(tuple(low), tuple(high)) if np.isfinite(low).all() else None,
        )

    def _color(self, state: str) -> Color:
        return self._legend.color_of_state(self._states.get(state, ()))

    def _outputs(self, state: str, record: StepRecord) -> dict[tuple[str, int], tuple[float, float]]:
        """Return natural and overwritten outputs of the units that the state changed most when it began."""
        units, values, natural = record.stimulation.units, record.stimulation.values, record.natural
        if units and state not in self._shown_units:
            change = np.abs(np.subtract(values, natural))
            strongest = np.argsort(-change, kind="stable")[:_UNITS_DRAWN]
            self._shown_units[state] = tuple(units[place] for place in strongest)
            self._left_out |= len(units) > _UNITS_DRAWN
        shown = self._shown_units.get(state, ())
        both = dict(zip(units, zip(natural, values, strict=True), strict=True))
        return {(state, unit): both[unit] for unit in shown if unit in both}

    def _write_robot(
        self, steps: Sequence[int], poses: Floats, states: Sequence[str], jumps: np.ndarray[Any, Any]
    ) -> None:
        shapes = self._shapes.columns(poses)
        if shapes:
            self._send(ROBOT, steps, shapes)
        if not poses.shape[1]:
            return
        here = poses[:, 0, :2]
        before = np.concatenate([here[:1] if self._here is None else self._here, here[:-1]])
        before[jumps] = here[jumps]
        self._here = here[-1:].copy()
        low, high = self._bounds
        self._bounds = np.array([np.fmin(low, here.min(0)), np.fmax(high, here.max(0))])
        pieces = np.zeros((len(steps), 2, 3), np.float32)
        pieces[:, 0, :2], pieces[:, 1, :2] = before, here
        # The y axis of a 2D view points down, and only a 2D view can be fitted to the path.
        above = pieces[:, :, :2] * np.array([1.0, -1.0], np.float32)
        packed = {state: pack_color(self._color(state)) for state in set(states)}
        colors = number_list_column(
            rr.LineStrips3D.descriptor_colors(), np.array([packed[state] for state in states], np.uint32)
        )
        columns = [
            polyline_column(rr.LineStrips3D.descriptor_strips(), pieces),
            colors,
            polyline_column(rr.LineStrips2D.descriptor_strips(), above),
            replace(colors, descriptor=rr.LineStrips2D.descriptor_colors()),
        ]
        self._send(PATH, steps, columns)
