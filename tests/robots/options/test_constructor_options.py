"""The options of a robot are what its constructor takes, as far as somebody can type it."""

from __future__ import annotations

from typing import Any, Literal

import pytest

from pdtui.core.errors import RobotError
from pdtui.robots import RobotSpec, list_robot_options, make_robot
from pdtui.robots.options.constructor_options import read_constructor_options


class _Base:
    """A base class.

    Args:
        friction: Friction of the ground.
        mass: Mass, kg.
    """

    def __init__(self, friction: float = 1, mass: float | None = None) -> None:
        self.friction, self.mass = friction, mass


class _World(_Base):
    """A world.

    Args:
        road: What to drive on: a ``dirt``
            road or another.
        cars: How many.
    """

    def __init__(  # type: ignore[no-untyped-def]
        self,
        road: Literal["asphalt", "dirt"] = "asphalt",
        cars: int = 3,
        night: bool = False,
        wind=0.5,
        places: tuple[float, ...] = (),
        **options: Any,
    ) -> None:
        super().__init__(**options)
        self.arguments = (road, cars, night, wind, places)


def test_arguments_that_can_be_typed_are_options() -> None:
    found = {option.name: option for option in read_constructor_options(_World)}
    assert list(found) == ["road", "cars", "night", "wind", "friction", "mass"]
    assert str(found["road"]) == "road (one of asphalt, dirt, default asphalt)"
    assert found["road"].description == "What to drive on: a dirt road or another."
    assert (found["cars"].types, found["cars"].default, found["cars"].description) == ((int,), 3, "How many.")
    assert (found["wind"].types, found["wind"].default) == ((float,), 0.5)
    assert (found["mass"].types, found["mass"].default, found["mass"].description) == (
        (float,),
        None,
        "Mass, kg.",
    )


def test_a_typed_text_becomes_the_options_type() -> None:
    found = {option.name: option for option in read_constructor_options(_World)}
    assert found["friction"].parse("2") == 2.0
    assert type(found["friction"].parse("2")) is float
    assert found["cars"].parse("7") == 7
    assert found["night"].parse("true") is True
    assert found["road"].parse("dirt") == "dirt"
    for name, text, expected in (
        ("cars", "1.5", "expected a whole number, found '1.5'"),
        ("night", "yes", "expected true or false, found 'yes'"),
        ("road", "gravel", "expected one of asphalt, dirt, found 'gravel'"),
        ("friction", "nan", "expected a finite number"),
        ("friction", "much", "expected a number, found 'much'"),
    ):
        with pytest.raises(ValueError, match=expected):
            found[name].parse(text)


@pytest.mark.parametrize(
    ("robot", "options", "said"),
    [
        (
            "bipedal_walker",
            {"torque": True},
            "robot 'bipedal_walker': option 'torque': expected a number, found",
        ),
        (
            "bipedal_walker",
            {"power": 1.0},
            r"option 'power': no such option; available: torque \(a number, defau",
        ),
        ("bipedal_walker", {"torque": 0.0}, "expected a torque of 1 to 10000 N m, found 0"),
        ("ant", {"forward": "up"}, "robot 'ant': option 'forward': expected one of either, x, found 'up'"),
        ("a1", {"terrain": "forest", "density": 1e9}, "expected a density of 0 to 1 trees per m², found 1e"),
        (
            "Pendulum-v1",
            {"g": "strong"},
            "robot 'Pendulum-v1': option 'g': expected a number, found 'strong'",
        ),
        ("Pendulum-v1", {"render_mode": "human"}, "option 'render_mode': no such option"),
        ("Hopper-v5", {"xml_file": "/tmp/mine.xml"}, "expected text that is no path, found '/tmp/mine.xml'"),
        ("Hopper-v5", {"model_path": "hopper.xml"}, "option 'model_path': no such option"),
    ],
)
def test_a_wrong_option_is_named_with_what_is_expected(
    robot: str, options: dict[str, Any], said: str
) -> None:
    with pytest.raises(RobotError, match=said):
        make_robot(robot, **options)


def test_a_robot_knows_what_it_was_built_with() -> None:
    strong = make_robot(RobotSpec("bipedal_walker", {"torque": 100}))
    assert strong.build_options == {"torque": 100.0}
    assert strong.full_title == "BipedalWalker (Box2D), torque = 100"
    assert make_robot(RobotSpec("bipedal_walker", {"torque": 100}), torque=80).build_options["torque"] == 80.0
    assert make_robot("bipedal_walker").full_title == "BipedalWalker (Box2D)"


def test_an_environment_takes_the_arguments_of_its_class() -> None:
    lake = {option.name: option for option in list_robot_options("FrozenLake-v1")}
    assert lake["map_name"].default == "4x4"  # of the registration
    assert make_robot("FrozenLake-v1", map_name="8x8").observation_space.shape == (64,)
    shorter = make_robot("Ant-v5", include_cfrc_ext_in_observation=False)
    assert shorter.observation_space.shape == (27,)
    assert make_robot("Ant-v5").observation_space.shape == (105,)


def test_an_inherited_argument_is_an_option() -> None:
    names = [option.name for option in list_robot_options("a1-vision")]
    assert names == ["terrain", "roughness", "density", "top_speed"]
    assert next(one for one in list_robot_options("a1-vision") if one.name == "terrain").default == "forest"
