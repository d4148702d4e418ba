"""On another machine a session need not repeat bit for bit; a changed policy is noticed all the same."""

from __future__ import annotations

import os
import subprocess
import sys

CODE = """
import torch
from pdtui.driving.session_replay import replay_session
from pdtui.policies.runtime.action_decoders import make_action_decoder
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.policy_file_lookup import find_weights_file
from pdtui.policies.weights.weights_file import load_network
from pdtui.stimulation.map_library import shipped_folder

network = load_network(find_weights_file("ant"))
noise = torch.Generator().manual_seed(4)
with torch.no_grad():
    for weight in network.parameters():
        weight.mul_(1 + CHANGE * torch.randn(weight.shape, generator=noise))
policy = Policy(network, network.spec.observations, decode=make_action_decoder(network))
result = replay_session(shipped_folder("sessions") / "samples" / "ant.rrd", policy=policy, force=True)
assert result.tolerance is not None or result.identical, result.environment
print("passed" if result.passed else "failed")
"""


def _replay_on_another_processor(change: float) -> str:
    """Replay the Ant's sample with weights changed by this share, summed as an older processor would."""
    environment = {**os.environ, "OPENBLAS_CORETYPE": "Nehalem"}
    code = CODE.replace("CHANGE", str(change))
    return subprocess.check_output([sys.executable, "-c", code], env=environment, text=True).split()[-1]


def test_the_sessions_policy_repeats_within_the_tolerance() -> None:
    assert _replay_on_another_processor(0.0) == "passed"


def test_weights_changed_by_a_hundred_thousandth_do_not() -> None:
    assert _replay_on_another_processor(1e-5) == "failed"
