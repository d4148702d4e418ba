"""A small seeded policy for the Ant and a map for it, so that tests need no training."""

from __future__ import annotations

from pathlib import Path

import torch

from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork
from pdtui.policies.weights.weights_file import save_network
from pdtui.policies.weights.weights_header import hash_file

SMALL_MAP = """\
schema = 1
robot = "ant"

[policy]
name = "{policy}"
sha256 = "{sha256}"

[keys]
default = "space"

[[primitives]]
name = "sway"
attribute = "vy"
unit = "0:3"
rho = -0.5
value = 3.0
measured = {{ effect = 0.4, low = 0.1, high = 0.7 }}

[[behaviors]]
name = "push"
key = "w"
says = "pushes"
magnitudes = {{ sway = 4.0, "1:7" = 2.0 }}
aim = {{ attribute = "vy", direction = "increase" }}

[[behaviors]]
name = "twitch"
key = "t"
says = "twitches for half a second"
magnitudes = {{ "1:2" = -3.0 }}
period = 0.5
together = ["push"]

[[behaviors]]
name = "hold heading"
key = "h"
says = "holds a heading"
mode = "pid"
magnitudes = {{ "0:5" = 1.0 }}
pid = {{ attribute = "yaw", kp = 2.0, ki = 0.1, kd = 0.05, limit = 3.0, step = 0.1 }}
"""


def write_small_weights(path: Path, layers: tuple[int, ...] = (16, 16)) -> Path:
    """Weights of an untrained tanh policy for the Ant."""
    torch.manual_seed(7)
    spec = NetworkSpec(
        robot="ant",
        observations=27,
        layers=layers,
        activation="tanh",
        actions=8,
        head="squashed_gaussian",
        action_low=(-1.0,) * 8,
        action_high=(1.0,) * 8,
    )
    save_network(path, PolicyNetwork(spec))
    return path


def write_small_map(folder: Path) -> Path:
    """That policy and the map, in a folder; the map's path."""
    weights = write_small_weights(folder / "small.safetensors")
    path = folder / "small.toml"
    path.write_text(SMALL_MAP.format(policy=weights, sha256=hash_file(weights)))
    return path
