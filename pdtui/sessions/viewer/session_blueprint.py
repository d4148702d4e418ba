"""How the viewer lays a session out when it opens one: what is not there takes no room."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import ComponentSourceKind, TextLogColumnKind, VisualizerComponentMapping

from pdtui.core.attributes import Attribute
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.session_schema import (
    BEHAVIORS,
    DRIVE,
    ENDINGS,
    EVENTS,
    HEAT_MAP,
    MAGNITUDES,
    OBSTACLES,
    OBSTACLES_ABOVE,
    PATH,
    REWARD_COST_ACTION,
    ROBOT,
    STEP,
    TARGETS,
    TIME,
    UNITS,
)
from pdtui.sessions.viewer.behavior_legend import BehaviorLegend

_CURVES = (
    (205, 214, 224),
    (84, 160, 214),
    (222, 120, 110),
    (120, 186, 130),
    (168, 140, 210),
    (190, 170, 110),
)
_MOST_NAMED = 8
"""A longer legend hides the curves; the viewer names a curve under the mouse, too."""
_MARGIN = 0.08


@dataclass(frozen=True)
class DriveContent:
    """What of a drive there is to be laid out; as it stands, of one that has begun.

    Attributes:
        units: stimulated units with curves, counted for each state.
        units_left_out: whether a state had more than those.
        targets: behaviors that held a target; None stands for those of the map that may.
        magnitudes: behaviors that were active.
        heat_map: whether all activations were drawn; that is done at the end.
        path: lowest and highest x, y, m; None while they are not known.
        begun: whether the rest is still to come.
    """

    units: int = 0
    units_left_out: bool = True
    targets: tuple[str, ...] | None = None
    magnitudes: int = 0
    heat_map: bool = False
    path: tuple[tuple[float, float], tuple[float, float]] | None = None
    begun: bool = False


BEGUN = DriveContent(begun=True)


def session_blueprint(info: DriveInfo, content: DriveContent = BEGUN) -> rrb.Blueprint:
    """Robot, path and keys on the left, what is stimulated in the middle, what the robot does right."""
    columns = [(4, _robot(info, content)), (3, _stimulated(content)), (3, _measured(info, content))]
    there = [(share, column) for share, column in columns if column is not None]
    return rrb.Blueprint(
        rrb.Horizontal(*(column for _, column in there), column_shares=[share for share, _ in there]),
        rrb.TimePanel(timeline=TIME, state="collapsed"),
        collapse_panels=True,
    )


def _robot(info: DriveInfo, content: DriveContent) -> rrb.Vertical:
    keys = rrb.TextLogView(
        contents=[EVENTS, ENDINGS],
        name="Keys and events",
        columns=rrb.TextLogColumns(timeline_columns=[STEP], text_log_columns=[TextLogColumnKind.Body]),
    )
    if not info.links:
        return rrb.Vertical(keys)
    trails = [
        rrb.VisibleTimeRange(
            timeline, start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.cursor_relative()
        )
        for timeline in (TIME, STEP)
    ]
    robot = rrb.Spatial3DView(
        contents=[ROBOT, PATH, OBSTACLES],
        name=f"Robot {info.robot}, policy {info.policy}; its path in the colors of the behaviors",
        # Only the path leaves a trail; the robot and the obstacles are where they are.
        overrides={
            PATH: [rr.LineStrips3D.from_fields(radii=0.02).visualizer(), rrb.VisibleTimeRanges(trails)]
        },
        eye_controls=rrb.EyeControls3D(
            position=(2.5, -2.5, 1.7), look_target=(0.0, 0.0, 0.5), tracking_entity=ROBOT
        ),
        line_grid=True,
    )
    above = rrb.Spatial2DView(
        contents=[OBSTACLES_ABOVE, PATH],
        name="Path from above",
        overrides={
            PATH: [
                rr.LineStrips2D.from_fields(radii=rr.Radius.ui_points(1.5)).visualizer(),
                rrb.VisibleTimeRanges(trails),
            ]
        },
        visual_bounds=_bounds(content),
    )
    return rrb.Vertical(robot, rrb.Horizontal(above, keys, column_shares=[3, 4]), row_shares=[3, 2])


def _bounds(content: DriveContent) -> rrb.VisualBounds2D | None:
    """Of the whole path, so that the picture holds still while the time runs."""
    if content.path is None:
        return None
    (left, low), (right, high) = content.path
    margin = max(0.5, _MARGIN * max(right - left, high - low))
    return rrb.VisualBounds2D(
        x_range=(left - margin, right + margin), y_range=(-high - margin, -low + margin)
    )


def _stimulated(content: DriveContent) -> rrb.Vertical | None:
    rows: list[tuple[int, rrb.View]] = []
    if content.begun or content.magnitudes:
        rows.append((2, rrb.StateTimelineView(origin=BEHAVIORS, name="Behaviors", time_view=_time())))
    if content.begun or content.units:
        which = "Four units a behavior" if content.units_left_out else "Stimulated units"
        name = f"{which}: overwritten (bright), natural (dark)"
        rows.append((5, _plot(name, f"{UNITS}/**", named=0 < content.units <= _MOST_NAMED // 2)))
    if content.begun or content.magnitudes:
        name = "Magnitudes: c of a controller, else the factor on the map's"
        rows.append((3, _plot(name, f"{MAGNITUDES}/**", named=content.magnitudes <= _MOST_NAMED)))
    if content.heat_map:
        heat = rrb.TensorView(
            origin=HEAT_MAP,
            name="All activations over the session: negative blue, zero gray, positive yellow",
            scalar_mapping=rrb.TensorScalarMapping(colormap="CyanToYellow"),
            view_fit="fill",
        )
        rows.append((5, heat))
    if not rows:
        return None
    return rrb.Vertical(*(view for _, view in rows), row_shares=[share for share, _ in rows])


def _measured(info: DriveInfo, content: DriveContent) -> rrb.Vertical:
    """One plot a physical unit, so that its curves share a scale; a target is beside what it is for."""
    held = BehaviorLegend(info).held
    plots = []
    for unit in dict.fromkeys(attribute.unit for attribute in info.attributes):
        columns = [column for column, one in enumerate(info.attributes) if one.unit == unit]
        shown = [info.attributes[column] for column in columns]
        targets = [
            f"{TARGETS}/{rr.escape_entity_path_part(name)}"
            for name, attribute in held.items()
            if (content.targets is None or name in content.targets)
            and attribute in [one.name for one in shown]
        ]
        curves = [
            _curve(one.name, "attributes", color, column)
            for one, color, column in zip(shown, cycle(_CURVES), columns, strict=False)
        ]
        named = 1 < len(curves) + len(targets) <= _MOST_NAMED - 2
        plots.append(_plot(_title(shown), DRIVE, *targets, curves=curves, named=named))
    gains = [
        _curve(name, REWARD_COST_ACTION, color, column)
        for column, (name, color) in enumerate(zip(("reward", "cost"), _CURVES, strict=False))
    ]
    plots.append(_plot("Reward and cost of a control step", DRIVE, curves=gains, named=True))
    return rrb.Vertical(*plots)


def _title(attributes: Sequence[Attribute]) -> str:
    """Names and unit; many that end in one word are named by it."""
    names = [attribute.name for attribute in attributes]
    if len(names) > 4:
        last = {name.split()[-1] if name.split() else name for name in names}
        names = [f"{len(names)} × {last.pop()}"] if len(last) == 1 else [f"{len(names)} attributes"]
    unit = attributes[0].unit
    return f"{', '.join(names)} ({unit})" if unit else ", ".join(names)


def _plot(
    name: str, *contents: str, curves: Sequence[rrb.Visualizer] = (), named: bool = False
) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        contents=list(contents),
        name=name,
        overrides={DRIVE: list(curves)} if curves else None,
        axis_x=_time(),
        plot_legend=rrb.PlotLegend(corner="LeftTop", visible=named),
    )


def _time() -> rrb.TimeAxis:
    """One above the other, the same time has the same place."""
    return rrb.TimeAxis(link="LinkToGlobal")


def _curve(name: str, component: str, color: tuple[int, int, int], column: int) -> rrb.Visualizer:
    mapping = VisualizerComponentMapping(
        target="Scalars:scalars",
        source_kind=ComponentSourceKind.SourceComponent,
        source_component=component,
        selector=f"[{column}]",
    )
    return rr.SeriesLines(names=[name], colors=[color]).visualizer(mappings=[mapping])
