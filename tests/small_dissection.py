"""A dissection of a tiny policy, small enough that several rooms' tests may look at one."""

from __future__ import annotations

from pathlib import Path

import torch

from pdtui.dissection.dissection_config import DissectionSettings
from pdtui.dissection.steering.steering_comparison import SteeringSettings
from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork
from pdtui.policies.weights.weights_file import save_network
from pdtui.search.behavior_search import BehaviorSearchSettings
from pdtui.search.controller_search import ControllerSearchSettings
from pdtui.search.imprint_candidates import ImprintSettings

SMALL = DissectionSettings(
    steps=130,
    screen_values=(-3.0, 3.0),
    screen_starts=2,
    screen_steps=12,
    refine_keep=1,
    refine_values=(-3.0, 0.0, 3.0),
    refine_starts=2,
    refine_steps=12,
    judge_keep=1,
    judge_starts=3,
    controls=6,
    held_steps=20,
    mover_steps=12,
    steering=SteeringSettings(
        starts=2, sources=2, values=(3.0,), lengths=(1.0,), readings=(2.0,), factors=(2.0,)
    ),
    search_starts=2,
    selection_starts=2,
    held_out_starts=2,
    walk_steps=12,
    imprints=ImprintSettings(episodes=2, steps=10, bins=2, units=(3,), factors=(1.0,)),
    behavior_search=BehaviorSearchSettings(
        random_sets=4, single_units=4, elite=3, children=3, promoted=2, max_units=(3,), generations=1,
        quick_starts=1, quick_steps=8, full_starts=2, full_steps=10, finalists=2, final_steps=12,
    ),
    controller_search=ControllerSearchSettings(units=1, finalists=2, steps=8, final_steps=12),
)  # fmt: skip


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
