"""A Ray cluster of several nodes on this machine, bound to 127.0.0.1."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from tempfile import TemporaryDirectory
from typing import Any

import pytest

os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] = "0"  # read when Ray is imported: bind to 127.0.0.1
os.environ["RAY_USAGE_STATS_ENABLED"] = "0"

pytest.importorskip("ray", reason="the extra 'cluster' is not installed")

from ray.cluster_utils import Cluster

from pdtui.core.cluster.ray_cluster import RayCluster


@contextmanager
def local_cluster(nodes: int) -> Iterator[tuple[RayCluster, Any]]:
    """Yield a cluster of nodes with one core each, joined by this process, and what can kill its nodes."""
    with (
        TemporaryDirectory(prefix="ray-", ignore_cleanup_errors=True) as folder,
        pytest.MonkeyPatch.context() as patch,
    ):
        # Elsewhere than usual, so that `--cluster auto` of somebody else does not find it.
        patch.setenv("RAY_TMPDIR", folder)
        with _start_nodes(nodes) as cluster, RayCluster(cluster.address) as joined:
            yield joined, cluster


@contextmanager
def _start_nodes(nodes: int) -> Iterator[Cluster]:
    cluster = Cluster()
    try:
        for number in range(nodes):
            head = {"include_dashboard": False} if number == 0 else {}
            cluster.add_node(node_ip_address="127.0.0.1", num_cpus=1, **head)
        yield cluster
    finally:
        cluster.shutdown()
