"""The dog of the guide's page about worlds of one's own, with a model as that page describes it."""

from __future__ import annotations

from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest

from pdtui.guide.guide_pages import GUIDE_FOLDER
from pdtui.robots.legged.legged_robot import LeggedRobot
from tests.guide.guide_markdown import code_examples

_LEG = """
      <body name="{foot}_hip" pos="{x} {y} 0">
        <joint name="{foot}_hip" type="hinge" axis="1 0 0" armature="0.01"/>
        <geom type="sphere" size="0.04" mass="0.7"/>
        <body name="{foot}_thigh" pos="0 {aside} 0">
          <joint name="{foot}_thigh" type="hinge" axis="0 1 0" armature="0.01"/>
          <geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.2" mass="0.9"/>
          <body name="{foot}_calf" pos="0 0 -0.2">
            <joint name="{foot}_calf" type="hinge" axis="0 1 0" armature="0.01"/>
            <geom type="capsule" size="0.015" fromto="0 0 0 0 0 -0.2" mass="0.2"/>
            <geom name="{foot}" type="sphere" size="0.02" pos="0 0 -0.2" mass="0.05"/>
            <site name="{foot}" pos="0 0 -0.2" size="0.03"/>
          </body>
        </body>
      </body>"""
_ACTUATORS = """
    <position joint="{foot}_hip"/>
    <position joint="{foot}_thigh"/>
    <position joint="{foot}_calf"/>"""
_SENSORS = """
    <framepos name="{foot}" objtype="site" objname="{foot}"/>
    <framelinvel name="{foot}_velocity" objtype="site" objname="{foot}"/>
    <touch name="{foot}_touch" site="{foot}"/>"""
_MODEL = """
<mujoco model="dog">
  <option timestep="0.005" integrator="implicitfast" cone="elliptic"/>
  <default>
    <geom contype="1" conaffinity="0" friction="0.8"/>
    <position kp="60" kv="1.5" forcerange="-33 33"/>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 0.05" contype="0" conaffinity="1"/>
    <body name="trunk" pos="0 0 0.35">
      <freejoint/>
      <geom type="box" size="0.18 0.09 0.05" mass="4.6"/>{legs}
    </body>
  </worldbody>
  <actuator>{actuators}
  </actuator>
  <sensor>{sensors}
  </sensor>
</mujoco>
"""
_FEET = {
    "front_left": (0.18, 0.06),
    "front_right": (0.18, -0.06),
    "rear_left": (-0.18, 0.06),
    "rear_right": (-0.18, -0.06),
}


@pytest.fixture
def dog_class(tmp_path: Path) -> type[LeggedRobot]:
    legs = "".join(
        _LEG.format(foot=foot, x=x, y=y, aside=np.copysign(0.08, y)) for foot, (x, y) in _FEET.items()
    )
    actuators, sensors = (
        "".join(part.format(foot=foot) for foot in _FEET) for part in (_ACTUATORS, _SENSORS)
    )
    (tmp_path / "dog.xml").write_text(_MODEL.format(legs=legs, actuators=actuators, sensors=sensors))
    (code,) = [
        one.text
        for one in code_examples(GUIDE_FOLDER / "your-world.md")
        if one.language == "python" and "class Dog" in one.text
    ]
    (tmp_path / "dog.py").write_text(code)
    spec = spec_from_file_location("dog_of_the_guide", tmp_path / "dog.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    dog: type[LeggedRobot] = module.Dog
    return dog


@pytest.mark.parametrize("start", ["plane", "rough"])
def test_the_dog_stands_and_observes(dog_class: type[LeggedRobot], start: str) -> None:
    dog = dog_class()
    assert dog.model.body_mass.sum() == pytest.approx(12.0, abs=0.1)
    observation, _ = dog.reset(seed=1, options={"start": start})
    assert observation.shape == dog.observation_space.shape == (49,)
    for _ in range(100):
        observation, _, fell, _, _ = dog.step(np.zeros(12, np.float32))
        assert not fell
    height = dog.read_attributes()[dog.attribute_index("height")]
    assert 0.2 < height < 0.33
    assert dog.read_state().touching.sum() >= 3


def test_many_dogs_train_together(dog_class: type[LeggedRobot]) -> None:
    pytest.importorskip("jax", reason="the extra 'train' is not installed")
    from pdtui.training.legged_robot_batch import LeggedRobotBatch

    dogs = LeggedRobotBatch(dog_class(terrain="rough", roughness=0.04), 8, seed=0)
    rewards = [dogs.step(np.zeros((8, 12), np.float32)).reward for _ in range(20)]
    assert dogs.observations.shape == (8, 49)
    assert np.isfinite(rewards).all()
    assert np.mean(rewards) > 0.0
