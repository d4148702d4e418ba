"""The robot's options in a map: those of the drive take precedence, and all must be options of the robot."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from pdtui.robots import RobotSpec, list_robot_options
from pdtui.robots.options.robot_option import RobotOptions, check_robot_options
from pdtui.stimulation.map_reader import ROBOT_OPTIONS
from pdtui.stimulation.map_table_reader import MapTableReader
from pdtui.stimulation.map_writer import compose_map, replace_robot_options
from pdtui.stimulation.stimulation_map import StimulationMap

if TYPE_CHECKING:
    from pdtui.robots.robot import Robot


def put_robot_options(stimulation_map: StimulationMap, options: RobotOptions) -> StimulationMap:
    """Put options of a drive into a map and its text, which the session keeps; its other options stay.

    Raises:
        MapError: The text of the map is not a map.
    """
    merged = {**stimulation_map.robot_options, **options}
    if merged == stimulation_map.robot_options:
        return stimulation_map
    text = stimulation_map.text or compose_map(stimulation_map)
    text = replace_robot_options(text, merged, stimulation_map.source)
    return replace(stimulation_map, robot_options=merged, text=text)


def map_robot(stimulation_map: StimulationMap, robot: str) -> RobotSpec:
    """Return the robot of this name with the options that the map names.

    Raises:
        RobotError: There is no such robot.
        MapError: The map is for another robot, or names an option that the robot does not have or a value
            that it does not take; the message names the line.
    """
    stimulation_map.check_robot(robot)
    options = stimulation_map.robot_options
    if options:
        source, header = stimulation_map.source, f"[{ROBOT_OPTIONS}]"
        reader = MapTableReader(source, stimulation_map.text, ROBOT_OPTIONS, dict(options), header, 0)
        available = list_robot_options(robot)
        options = check_robot_options(robot, available, options, reader.error)
    return RobotSpec(robot, options)


def combine_map_and_robot(
    stimulation_map: StimulationMap, robot: str | RobotSpec | Robot
) -> tuple[StimulationMap, RobotSpec | Robot]:
    """Return a map that names the options with which the robot is to be built, and that robot.

    Options of the robot take precedence over the map's. A robot that is built already stays as it is.

    Raises:
        PdtuiError: As `put_robot_options` and `map_robot` do.
    """
    if not isinstance(robot, str | RobotSpec):
        return stimulation_map, robot
    spec = RobotSpec(robot) if isinstance(robot, str) else robot
    combined = put_robot_options(stimulation_map, spec.options)
    return combined, map_robot(combined, spec.name)
