"""Builds the network of a TorchScript archive."""

from __future__ import annotations

import torch

from pdtui.core.errors import PolicyError
from pdtui.policies.foreign.object_tree import decode_tree
from pdtui.policies.foreign.reader_process import ForeignFile
from pdtui.policies.torchscript.torchscript_program import InterpretedModule, TorchScriptProgram


def build_torchscript(found: ForeignFile) -> torch.nn.Module:
    """Return the network of a file that ``torch.jit.save`` wrote, scripted or traced, on the CPU.

    Submodules keep their names. Code that cannot be interpreted (a loop, an operator that is not listed) is
    refused when it is reached, at the latest when a `Policy` tries the network.

    Raises:
        PolicyError: The file is not a TorchScript archive, or holds code that pdtui refuses to run.
    """
    if found.form != "torchscript":
        raise PolicyError(f"{found.source}: expected a TorchScript archive, found {found.form}")
    try:
        root, constants = decode_tree(found.facts["tree"], found.tensors)
        return InterpretedModule(root, TorchScriptProgram(found.facts["code"], constants), {})
    except (PolicyError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise PolicyError(f"{found.source}: {error}") from error
