"""What only the viewer needs: robot, path, stimulated units, controllers, behaviors and a heat map.

All of it follows from the rows of the drive, so it is written in larger batches: a crash that loses the last
of it loses no fact.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr

from pdtui.policies.units import format_unit
from pdtui.robots.types import Floats
from pdtui.sessions.columns import rows, texts, vectors
from pdtui.sessions.curves import PALETTE, Curves, HeatMap, LogStatic, Send
from pdtui.sessions.record import DriveInfo, StepRecord
from pdtui.sessions.schema import BEHAVIORS, CONTROLLERS, HEAT_MAP, PATH, ROBOT, UNITS
from pdtui.sessions.shapes import Shapes

_IDLE = (150, 150, 150)
_DRAWN_APART = 0.04
"""Simulated time between two pictures of the robot, s: what the eye needs. Poses are the largest stream after
the activations, and a replay has all of them."""


class Views:
    """Collects control steps and writes what the viewer draws of them.

    Args:
        info: of robot and policy.
        send: writes a batch of rows.
        log_static: writes what holds at all times.
    """

    def __init__(self, info: DriveInfo, send: Send, log_static: LogStatic) -> None:
        self._send, self._log_static = send, log_static
        self._shapes = Shapes(info.links)
        self._draw_every = max(1, round(_DRAWN_APART / info.dt))
        for part in self._shapes.static():
            log_static(ROBOT, part)
        self._units: Curves[int] = Curves(
            UNITS, lambda unit: format_unit(unit, info.layers), ("natural", "overwritten"), send, log_static
        )
        self._controllers: Curves[str] = Curves(
            CONTROLLERS, str, ("target", "value", "error", "c"), send, log_static
        )
        self._colors: dict[str, tuple[int, int, int]] = {}
        self._state = ""
        self._pending = 0
        self._changes: list[tuple[int, str]] = []
        self._drawn: list[tuple[int, Floats, str]] = []
        self._heat = HeatMap()

    def add(self, records: Sequence[StepRecord]) -> None:
        """Take in control steps."""
        self._pending += len(records)
        for record in records:
            behaviors, stimulation = record.behaviors, record.stimulation
            state = " + ".join([behavior.name for behavior in behaviors]) if behaviors else ""
            if state != self._state:
                self._changes.append((record.step, state))
                self._state = state
            if record.step % self._draw_every == 0:
                self._drawn.append((record.step, record.poses, state))
            if stimulation.units or self._units.drawing:
                values = zip(record.natural, stimulation.values, strict=True)
                self._units.add(record.step, dict(zip(stimulation.units, values, strict=True)))
            if behaviors or self._controllers.drawing:
                self._controllers.add(
                    record.step,
                    {
                        one.name: (one.target, one.value, one.error, one.magnitude)
                        for one in behaviors
                        if one.target is not None
                    },
                )
            self._heat.add(record.step, record.activations)

    @property
    def pending(self) -> int:
        """Control steps that are not written yet."""
        return self._pending

    def write(self) -> None:
        """Write what was collected since the last time."""
        if self._drawn:
            self._name_states()
            steps, poses, states = zip(*self._drawn, strict=True)
            self._write_robot(steps, np.array(poses), states)
            self._drawn = []
        self._pending = 0
        self._units.write()
        self._controllers.write()

    def write_changes(self) -> None:
        """Write at which steps other behaviors became active."""
        if self._changes:
            self._name_states()
            steps, states = zip(*self._changes, strict=True)
            self._send(BEHAVIORS, steps, [texts(rr.StateChange.descriptor_state(), states)])
            self._changes = []

    def finish(self) -> None:
        """Write what can only be drawn at the end."""
        self.write_changes()
        self.write()
        picture = self._heat.picture()
        if picture is not None:
            self._log_static(HEAT_MAP, rr.Tensor(picture, dim_names=("unit", "time")))

    def _write_robot(self, steps: Sequence[int], poses: Floats, states: Sequence[str]) -> None:
        shapes = self._shapes.columns(poses)
        if shapes:
            self._send(ROBOT, steps, shapes)
        if not poses.shape[1]:
            return
        positions = np.zeros((len(steps), 1, 3), np.float32)
        positions[:, 0, :2] = poses[:, 0, :2]
        # A picture's y axis points down, and only in a picture does the viewer fit the path to the frame.
        above = positions[:, :, :2] * np.array([1.0, -1.0], np.float32)
        packed = {state: _packed(self._colors.get(state, _IDLE)) for state in set(states)}
        colors = np.array([packed[state] for state in states], np.uint32)
        columns = [
            vectors(rr.Points3D.descriptor_positions(), positions),
            rows(rr.Points3D.descriptor_colors(), colors),
            vectors(rr.Points2D.descriptor_positions(), above),
            rows(rr.Points2D.descriptor_colors(), colors),
        ]
        self._send(PATH, steps, columns)

    def _name_states(self) -> None:
        states = {state for _, state in self._changes if state} - self._colors.keys()
        if not states:
            return
        for _, state in self._changes:
            if state in states and state not in self._colors:
                self._colors[state] = PALETTE[len(self._colors) % len(PALETTE)]
        self._log_static(
            BEHAVIORS,
            rr.StateConfiguration(values=list(self._colors), colors=list(self._colors.values())),
        )


def _packed(color: tuple[int, int, int]) -> int:
    red, green, blue = color
    return red << 24 | green << 16 | blue << 8 | 255
