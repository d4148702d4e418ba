"""Import of policies that other programs wrote, one module per format; nothing in a file is executed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pdtui.core.errors import PolicyError
from pdtui.policies.importers.cleanrl import import_cleanrl
from pdtui.policies.importers.network_assembly import assemble_network
from pdtui.policies.importers.observation_statistics import read_observation_statistics
from pdtui.policies.importers.partial_policy import PartialPolicy
from pdtui.policies.importers.plain_state_dict import import_plain_state_dict
from pdtui.policies.importers.rllib import import_rllib
from pdtui.policies.importers.rsl_rl import import_rsl_rl
from pdtui.policies.importers.stable_baselines3 import OTHER_NETWORKS, import_sb3, is_sb3_archive
from pdtui.policies.importers.tensor_files import (
    FileKind,
    Tensors,
    detect_file_kind,
    flatten_tensors,
    read_npz_tensors,
    read_safetensors_tensors,
    read_torch_archive,
)
from pdtui.policies.importers.zip_archive import ZipArchive, read_file_bytes, shorten_name_list
from pdtui.policies.weights.import_options import (
    NO_NORMALISER,
    NO_OPTIONS,
    ImportOptions,
    ObservationActionSpaces,
)
from pdtui.policies.weights.policy_network import PolicyNetwork

FORMATS = (
    "Stable-Baselines3 .zip, PyTorch .pt or .pth, .npz or .safetensors of RLlib, rsl_rl, CleanRL or a plain "
    "chain of linear layers"
)


def import_network(
    path: Path,
    import_options: ImportOptions = NO_OPTIONS,
    spaces: ObservationActionSpaces | None = None,
    *,
    normaliser: Path | None = None,
) -> PolicyNetwork:
    """Read a multilayer perceptron that another program wrote.

    Args:
        path: The file, whose format is told by its content.
        import_options: Answers to what the file leaves open.
        spaces: Spaces of the world in which the policy is to act; they give bounds that a file may lack.
        normaliser: File with the statistics of the observation.

    Raises:
        PolicyError: The file cannot be imported; the message says what was found, or which option is needed.
    """
    source = str(path)
    try:
        found = _read_policy(read_file_bytes(path), source, import_options)
        if normaliser is not None and import_options.normaliser != NO_NORMALISER:
            found = replace(
                found, statistics=read_observation_statistics(normaliser, found.layers[0].shape[1])
            )
        return assemble_network(found, import_options, spaces, source)
    except PolicyError as error:
        text = str(error)
        named = text.startswith(source) or (normaliser is not None and text.startswith(str(normaliser)))
        raise error if named else PolicyError(f"{source}: {text}") from error


def _read_policy(content: bytes, source: str, import_options: ImportOptions) -> PartialPolicy:
    match detect_file_kind(content):
        case FileKind.ZIP:
            return _from_zip(content, source, import_options)
        case FileKind.SAFETENSORS:
            return _from_tensors(flatten_tensors(read_safetensors_tensors(content, source)), source)
        case FileKind.PICKLE:
            raise PolicyError(
                f"{source}: a pickle, which can run any code when it is read, so pdtui refuses it; save the "
                "tensors alone: torch.save(model.state_dict(), FILE) of PyTorch 1.6 or later, or numpy.savez"
            )
        case other:
            raise PolicyError(f"{source}: {other.value}; expected {FORMATS}")


def _from_zip(content: bytes, source: str, import_options: ImportOptions) -> PartialPolicy:
    archive = ZipArchive(content, source)
    names = archive.names
    if is_sb3_archive(names):
        return import_sb3(archive, import_options)
    if names and all(name.endswith(".npy") for name in names):
        return _from_tensors(flatten_tensors(read_npz_tensors(archive)), source)
    if any(name.endswith("/constants.pkl") for name in names):
        raise PolicyError(
            f"{source}: TorchScript, which is a computation, not a set of weights; load it as a policy"
        )
    if any(name.endswith("/data.pkl") for name in names):
        return _from_tensors(flatten_tensors(read_torch_archive(content, source)), source)
    raise PolicyError(f"{source}: a zip that holds no policy: its entries are {archive.listing()}")


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
