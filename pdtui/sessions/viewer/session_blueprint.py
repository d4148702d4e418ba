"""The blueprint of a session: how the viewer lays it out, with no space for what is absent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import ComponentSourceKind, TextLogColumnKind, VisualizerComponentMapping

from pdtui.core.attributes import Attribute
from pdtui.sessions import session_schema as schema
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.viewer.behavior_legend import BehaviorColorLegend

_CURVES = (
    (205, 214, 224),
    (84, 160, 214),
    (222, 120, 110),
    (120, 186, 130),
    (168, 140, 210),
    (190, 170, 110),
)
_MOST_NAMED = 8
"""Largest number of curves with a legend; a longer one hides the curves, which are also named on hovering."""
_MARGIN = 0.08
_EYE, _ROAD_EYE = (2.5, -2.5, 1.7), (-16.0, -10.0, 9.0)
"""Where the eye is at first, m: it then follows the robot."""
_ROAD_HEIGHT = 60.0
"""Height from which a road is seen from above, m."""
_PATH_RADIUS, _ROAD_PATH_RADIUS = 0.02, 0.15


@dataclass(frozen=True)
class BlueprintContent:
    """What a blueprint has to lay out.

    Attributes:
        units: number of curves of stimulated units, over all states.
        units_left_out: whether a state had more units than are drawn.
        targets: behaviors that held a target; None for all behaviors of the map that can.
        magnitudes: number of behaviors that were active.
        heat_map: whether the heat map of all activations was drawn, which is done at the end.
        path: lowest and highest (x, y), m; None if unknown.
        begun: whether the drive has only begun, so that more will follow.
    """

    units: int = 0
    units_left_out: bool = True
    targets: tuple[str, ...] | None = None
    magnitudes: int = 0
    heat_map: bool = False
    path: tuple[tuple[float, float], tuple[float, float]] | None = None
    begun: bool = False


BEGUN = BlueprintContent(begun=True)


def session_blueprint(info: DriveInfo, content: BlueprintContent = BEGUN) -> rrb.Blueprint:
    """Lay out robot, path and keys on the left, stimulation in the middle, measurements on the right."""
    columns = [
        (4, _lay_out_robot(info, content)),
        (3, _lay_out_stimulation(content)),
        (3, _lay_out_measurements(info, content)),
    ]
    present = [(share, column) for share, column in columns if column is not None]
    return rrb.Blueprint(
        rrb.Horizontal(*(column for _, column in present), column_shares=[share for share, _ in present]),
        rrb.TimePanel(timeline=schema.TIME, state="collapsed"),
        collapse_panels=True,
    )


def _lay_out_robot(info: DriveInfo, content: BlueprintContent) -> rrb.Vertical:
    keys = rrb.TextLogView(
        contents=[schema.EVENTS, schema.ENDINGS, schema.OUTCOMES],
        name="Keys and events",
        columns=rrb.TextLogColumns(timeline_columns=[schema.STEP], text_log_columns=[TextLogColumnKind.Body]),
    )
    if not info.links:
        return rrb.Vertical(keys)
    trails = [
        rrb.VisibleTimeRange(
            timeline, start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.cursor_relative()
        )
        for timeline in (schema.TIME, schema.STEP)
    ]
    # Only the path is shown over time; everything else is shown at the current time.
    width = _ROAD_PATH_RADIUS if info.roads else _PATH_RADIUS
    strips = rr.LineStrips3D.from_fields(radii=width).visualizer()
    world = [schema.ROBOT, schema.PATH, schema.OBSTACLES, schema.ROAD_LINES, f"{schema.TRAFFIC}/**"]
    robot = rrb.Spatial3DView(
        contents=world,
        name=f"Robot {info.robot}, policy {info.policy}; its path in the colors of the behaviors",
        overrides={schema.PATH: [strips, rrb.VisibleTimeRanges(trails)]},
        eye_controls=rrb.EyeControls3D(
            position=_ROAD_EYE if info.roads else _EYE,
            look_target=(0.0, 0.0, 0.5),
            tracking_entity=schema.ROBOT,
        ),
        line_grid=True,
    )
    if info.roads:
        from_above = rrb.Spatial3DView(
            contents=world,
            name="Road from above",
            overrides={schema.PATH: [strips, rrb.VisibleTimeRanges(trails)]},
            eye_controls=rrb.EyeControls3D(
                position=(0.0, 0.0, _ROAD_HEIGHT),
                look_target=(0.0, 0.0, 0.0),
                eye_up=(0.0, 1.0, 0.0),
                tracking_entity=schema.ROBOT,
            ),
            line_grid=False,
        )
        return rrb.Vertical(robot, rrb.Horizontal(from_above, keys, column_shares=[4, 3]), row_shares=[3, 3])
    above = rrb.Spatial2DView(
        contents=[schema.OBSTACLES_ABOVE, schema.PATH],
        name="Path from above",
        overrides={
            schema.PATH: [
                rr.LineStrips2D.from_fields(radii=rr.Radius.ui_points(1.5)).visualizer(),
                rrb.VisibleTimeRanges(trails),
            ]
        },
        visual_bounds=_path_bounds(content),
    )
    return rrb.Vertical(robot, rrb.Horizontal(above, keys, column_shares=[3, 4]), row_shares=[3, 2])


def _path_bounds(content: BlueprintContent) -> rrb.VisualBounds2D | None:
    """Return the bounds of the whole path, so that the view does not move during playback."""
    if content.path is None:
        return None
    (left, low), (right, high) = content.path
    margin = max(0.5, _MARGIN * max(right - left, high - low))
    return rrb.VisualBounds2D(
        x_range=(left - margin, right + margin), y_range=(-high - margin, -low + margin)
    )


def _lay_out_stimulation(content: BlueprintContent) -> rrb.Vertical | None:
    rows: list[tuple[int, rrb.View]] = []
    if content.begun or content.magnitudes:
        behaviors = rrb.StateTimelineView(origin=schema.BEHAVIORS, name="Behaviors", time_view=_time_axis())
        rows.append((2, behaviors))
    if content.begun or content.units:
        which = "Four units per behavior" if content.units_left_out else "Stimulated units"
        name = f"{which}: overwritten (bright), natural (dark)"
        rows.append((5, _plot(name, f"{schema.UNITS}/**", named=0 < content.units <= _MOST_NAMED // 2)))
    if content.begun or content.magnitudes:
        name = "Magnitudes: c of a controller, otherwise the factor on the map's magnitudes"
        rows.append((3, _plot(name, f"{schema.MAGNITUDES}/**", named=content.magnitudes <= _MOST_NAMED)))
    if content.heat_map:
        heat = rrb.TensorView(
            origin=schema.HEAT_MAP,
            name="All activations over the session: negative blue, zero gray, positive yellow",
            scalar_mapping=rrb.TensorScalarMapping(colormap="CyanToYellow"),
            view_fit="fill",
        )
        rows.append((5, heat))
    if not rows:
        return None
    return rrb.Vertical(*(view for _, view in rows), row_shares=[share for share, _ in rows])


def _lay_out_measurements(info: DriveInfo, content: BlueprintContent) -> rrb.Vertical:
    """Lay out one plot per physical unit, with targets beside their attributes."""
    target_attributes = BehaviorColorLegend(info).target_attributes
    plots = []
    for unit in dict.fromkeys(attribute.unit for attribute in info.attributes):
        columns = [column for column, one in enumerate(info.attributes) if one.unit == unit]
        shown = [info.attributes[column] for column in columns]
        targets = [
            f"{schema.TARGETS}/{rr.escape_entity_path_part(name)}"
            for name, attribute in target_attributes.items()
            if (content.targets is None or name in content.targets)
            and attribute in [one.name for one in shown]
        ]
        curves = [
            _curve(one.name, "attributes", color, column)
            for one, color, column in zip(shown, cycle(_CURVES), columns, strict=False)
        ]
        named = 1 < len(curves) + len(targets) <= _MOST_NAMED - 2
        plots.append(_plot(_plot_title(shown), schema.DRIVE, *targets, curves=curves, named=named))
    gains = [
        _curve(name, schema.REWARD_COST_ACTION, color, column)
        for column, (name, color) in enumerate(zip(("reward", "cost"), _CURVES, strict=False))
    ]
    plots.append(_plot("Reward and cost of a control step", schema.DRIVE, curves=gains, named=True))
    return rrb.Vertical(*plots)


def _plot_title(attributes: Sequence[Attribute]) -> str:
    """Return a title of names and unit; many names that end in the same word are summarized by it."""
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
        overrides={schema.DRIVE: list(curves)} if curves else None,
        axis_x=_time_axis(),
        plot_legend=rrb.PlotLegend(corner="LeftTop", visible=named),
    )


def _time_axis() -> rrb.TimeAxis:
    """Return a time axis that is shared with the other plots."""
    return rrb.TimeAxis(link="LinkToGlobal")


def _curve(name: str, component: str, color: tuple[int, int, int], column: int) -> rrb.Visualizer:
    mapping = VisualizerComponentMapping(
        target="Scalars:scalars",
        source_kind=ComponentSourceKind.SourceComponent,
        source_component=component,
        selector=f"[{column}]",
    )
    return rr.SeriesLines(names=[name], colors=[color]).visualizer(mappings=[mapping])
