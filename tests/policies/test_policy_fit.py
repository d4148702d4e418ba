"""Policies in memory that do not fit their robot: both shapes are named."""

from __future__ import annotations

import pytest
import torch
from torch import nn

from pdtui.core.errors import PolicyError
from pdtui.policies.runtime.action_decoders import decode_categorical_action, decode_mean_action
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.runtime.policy_compatibility import check_policy_fit
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.robots import make_robot


def _policy(observations: int, outputs: int, *, chooses: bool = False) -> Policy:
    torch.manual_seed(1)
    network = nn.Sequential(nn.Linear(observations, 4), nn.Tanh(), nn.Linear(4, outputs))
    return Policy(
        network,
        observations,
        decode=decode_categorical_action if chooses else decode_mean_action,
        name="mine",
    )


def test_another_observation_is_named_with_what_the_robot_has() -> None:
    expected = (
        r"policy 'mine' takes observations of shape \(12,\); robot 'Hopper-v5' has observations of shape "
        r"\(11,\) and actions of shape \(3,\)"
    )
    with pytest.raises(PolicyError, match=expected):
        RolloutPool("Hopper-v5", _policy(12, 3))


def test_another_action_is_named_with_what_the_robot_takes() -> None:
    with pytest.raises(PolicyError, match=r"gives actions of shape \(2,\).*actions of shape \(3,\)"):
        check_policy_fit(_policy(11, 2), make_robot("Hopper-v5"), "Hopper-v5")


def test_a_choice_is_one_number() -> None:
    robot = make_robot("CartPole-v1")
    check_policy_fit(_policy(4, 2, chooses=True), robot, "CartPole-v1")
    with pytest.raises(PolicyError, match=r"gives actions of shape \(2,\).*actions of shape \(1,\)"):
        check_policy_fit(_policy(4, 2), robot, "CartPole-v1")
