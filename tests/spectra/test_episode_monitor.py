from __future__ import annotations

from pathlib import Path

import numpy as np

from pdtui.policies.weights.policy_loading import load_policy
from pdtui.robots import make_robot
from pdtui.spectra.episode_monitor import monitor_episodes
from pdtui.spectra.matching_presets import PRESETS
from pdtui.spectra.spectrogram import scaled_attribute_series


def test_a_row_holds_the_activations_and_the_state_that_they_led_to(policy_file: Path) -> None:
    robot, policy = make_robot("ant"), load_policy(policy_file)
    (recorded,) = monitor_episodes(robot, policy, [3], 40)
    observation, _ = robot.reset(seed=3)
    for row in range(40):
        acted = policy.act(observation)
        observation, *_ = robot.step(acted.action)
        np.testing.assert_array_equal(recorded.activations[row], acted.activations)
        # Where the yaw does not wrap, unwrapping leaves the values as they were read.
        np.testing.assert_allclose(recorded.attributes[row], robot.read_attributes(), atol=1e-12)
    assert recorded.attributes.shape == (40, len(robot.attributes))
    assert recorded.ended == ""


def test_angles_do_not_jump(policy_file: Path) -> None:
    robot, policy = make_robot("ant"), load_policy(policy_file)
    recorded = monitor_episodes(robot, policy, range(6), 60)
    for one in recorded:
        for column, attribute in enumerate(robot.attributes):
            if attribute.wraps:
                assert np.abs(np.diff(one.attributes[:, column])).max() < np.pi


def test_walks_begin_in_the_state_that_is_asked_for() -> None:
    robot, policy = make_robot("cassie"), load_policy("cassie")
    plane, rough = (monitor_episodes(robot, policy, [5], 4, start=start)[0] for start in ("", "rough"))
    assert not np.array_equal(plane.attributes, rough.attributes)
    observation, _ = robot.reset(seed=5, options={"start": "rough"})
    robot.step(policy.act(observation).action)
    np.testing.assert_array_equal(rough.attributes[0], robot.read_attributes())


def test_scales_bring_torques_to_the_size_of_commands(policy_file: Path) -> None:
    robot, policy = make_robot("ant"), load_policy(policy_file)
    (recorded,) = monitor_episodes(robot, policy, [1], 20)
    torque = robot.attribute_index("front left hip torque")
    commanded = robot.attributes[torque].scale * recorded.attributes[:, torque]
    (compared,) = scaled_attribute_series([recorded], robot.attributes, PRESETS["paper"])
    np.testing.assert_array_equal(compared[:, torque], commanded)
    assert 0 < np.abs(commanded).max() <= 1
