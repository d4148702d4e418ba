"""The configuration of a drive for a cluster, whose nodes have none of the user's files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pdtui.core.cluster.ray_cluster import RayCluster, Workers
from pdtui.driving.drive_config import DriveConfig
from pdtui.policies.weights.cluster_policy_files import send_policy_files


def send_drive_files(workers: Workers, config: DriveConfig) -> DriveConfig:
    """Send the files that a drive needs to a cluster, and return the drive with their names there.

    The map is part of the configuration. For worker processes of this machine, nothing changes.

    Raises:
        PolicyError: The drive's policy does not exist.
    """
    if not isinstance(workers, RayCluster):
        return config
    own = config.stimulation_map
    name, options = send_policy_files(
        workers, config.policy or own.policy, own.import_options, (Path(own.source).parent,)
    )
    return replace(config, policy=name, stimulation_map=replace(own, import_options=options))
