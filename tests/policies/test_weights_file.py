"""Weights on disk: whole, checked, never unpickled."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest
import torch
from safetensors.torch import save_file

from pdtui.core.errors import PolicyError
from pdtui.policies.weights.policy_file_lookup import find_weights_file
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.policies.weights.weights_file import load_network, save_network


def test_what_is_saved_comes_back(weights: Path, tmp_path: Path) -> None:
    network = load_network(weights)
    network.normalizer.mean.fill_(0.5)
    save_network(tmp_path / "copy.safetensors", network)
    copy = load_network(tmp_path / "copy.safetensors")
    assert copy.spec == network.spec
    assert copy.normalizes
    for name, tensor in network.state_dict().items():
        assert torch.equal(copy.state_dict()[name], tensor)
    assert [path.name for path in tmp_path.iterdir()] == ["copy.safetensors"]


def test_a_pickle_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "evil.safetensors"
    path.write_bytes(pickle.dumps({"a": 1}))
    with pytest.raises(PolicyError, match="expected a safetensors file"):
        load_network(path)


def test_foreign_safetensors_say_what_they_hold(tmp_path: Path) -> None:
    path = tmp_path / "foreign.safetensors"
    save_file({"actor.0.weight": torch.zeros(2, 2)}, path)
    with pytest.raises(PolicyError, match=r"expected metadata 'pdtui'.*actor\.0\.weight"):
        load_network(path)


def test_a_tensor_that_is_not_finite_is_named(weights: Path, tmp_path: Path) -> None:
    network = load_network(weights)
    with torch.no_grad():
        network.head.bias[0] = float("nan")
    save_network(tmp_path / "nan.safetensors", network)
    with pytest.raises(PolicyError, match=r"tensor 'head\.bias': expected finite numbers"):
        load_network(tmp_path / "nan.safetensors")


def test_a_missing_policy_lists_the_shipped_ones() -> None:
    with pytest.raises(PolicyError, match="no policy 'nobody'.*ant"):
        find_weights_file("nobody")


def test_a_policy_of_another_robot_is_refused(weights: Path) -> None:
    with pytest.raises(
        PolicyError, match="expected a policy for robot 'walker', found one for 'ant'; `pdtui conv"
    ):
        load_policy(weights, "walker")
