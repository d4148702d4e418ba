"""Policies from TorchScript files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pdtui.core.errors import PolicyError
from pdtui.policies.runtime.action_decoders import categorical
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.torchscript import read_torchscript
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions, WorldSpaces
from pdtui.policies.weights.weights_file import hash_file


def load_torchscript_policy(
    path: Path, spaces: WorldSpaces | None, import_options: ImportOptions = NO_OPTIONS
) -> Policy:
    """Load a TorchScript network, whose output is the action or the logits of discrete actions.

    The network is tried without a batch axis, then with one. The file of a recurrent network does not state
    its initial state; from Python, `pdtui.load_policy` takes it.

    Raises:
        PolicyError: The file cannot be read, the network does not fit the world, or import options are given,
            which a file that states its whole computation does not need.
    """
    if spaces is None:
        raise PolicyError(f"{path}: TorchScript says no shapes; expected the robot that it is for")
    if import_options != NO_OPTIONS:
        raise PolicyError(f"{path}: TorchScript states its whole computation; expected no import options")
    module, digest = read_torchscript(path), hash_file(path)
    shape = spaces.shape or (spaces.observations,)
    problems: list[str] = []
    for batched in (False, True):
        try:
            policy = Policy(module, shape, batched=batched, name=path.stem, sha256=digest)
        except PolicyError as error:
            problems.append(str(error))
            continue
        found = policy.act(np.zeros(shape)).action.size
        if found != (spaces.discrete_actions or spaces.actions):
            problems.append(
                f"{path}: expected {spaces.discrete_actions or spaces.actions} outputs for '{spaces.owner}', "
                f"the network gives {found}"
            )
        elif spaces.discrete_actions:
            return Policy(module, shape, batched=batched, decode=categorical, name=path.stem, sha256=digest)
        else:
            return policy
    raise PolicyError(problems[-1])
