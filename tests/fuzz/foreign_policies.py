"""Good policies as other programs write them, to be damaged."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import torch
from torch import nn

from tests.hostile_archives import zipped

_SB3 = {
    "policy_class": {"__module__": "stable_baselines3.common"},
    "clip_range": 0.2,
    "action_space": {"low": "[-1.]", "high": "[1.]"},
}


def write_foreign_files(paths: Mapping[str, Path]) -> None:
    """Write files of the kinds ``npz``, ``sb3``, ``torchscript`` and ``statistics``."""
    torch.manual_seed(3)
    network = nn.Sequential(nn.Linear(3, 4), nn.Tanh(), nn.Linear(4, 1))
    with paths["npz"].open("wb") as file:
        np.savez(file, **{name: one.numpy() for name, one in network.state_dict().items()})
    names = {"0": "mlp_extractor.policy_net.0", "2": "action_net"}
    renamed = {f"{names[name[0]]}{name[1:]}": one for name, one in network.state_dict().items()}
    renamed["log_std"] = torch.zeros(1)
    policy = paths["sb3"].with_suffix(".pth")
    torch.save(renamed, policy)
    paths["sb3"].write_bytes(zipped({"data": json.dumps(_SB3).encode(), "policy.pth": policy.read_bytes()}))
    torch.jit.save(torch.jit.script(network), str(paths["torchscript"]))
    paths["statistics"].write_text(json.dumps({"mean": [0.0] * 3, "var": [1.0] * 3, "clip_obs": 5.0}))
