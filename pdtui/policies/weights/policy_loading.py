"""Loading and conversion of policies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from hashlib import sha256
from pathlib import Path

import numpy as np

from pdtui.core.errors import PolicyError
from pdtui.policies.foreign.reader_process import ForeignFile, read_foreign_file
from pdtui.policies.importers import import_network
from pdtui.policies.runtime.action_decoders import (
    decode_categorical_action,
    decode_mean_action,
    make_action_decoder,
)
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.torchscript import ForwardPassLimitError, build_torchscript
from pdtui.policies.weights.import_options import (
    NO_NORMALIZER,
    NO_OPTIONS,
    ImportOptions,
    ObservationActionSpaces,
)
from pdtui.policies.weights.policy_file_lookup import find_file_beside, find_weights_file
from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork
from pdtui.policies.weights.weights_file import load_network, save_network
from pdtui.policies.weights.weights_header import hash_file, is_own_format

PACKAGE_POLICY_OPTIONS = {"metadrive:expert": ImportOptions(activation="tanh", squash="clip")}
"""Answers to what the policies of other packages leave open; see `PACKAGE_POLICIES`."""


def load_policy(
    name: str | Path,
    robot: str | None = None,
    *,
    import_options: ImportOptions = NO_OPTIONS,
    spaces: ObservationActionSpaces | None = None,
    folders: Sequence[Path] = (),
    found: ForeignFile | None = None,
) -> Policy:
    """Load a weights file, or a shipped policy by its name.

    A file that another program wrote is imported (`pdtui.policies.importers`); its policy fits every world
    with its shapes.

    Args:
        name: Weights file or name of a shipped policy.
        robot: Name of the robot to drive.
        import_options: Answers to what the file leaves open.
        spaces: The world's spaces, with which the policy's shapes are compared.
        folders: Folders to search besides the working directory.
        found: Content of the file, if `read_policy_of_another_program` has read it.

    Raises:
        PolicyError: There is no such file, or it cannot be read, is for another robot, has other shapes than
            the world, or needs an option.
    """
    path = find_weights_file(str(name), folders)
    if import_options == NO_OPTIONS:
        import_options = PACKAGE_POLICY_OPTIONS.get(str(name), NO_OPTIONS)
    found = found or read_policy_of_another_program(path)
    if found is not None and found.form == "torchscript":
        return load_torchscript_policy(path, found, spaces, import_options)
    network, digest = load_any_network(path, import_options, spaces, folders, found)
    spec = network.spec
    if robot is not None and spec.robot not in ("", robot):
        raise PolicyError(
            f"{path}: expected a policy for robot '{robot}', found one for '{spec.robot}'; "
            f"`pdtui convert {path} --robot {robot} -o FILE.safetensors` makes one for it, if the shapes fit"
        )
    _check_shapes(path, spec, spaces)
    return Policy(
        network, spec.observations, decode=make_action_decoder(network), name=path.stem, sha256=digest
    )


def _check_shapes(path: Path, spec: NetworkSpec, spaces: ObservationActionSpaces | None) -> None:
    if spaces is not None:
        discrete = spec.actions if spec.head == "categorical" else 0
        spaces.check(str(path), spec.observations, spec.action_size, discrete)


def read_policy_of_another_program(path: Path) -> ForeignFile | None:
    """Return the content of a file that another program wrote, None for one that pdtui wrote.

    A file that cannot be read is a `PolicyError`.
    """
    return None if is_own_format(path) else read_foreign_file(path)


def load_any_network(
    path: Path,
    import_options: ImportOptions,
    spaces: ObservationActionSpaces | None,
    folders: Sequence[Path] = (),
    found: ForeignFile | None = None,
) -> tuple[PolicyNetwork, str]:
    """Return the network of a file that pdtui or another program wrote, and its hash.

    The hash is the file's SHA-256, combined with the import options if any, since they make another policy.
    The content of another program's file may be given as `found`.
    """
    found = found or read_policy_of_another_program(path)
    if found is None:
        network = load_network(path)
        _check_agreement(path, network.spec, import_options)
        return network, hash_file(path)
    digest = found.sha256
    statistics = find_statistics(path, import_options, folders)
    network = import_network(found, import_options, spaces, normalizer=statistics)
    if import_options != NO_OPTIONS:
        statistics_digest = hash_file(statistics) if statistics else ""
        parts = (digest, import_options.activation, import_options.squash, statistics_digest)
        digest = sha256("\n".join(parts).encode()).hexdigest()
    return network, digest


def _check_agreement(path: Path, spec: NetworkSpec, import_options: ImportOptions) -> None:
    """Refuse options that contradict a file of pdtui's own, which states everything."""
    squash = "tanh" if spec.head in ("squashed_gaussian", "tanh") else "clip" if spec.action_low else "none"
    for what, stated, chosen in (
        ("activation", spec.activation, import_options.activation),
        ("squash", squash, import_options.squash),
        ("normalizer", NO_NORMALIZER, import_options.normalizer),
    ):
        if chosen and chosen != stated:
            raise PolicyError(f"{path}: its {what} is '{stated}' and cannot be chosen, found '{chosen}'")


