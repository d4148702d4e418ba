"""The files of a policy on a cluster, whose nodes have none of the user's files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from pdtui.core.cluster.ray_cluster import RayCluster, Workers
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions
from pdtui.policies.weights.policy_file_lookup import PACKAGE_POLICIES, find_weights_file
from pdtui.policies.weights.policy_loading import find_statistics


def send_policy_files(
    workers: Workers, policy: str, import_options: ImportOptions = NO_OPTIONS, folders: Sequence[Path] = ()
) -> tuple[str, ImportOptions]:
    """Send a policy's weights and statistics to a cluster, and return how its nodes name them.

    The policy of another package keeps its name, as does everything for worker processes of this machine.

    Args:
        workers: Where the policy will be loaded.
        policy: Weights file or name of a shipped policy.
        import_options: Answers to what the file leaves open, which may name a file of statistics.
        folders: Folders to search besides the working directory.

    Raises:
        PolicyError: There is no such file.
    """
    if not isinstance(workers, RayCluster) or policy in PACKAGE_POLICIES:
        return policy, import_options
    path = find_weights_file(policy, folders)
    statistics = find_statistics(path, import_options, folders)
    if statistics is not None:
        import_options = replace(import_options, normalizer=workers.add_file(statistics))
    return workers.add_file(path), import_options
