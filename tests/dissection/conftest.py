from __future__ import annotations

from pathlib import Path

import pytest
import torch

from pdtui.policies.files import save_network
from pdtui.policies.network import NetworkSpec, PolicyNetwork

WIRED_MOTOR = 2
WIRED_UNIT = 5


def write_policy(path: Path, network: PolicyNetwork) -> Path:
    save_network(path, network)
    return path


def small_network(seed: int) -> PolicyNetwork:
    """Two layers of eight units with small random weights: an Ant that trembles and stays on its feet."""
    torch.manual_seed(seed)
    bounds = (-1.0,) * 8, (1.0,) * 8
    network = PolicyNetwork(NetworkSpec("ant", 27, (8, 8), "tanh", 8, "mean", *bounds))
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.mul_(0.3)
    return network


@pytest.fixture(scope="session")
def policy_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_policy(tmp_path_factory.mktemp("policies") / "small.safetensors", small_network(7))


@pytest.fixture(scope="session")
def wired_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One unit of the last layer drives one motor, with weight 0.2; nothing else drives anything."""
    network = small_network(8)
    with torch.no_grad():
        network.head.weight.zero_()
        network.head.bias.zero_()
        network.head.weight[WIRED_MOTOR, WIRED_UNIT] = 0.2
    return write_policy(tmp_path_factory.mktemp("policies") / "wired.safetensors", network)
