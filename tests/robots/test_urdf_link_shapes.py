"""URDF shapes become links of the bodies that carry them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pdtui.robots.simulators.urdf_link_shapes import read_urdf_link_shapes

ROBOT = """<robot name="r">
  <link name="base"><collision><geometry><box size="0.4 0.2 0.1"/></geometry></collision></link>
  <joint name="j" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="9 9 9"/></joint>
  <link name="arm"><collision><origin rpy="1.5707963 0 0" xyz="0 0 -0.1"/>
    <geometry><cylinder radius="0.05" length="0.3"/></geometry></collision></link>
  <joint name="f" type="fixed"><parent link="arm"/><child link="tip"/><origin xyz="0 0 -0.2"/></joint>
  <link name="tip"><collision><origin xyz="0.01 0 0"/>
    <geometry><sphere radius="0.02"/></geometry></collision></link>
  <joint name="g" type="revolute"><parent link="arm"/><child link="other"/></joint>
  <link name="other"><collision><geometry><sphere radius="1"/></geometry></collision></link>
</robot>"""


def test_shapes_of_fixed_links_move_with_the_body_that_they_are_fixed_to(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(ROBOT)
    base, arm, tip = read_urdf_link_shapes(path, ("base", "arm"))
    assert (base.body, base.shape, base.size) == (0, "box", (0.2, 0.1, 0.05))
    assert (arm.body, arm.shape, arm.position) == (1, "capsule", (0.0, 0.0, -0.1))
    np.testing.assert_allclose(arm.size, (0.05, 0.1))
    np.testing.assert_allclose(arm.quaternion, (np.sqrt(0.5), np.sqrt(0.5), 0, 0), atol=1e-6)
    assert (tip.body, tip.shape) == (1, "sphere")
    np.testing.assert_allclose(tip.position, (0.01, 0.0, -0.2))
