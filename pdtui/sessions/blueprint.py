"""How the viewer lays a session out when it opens one."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import ComponentSourceKind, TextLogColumnKind, VisualizerComponentMapping

from pdtui.robots.types import Attribute
from pdtui.sessions.curves import PALETTE
from pdtui.sessions.record import DriveInfo
from pdtui.sessions.schema import (
    BEHAVIORS,
    CONTROLLERS,
    DRIVE,
    ENDINGS,
    EVENTS,
    HEAT_MAP,
    PATH,
    REWARD_COST_ACTION,
    ROBOT,
    STEP,
    TIME,
    UNITS,
)


def layout(info: DriveInfo) -> rrb.Blueprint:
    """Robot, path and keys on the left, what is stimulated in the middle, what the robot does right."""
    return rrb.Blueprint(
        rrb.Horizontal(_robot(info), _stimulated(), _measured(info.attributes), column_shares=[4, 3, 3]),
        rrb.TimePanel(timeline=TIME, state="collapsed"),
        collapse_panels=True,
    )


def _robot(info: DriveInfo) -> rrb.Vertical:
    trails = [
        rrb.VisibleTimeRange(
            timeline, start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.cursor_relative()
        )
        for timeline in (TIME, STEP)
    ]
    robot = rrb.Spatial3DView(
        contents=[ROBOT, PATH],
        name=f"{info.robot}, driven by {info.policy}",
        # Only the path leaves a trail; the robot is where it is.
        overrides={PATH: [rr.Points3D.from_fields(radii=0.02).visualizer(), rrb.VisibleTimeRanges(trails)]},
        eye_controls=rrb.EyeControls3D(
            position=(2.5, -2.5, 1.7), look_target=(0.0, 0.0, 0.5), tracking_entity=ROBOT
        ),
        line_grid=True,
    )
    above = rrb.Spatial2DView(
        contents=[PATH],
        name="Path from above",
        overrides={PATH: [rr.Points2D.from_fields(radii=rr.Radius.ui_points(1.5)).visualizer()]},
        time_ranges=trails,
    )
    keys = rrb.TextLogView(
        contents=[EVENTS, ENDINGS],
        name="Keys and events",
        columns=rrb.TextLogColumns(
            timeline_columns=[TIME], text_log_columns=[TextLogColumnKind.LogLevel, TextLogColumnKind.Body]
        ),
    )
    if not info.links:
        return rrb.Vertical(keys)
    return rrb.Vertical(robot, rrb.Horizontal(above, keys), row_shares=[3, 2])


def _stimulated() -> rrb.Vertical:
    return rrb.Vertical(
        rrb.StateTimelineView(origin=BEHAVIORS, name="Behaviors"),
        rrb.TimeSeriesView(origin=UNITS, name="Stimulated units: natural and overwritten"),
        rrb.TimeSeriesView(origin=CONTROLLERS, name="Targets held"),
        rrb.TensorView(
            origin=HEAT_MAP,
            name="All activations of the session",
            scalar_mapping=rrb.TensorScalarMapping(colormap="CyanToYellow"),
            view_fit="fill",
        ),
        row_shares=[2, 5, 4, 5],
    )


def _measured(attributes: Sequence[Attribute]) -> rrb.Vertical:
    """One plot a physical unit, so that curves in one plot share their scale."""
    units = dict.fromkeys(attribute.unit for attribute in attributes)
    plots = []
    for unit in units:
        colors = cycle(PALETTE)
        curves = [
            _curve(attribute.name, "attributes", next(colors), f"[{column}]")
            for column, attribute in enumerate(attributes)
            if attribute.unit == unit
        ]
        plots.append(_plot(unit or "no unit", curves))
    colors = cycle(PALETTE)
    gains = [
        _curve(name, REWARD_COST_ACTION, next(colors), f"[{column}]")
        for column, name in enumerate(("reward", "cost"))
    ]
    plots.append(_plot("reward and cost", gains))
    return rrb.Vertical(*plots)


def _plot(name: str, curves: Sequence[rrb.Visualizer]) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(contents=[DRIVE], name=name, overrides={DRIVE: curves})


def _curve(name: str, component: str, color: tuple[int, int, int], selector: str) -> rrb.Visualizer:
    mapping = VisualizerComponentMapping(
        target="Scalars:scalars",
        source_kind=ComponentSourceKind.SourceComponent,
        source_component=component,
        selector=selector,
    )
    return rr.SeriesLines(names=[name], colors=[color]).visualizer(mappings=[mapping])
