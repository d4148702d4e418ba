"""The options of what the ghost of a drive does otherwise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import click

from pdtui.cli.options.shared_options import build_drive_config
from pdtui.core.errors import PdtuiError

if TYPE_CHECKING:
    from pdtui.driving.drive_config import DriveConfig


def ghost_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--ghost-map``, ``--ghost-policy`` and ``--ghost-factor``; the command gets `add_ghost`.

    That is a function from a `DriveConfig` to the one with this ghost.
    """

    @click.option(
        "--ghost-map",
        metavar="MAP",
        help="The ghost has the behaviors of this map on the same keys, and its policy, instead of none.",
    )
    @click.option("--ghost-policy", metavar="FILE", help="The ghost acts by this policy, without behaviors.")
    @click.option(
        "--ghost-factor",
        type=click.FloatRange(-100.0, 100.0),
        metavar="FACTOR",
        help="The ghost has the drive's behaviors, with this multiple of their magnitudes.",
    )
    @wraps(command)
    def with_options(
        *args: Any, ghost_map: str | None, ghost_policy: str | None, ghost_factor: float | None, **others: Any
    ) -> Any:
        def add_ghost(config: DriveConfig) -> DriveConfig:
            return _add_ghost(config, ghost_map, ghost_policy, ghost_factor)

        return command(*args, add_ghost=add_ghost, **others)

    return with_options


def _add_ghost(
    config: DriveConfig, ghost_map: str | None, policy: str | None, factor: float | None
) -> DriveConfig:
    """Return the drive with a ghost that is other; an error of its map or policy comes before the drive."""
    if ghost_map is None and policy is None and factor is None:
        return config
    from pdtui.driving.ghost.ghost_variant import GhostVariant
    from pdtui.stimulation.map_library import map_without_behaviors
    from pdtui.stimulation.map_policy_lookup import resolve_map_policy

    if factor is not None and (ghost_map is not None or policy is not None):
        raise PdtuiError(
            "--ghost-factor is about the drive's own behaviors, so it needs no other map or policy"
        )
    if factor is not None:
        return replace(config, ghost=GhostVariant(f"× {factor:g}", factor=factor))
    robot = config.robot
    if ghost_map is not None:
        other = build_drive_config(robot, ghost_map, policy or "", force=config.force)
    else:
        other = replace(
            config, stimulation_map=resolve_map_policy(map_without_behaviors(robot, policy or ""))
        )
    other.stimulation_map.check_robot(robot)
    # The same world, whatever options the other map names.
    options = config.stimulation_map.robot_options
    other = replace(other, policy="", stimulation_map=replace(other.stimulation_map, robot_options=options))
    return replace(config, ghost=GhostVariant(PurePath(ghost_map or policy or "").stem, other))
