"""Policies that do not fit their robot: both shapes are named."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from pdtui.dissection.workers import Crew
from pdtui.errors import PolicyError
from pdtui.policies.files import save_network
from pdtui.policies.fit import check_fit
from pdtui.policies.load import load_policy
from pdtui.policies.network import NetworkSpec, PolicyNetwork
from pdtui.robots import make_robot


def _weights(folder: Path, robot: str, observations: int, actions: int) -> Path:
    torch.manual_seed(1)
    bound = (1.0,) * actions
    low = (-1.0,) * actions
    spec = NetworkSpec(robot, observations, (4,), "tanh", actions, "mean", low, bound)
    path = folder / f"{observations}-{actions}.safetensors"
    save_network(path, PolicyNetwork(spec))
    return path


def test_another_observation_is_named_with_what_the_robot_has(tmp_path: Path) -> None:
    path = _weights(tmp_path, "Hopper-v5", 12, 3)
    expected = (
        r"policy '12-3' takes observations of shape \(12,\); robot 'Hopper-v5' has observations of shape "
        r"\(11,\) and actions of shape \(3,\)"
    )
    with pytest.raises(PolicyError, match=expected):
        Crew("Hopper-v5", path)


def test_another_action_is_named_with_what_the_robot_takes(tmp_path: Path) -> None:
    policy = load_policy(_weights(tmp_path, "Hopper-v5", 11, 2))
    with pytest.raises(PolicyError, match=r"gives actions of shape \(2,\).*actions of shape \(3,\)"):
        check_fit(policy, make_robot("Hopper-v5"), "Hopper-v5")


def test_a_choice_is_one_number(tmp_path: Path) -> None:
    robot = make_robot("CartPole-v1")
    check_fit(load_policy(_weights(tmp_path, "CartPole-v1", 4, 1)), robot, "CartPole-v1")
    with pytest.raises(PolicyError, match=r"gives actions of shape \(2,\).*actions of shape \(1,\)"):
        check_fit(load_policy(_weights(tmp_path, "CartPole-v1", 4, 2)), robot, "CartPole-v1")
