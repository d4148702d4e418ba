"""Import of policies that other programs wrote, one module per format; nothing in a file is executed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pdtui.core.errors import PolicyError
from pdtui.policies.foreign.reader_process import ForeignFile
from pdtui.policies.foreign.zip_archive import shorten_name_list
from pdtui.policies.importers.cleanrl import import_cleanrl
from pdtui.policies.importers.network_assembly import assemble_network
from pdtui.policies.importers.observation_statistics import read_observation_statistics
from pdtui.policies.importers.partial_policy import PartialPolicy, Tensors, to_single_precision
from pdtui.policies.importers.plain_state_dict import import_plain_state_dict
from pdtui.policies.importers.rllib import import_rllib
from pdtui.policies.importers.rsl_rl import import_rsl_rl
from pdtui.policies.importers.stable_baselines3 import OTHER_NETWORKS, import_sb3
from pdtui.policies.weights.import_options import (
    NO_NORMALIZER,
    NO_OPTIONS,
    ImportOptions,
    ObservationActionSpaces,
)
from pdtui.policies.weights.policy_network import PolicyNetwork


def import_network(
    found: ForeignFile,
    import_options: ImportOptions = NO_OPTIONS,
    spaces: ObservationActionSpaces | None = None,
    *,
    normalizer: Path | None = None,
) -> PolicyNetwork:
    """Return the multilayer perceptron in a file that another program wrote.

    Args:
        found: The content of the file, from `pdtui.policies.foreign`.
        import_options: Answers to what the file leaves open.
        spaces: Spaces of the world in which the policy is to act; they give bounds that a file may lack.
        normalizer: File with the statistics of the observation.

    Raises:
        PolicyError: The file cannot be imported; the message says what was found, or which option is needed.
    """
    source = found.source
    try:
        policy = _read_policy(found, import_options)
        if normalizer is not None and import_options.normalizer != NO_NORMALIZER:
            statistics = read_observation_statistics(normalizer, policy.layers[0].shape[1])
            policy = replace(policy, statistics=statistics)
        return assemble_network(policy, import_options, spaces, source)
    except PolicyError as error:
        text = str(error)
        named = text.startswith(source) or (normalizer is not None and text.startswith(str(normalizer)))
        raise error if named else PolicyError(f"{source}: {text}") from error


def _read_policy(found: ForeignFile, import_options: ImportOptions) -> PartialPolicy:
    match found.form:
        case "torchscript":
            raise PolicyError(
                "TorchScript, which is a computation, not a set of weights; load it as a policy"
            )
        case "stable-baselines3":
            return import_sb3(found, import_options)
        case _:
            return _from_tensors(to_single_precision(found.tensors), found.source)


def _from_tensors(tensors: Tensors, source: str) -> PartialPolicy:
    if not tensors:
        raise PolicyError(f"{source}: expected weights, found no tensor")
    if any(tensor.ndim > 2 and "weight" in name for name, tensor in tensors.items()):
        kernels = [f"{name} {tuple(t.shape)}" for name, t in tensors.items() if t.ndim > 2]
        raise PolicyError(
            f"{source}: expected linear layers, found convolutions: {shorten_name_list(kernels)}; "
            f"{OTHER_NETWORKS}"
        )
    return (
        import_rllib(tensors)
        or import_rsl_rl(tensors)
        or import_cleanrl(tensors)
        or import_plain_state_dict(tensors, source)
    )