def find_statistics(path: Path, import_options: ImportOptions, folders: Sequence[Path]) -> Path | None:
    """Return the statistics file that the options name, in a folder or beside the weights.

    Raises:
        PolicyError: There is no such file.
    """
    name = import_options.normalizer
    if not name or name == NO_NORMALIZER:
        return None
    found = find_file_beside(name, (*folders, path.parent)) or find_file_beside(
        str(path.parent / Path(name).name), ()
    )
    if found is None:
        raise PolicyError(f"{name}: no such file; expected the statistics of the observation for {path}")
    return found


def convert_policy(
    path: Path, output: Path, import_options: ImportOptions, spaces: ObservationActionSpaces | None
) -> NetworkSpec:
    """Write a policy as a safetensors file, and return the specification that it states.

    The policy is one of another program, or one of pdtui for another robot with the same shapes.

    Raises:
        PolicyError: As for `load_policy`; or the output already exists or cannot be written.
    """
    if output.exists():
        raise PolicyError(f"{output}: already exists; a policy is converted into a new file")
    network, _ = load_any_network(path, import_options, spaces)
    _check_shapes(path, network.spec, spaces)
    if spaces is not None:
        network.spec = replace(network.spec, robot=spaces.owner)
    save_network(output, network)
    return network.spec


def load_torchscript_policy(
    path: Path,
    found: ForeignFile,
    spaces: ObservationActionSpaces | None,
    import_options: ImportOptions = NO_OPTIONS,
) -> Policy:
    """Load a TorchScript network, whose output is the action or the logits of discrete actions.

    The network is tried without a batch axis, then with one. The file of a recurrent network does not state
    its initial state; from Python, `pdtui.load_policy` takes it.

    Raises:
        PolicyError: The file cannot be read, the network does not fit the world, or import options are given,
            which a file that states its whole computation does not need.
    """
    if spaces is None:
        raise PolicyError(f"{path}: TorchScript does not state shapes; expected the policy's robot")
    if import_options != NO_OPTIONS:
        raise PolicyError(f"{path}: TorchScript states its whole computation; expected no import options")
    shape, outputs = spaces.shape or (spaces.observations,), spaces.discrete_actions or spaces.actions
    decode = decode_categorical_action if spaces.discrete_actions else decode_mean_action
    build = partial(Policy, build_torchscript(found), shape, name=path.stem, sha256=found.sha256)
    problem = ""
    for batched in (False, True):
        try:
            given = build(batched=batched).act(np.zeros(shape)).action.size
        except ForwardPassLimitError:  # a batch axis would change nothing
            raise
        except PolicyError as error:
            problem = str(error)
            continue
        if given == outputs:
            return build(batched=batched, decode=decode)
        problem = f"{path}: expected {outputs} outputs for '{spaces.owner}', the network gives {given}"
    raise PolicyError(problem)
