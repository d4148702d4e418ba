"""A policy of which one unit drives one motor."""

from __future__ import annotations

from pathlib import Path

import torch

from tests.small_dissection import small_network, write_policy

WIRED_MOTOR = 2
WIRED_UNIT = 5


def write_wired_policy(path: Path) -> Path:
    """One unit of the last layer drives one motor, with weight 0.2; nothing else drives anything."""
    network = small_network(8)
    with torch.no_grad():
        network.head.weight.zero_()
        network.head.bias.zero_()
        network.head.weight[WIRED_MOTOR, WIRED_UNIT] = 0.2
    return write_policy(path, network)
