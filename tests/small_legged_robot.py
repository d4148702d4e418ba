"""A legged robot that is small enough to be read at a glance: a box on two legs with a hip each."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from pdtui.core.robot_links_and_state import CommandRange
from pdtui.robots.legged.legged_robot import LeggedRobot
from pdtui.robots.legged.legged_robot_description import FallRule, LeggedRewardWeights, LeggedRobotDescription

_LEG = """
      <body name="{side}_leg" pos="0 {y} 0">
        <joint name="{side}_hip" type="hinge" axis="0 1 0"/>
        <geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.2"/>
        <geom type="box" size="0.15 0.05 0.02" pos="0 0 -0.2"/>
        <site name="{side}" pos="0 0 -0.2"/>
      </body>"""
_MODEL = """
<mujoco model="small">
  <option timestep="0.005" integrator="implicitfast"/>
  <default>
    <geom contype="1" conaffinity="0" density="500"/>
    <position kp="60" kv="3" forcerange="-20 20"/>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 0.05" contype="0" conaffinity="1"/>
    <body name="trunk" pos="0 0 0.25">
      <freejoint/>
      <geom type="box" size="0.1 0.1 0.05"/>{legs}
    </body>
  </worldbody>
  <actuator>
    <position joint="left_hip"/>
    <position joint="right_hip"/>
  </actuator>
  <sensor>
    <framepos name="left" objtype="site" objname="left"/>
    <framepos name="right" objtype="site" objname="right"/>
    <framelinvel name="left_velocity" objtype="site" objname="left"/>
    <framelinvel name="right_velocity" objtype="site" objname="right"/>
  </sensor>
</mujoco>
"""


def describe_small_robot(folder: Path) -> LeggedRobotDescription:
    """Write the model into a folder and return the robot's description."""
    legs = "".join(_LEG.format(side=side, y=y) for side, y in (("left", 0.12), ("right", -0.12)))
    path = folder / "small.xml"
    path.write_text(_MODEL.format(legs=legs))
    return LeggedRobotDescription(
        model=path,
        feet=("left", "right"),
        default_angles=(0.0, 0.0),
        start_height=0.24,
        fall=FallRule(least_height=0.1, least_upright=0.5),
        rewards=LeggedRewardWeights(target_height=0.2, posture_joints=(0, 1)),
        foot_radius=0.02,
    )


class SmallLeggedRobot(LeggedRobot):
    """The robot of a description, which tests may change."""

    name = "small-legged-robot"
    title = "Small legged robot"
    commands: Mapping[str, float] = MappingProxyType({"forward": 0.5, "lateral": 0.0, "yaw rate": 0.0})
    command_ranges = MappingProxyType({"forward": CommandRange("forward", 0.0, 1.0)})

    def __init__(self, description: LeggedRobotDescription, terrain: str = "plane") -> None:
        # A class states its description; here, each test has its own.
        type(self).description = description
        super().__init__(terrain=terrain)
