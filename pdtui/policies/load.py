"""From a weights file to a policy that can be driven."""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path

import torch

from pdtui.errors import PolicyError
from pdtui.policies.choices import NO_CHOICES, NO_NORMALISER, PolicyChoices, Spaces, find_beside
from pdtui.policies.decoders import decoder_for
from pdtui.policies.files import file_hash, find_weights, is_own_format, load_network
from pdtui.policies.importers import import_network
from pdtui.policies.network import PolicyNetwork
from pdtui.policies.runtime import Policy


def load_policy(
    name: str | Path,
    robot: str | None = None,
    *,
    choices: PolicyChoices = NO_CHOICES,
    spaces: Spaces | None = None,
    folders: Sequence[Path] = (),
) -> Policy:
    """Load a weights file, or a shipped policy by its name.

    A file that pdtui did not write is imported (`pdtui.policies.importers`); its policy belongs to no robot
    and fits every world with its shapes. PyTorch is set to one thread: at this size more threads only cost,
    and sums keep their order.

    Args:
        name: file or shipped name.
        robot: what it is to drive.
        choices: what the file may leave open.
        spaces: of the world that it is to act in, to be compared with the policy's shapes.
        folders: where to look for files beside the working directory.

    Raises:
        PolicyError: no such file, unreadable, made for another robot, of other shapes than the world's, or
            in need of a choice.
    """
    path = find_weights(str(name), folders)
    network, digest = load_any_network(path, choices, spaces, folders)
    spec = network.spec
    if robot is not None and spec.robot not in ("", robot):
        raise PolicyError(f"{path}: expected a policy for robot '{robot}', found one for '{spec.robot}'")
    if spaces is not None:
        discrete = spec.head == "categorical"
        spaces.check(str(path), spec.observations, spec.action_size, spec.actions if discrete else 0)
    torch.set_num_threads(1)
    return Policy(network, spec.observations, decode=decoder_for(network), name=path.stem, sha256=digest)


def load_any_network(
    path: Path, choices: PolicyChoices, spaces: Spaces | None, folders: Sequence[Path] = ()
) -> tuple[PolicyNetwork, str]:
    """The network of a file that pdtui or somebody else wrote, and its hash.

    The hash is the file's SHA-256; where statistics come from a second file, that of both hashes.

    Raises:
        PolicyError: as `load_policy`.
    """
    if is_own_format(path):
        if choices != NO_CHOICES:
            raise PolicyError(f"{path}: states activation, squash and normaliser itself; expected no choices")
        return load_network(path), file_hash(path)
    statistics = None
    if choices.normaliser and choices.normaliser != NO_NORMALISER:
        statistics = find_beside(choices.normaliser, (*folders, path.parent))
        if statistics is None:
            raise PolicyError(f"{choices.normaliser}: no such file of statistics of the observation")
    network = import_network(path, choices, spaces, normaliser=statistics)
    digest = file_hash(path)
    if statistics is not None:
        digest = sha256((digest + file_hash(statistics)).encode()).hexdigest()
    return network, digest
