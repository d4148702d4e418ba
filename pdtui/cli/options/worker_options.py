"""Options that say where a command's jobs run: in worker processes of this machine, or on a cluster."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import wraps
from typing import Any

import click

from pdtui.core.cluster.ray_cluster import RayCluster


def _join_cluster(context: click.Context, _: click.Parameter, address: str | None) -> RayCluster | None:
    if address is None or context.resilient_parsing:
        return None
    cluster = RayCluster(address)
    context.call_on_close(cluster.close)
    return cluster


cluster_option = click.option(
    "--cluster",
    metavar="auto|HOST:PORT",
    callback=_join_cluster,
    help="Run on the Ray cluster with this head node; auto: the one joined here, or one of its own.",
)
"""``--cluster``; the command gets the `RayCluster`, or None."""


def workers_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--workers`` and ``--cluster``; the command gets either of the two as `workers`."""

    @click.option(
        "--workers",
        type=click.IntRange(1, 256),
        metavar="N",
        help="Number of worker processes; default: one per core.",
    )
    @cluster_option
    @wraps(command)
    def with_workers(*args: Any, workers: int | None, cluster: RayCluster | None, **others: Any) -> Any:
        if workers is not None and cluster is not None:
            raise click.UsageError("--workers and --cluster are mutually exclusive")
        return command(*args, workers=cluster or workers or os.cpu_count() or 1, **others)

    return with_workers
