"""Figure 2 of the paper for any policy: attributes and the units that match them over one episode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.errors import PictureError
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.core.units import format_unit, parse_unit
from pdtui.dissection.attribute_movers import movable_attribute_columns
from pdtui.pictures.matplotlib_page import open_figure_page
from pdtui.pictures.plot_colors import CYCLE, color_to_hex
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.robots import RobotSpec
from pdtui.spectra.episode_monitor import monitor_episodes
from pdtui.spectra.matching import match_units
from pdtui.spectra.matching_presets import find_matching_preset
from pdtui.spectra.phase_correlation import correlate_phases

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL_HEIGHT = 0.98
"""Inches per pair."""
_DEFAULT_PAIRS = 6
"""Pairs drawn unless attributes are named: as many as fit on half a page."""
_DASHED: dict[str, Any] = {"linestyle": (0, (2.2, 1.2)), "linewidth": 0.9}


@dataclass(frozen=True)
class UnitAttributePair:
    """An attribute and a unit over one episode of T control steps.

    Attributes:
        attribute: The attribute, in its physical unit.
        values: The attribute's values, shape (T,).
        activation: The unit's activation, shape (T,).
        discrepancy: Mean over all episodes; NaN for an attribute that cannot be matched.
        correlation: ρ, averaged as the preset says; NaN where it is undefined.
    """

    attribute: Attribute
    unit: str
    values: Floats
    activation: Floats
    discrepancy: float
    correlation: float


@dataclass(frozen=True)
class UnitAttributePairs:
    """One episode with the pairs that the figure shows.

    Attributes:
        seed: Seed of the episode: the first one that was matched.
        times: Seconds since the reset, shape (T,).
    """

    robot: str
    policy: str
    seed: int
    times: Floats
    pairs: tuple[UnitAttributePair, ...]


def pair_units_with_attributes(
    robot: str | RobotSpec,
    policy: str,
    *,
    attributes: Sequence[str] = (),
    units: Sequence[str] = (),
    import_options: ImportOptions = NO_OPTIONS,
    preset: str = "paper",
    episodes: int = 5,
    steps: int = 1000,
    seed: int = 1000,
    progress: StepProgress | None = None,
) -> UnitAttributePairs:
    """Roll a policy out and pair attributes with units.

    Args:
        attributes: Names of attributes; by default the first six that vary, without torques.
        units: One address per attribute; by default the unit of least discrepancy.
        episodes, steps, seed: The roll-outs, as in a dissection; all of them are matched.

    Raises:
        PictureError: Units and attributes differ in number, or there is nothing to show.
        PdtuiError: A robot, policy, attribute or unit is unknown, or episodes are shorter than a window.
    """
    if units and len(units) != len(attributes):
        raise PictureError(
            f"expected an attribute for each unit, got {len(units)} units and {len(attributes)} attributes"
        )
    spectrum = find_matching_preset(preset)
    with RolloutPool(robot, policy, workers=1, import_options=import_options) as pool:
        world, network = pool.robot, pool.policy
        flats = [parse_unit(unit, network.layers) for unit in units]
        columns = [world.attribute_index(name) for name in attributes]
        recorded = monitor_episodes(world, network, range(seed, seed + episodes), steps, progress)
        matching = match_units(recorded, world.attributes, spectrum)
        rho = correlate_phases(recorded, world.attributes, spectrum).rho(spectrum)
        shown = next(episode for episode in recorded if episode.seed == matching.used[0])
        if not attributes:
            columns = movable_attribute_columns(world.attributes, recorded)[:_DEFAULT_PAIRS]
        best = [matching.ranked_units(column) for column in columns]
        if not columns or (not units and any(not ranked.size for ranked in best)):
            flaws = "; ".join(f"{name}: {flaw}" for name, flaw in matching.flaws.items())
            raise PictureError(f"{robot}: no attribute can be matched with a unit: {flaws or 'none varies'}")
        flats = flats or [int(ranked[0]) for ranked in best]
        pairs = [
            UnitAttributePair(
                world.attributes[column],
                format_unit(unit, network.layers),
                shown.attributes[:, column],
                shown.activations[:, unit].astype(np.float64),
                float(matching.discrepancy[column, unit]),
                float(rho[column, unit]),
            )
            for column, unit in zip(columns, flats, strict=True)
        ]
        times = (np.arange(shown.steps, dtype=np.float64) + 1) * world.control_dt
        return UnitAttributePairs(world.name, network.name, shown.seed, times, tuple(pairs))


def draw_unit_attribute_pairs(
    path: Path, curves: UnitAttributePairs, *, start: float = 0.0, seconds: float | None = 10.0
) -> None:
    """Draw one panel per pair: the attribute as a solid line, the unit as a dashed one, in the same color.

    The part that is shown begins at `start` and lasts `seconds`, or up to the end for None. An existing file
    is replaced once the picture is whole.

    Raises:
        PictureError: The episode ends before `start`, or the file cannot be written.
    """
    end = curves.times[-1] if seconds is None else start + seconds
    part = (curves.times > start) & (curves.times <= end + 1e-9)
    if not part.any():
        raise PictureError(
            f"the episode lasts {curves.times[-1]:g} s; nothing is left to show from {start:g} s on"
        )
    title = f"{curves.robot}, driven by {curves.policy}: units and attributes, episode of seed {curves.seed}"
    with open_figure_page(path, 0.75 + _PANEL_HEIGHT * len(curves.pairs), title) as figure:
        panels = figure.subplots(len(curves.pairs), 1, sharex=True, squeeze=False)[:, 0]
        for panel, pair, color in zip(panels, curves.pairs, cycle(CYCLE), strict=False):
            _draw_pair(panel, pair, curves.times, part, color_to_hex(color))
        panels[-1].set_xlabel("time since the reset (s)")
        panels[-1].set_xlim(curves.times[part][0], curves.times[part][-1])
        _draw_key(figure)


def _draw_pair(
    panel: Axes, pair: UnitAttributePair, times: Floats, part: NDArray[np.bool_], color: str
) -> None:
    attribute = pair.attribute
    panel.plot(times[part], pair.values[part], color=color)
    unit = f"\n({attribute.unit})" if attribute.unit else ""
    panel.set_ylabel(f"{attribute.name}{unit}", color=color)
    right = panel.twinx()
    right.plot(times[part], pair.activation[part], color=color, **_DASHED)
    right.set_ylabel(f"unit {pair.unit}", color=color)
    right.spines["right"].set_visible(True)
    nearness = f"discrepancy {pair.discrepancy:.3g}" if np.isfinite(pair.discrepancy) else "not matched"
    sign = f"ρ = {pair.correlation:+.2f}" if np.isfinite(pair.correlation) else "no ρ"
    panel.set_title(f"{attribute.name} and unit {pair.unit}: {nearness}, {sign}")


def _draw_key(figure: Figure) -> None:
    from matplotlib.lines import Line2D

    lines = [
        Line2D([], [], color="black", label="attribute (left axis)"),
        Line2D([], [], color="black", label="output of the unit (right axis)", **_DASHED),
    ]
    figure.legend(handles=lines, loc="outside lower left", ncols=2)
