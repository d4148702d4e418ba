"""Figure 2 of the paper from any policy: a unit and the attribute that it matches, over an episode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.errors import PictureError
from pdtui.core.units import format_unit, parse_unit
from pdtui.dissection.attribute_movers import movable_columns
from pdtui.pictures.matplotlib_page import figure_page
from pdtui.pictures.plot_colors import CYCLE, to_hex
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.spectra.matching import match_units
from pdtui.spectra.matching_presets import find_preset
from pdtui.spectra.monitor import StepProgress, monitor_episodes
from pdtui.spectra.phase_correlation import correlate_phases

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL = 0.98
_FEW = 6


@dataclass(frozen=True)
class MatchedCurve:
    """A unit and an attribute over one episode.

    Attributes:
        attribute: in its physical unit.
        unit: address.
        values: of the attribute, shape (T,).
        activation: of the unit, shape (T,).
        discrepancy: mean over the episodes; NaN for an attribute that cannot be matched.
        correlation: ρ by the mean that the preset goes by; NaN where there is none.
    """

    attribute: Attribute
    unit: str
    values: Floats
    activation: Floats
    discrepancy: float
    correlation: float


@dataclass(frozen=True)
class MatchedEpisode:
    """What the figure shows.

    Attributes:
        robot, policy: names.
        seed: of the episode shown, the first that counts.
        times: since the reset, s, shape (T,).
        pairs: unit and attribute.
    """

    robot: str
    policy: str
    seed: int
    times: Floats
    pairs: tuple[MatchedCurve, ...]


def match_episode(
    robot: str,
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
) -> MatchedEpisode:
    """Roll a policy out and pair attributes with units.

    Args:
        robot: its name.
        policy: weights file or name of a shipped policy.
        attributes: names; by default the first six that the robot moves, torques left out.
        units: an address for each attribute; by default the unit of least discrepancy.
        import_options: what the weights file leaves open.
        preset: of the spectra.
        episodes, steps, seed: of the roll-outs, as a dissection has them; matching is over all of them.
        progress: called with (episodes done, episodes).

    Raises:
        PictureError: not as many units as attributes, or nothing to show.
        PdtuiError: an unknown robot, policy, attribute or unit, or episodes shorter than a window.
    """
    if units and len(units) != len(attributes):
        raise PictureError(
            f"expected an attribute for each unit, got {len(units)} units and {len(attributes)} attributes"
        )
    spectrum = find_preset(preset)
    with RolloutPool(robot, policy, workers=1, import_options=import_options) as pool:
        world, network = pool.robot, pool.policy
        flats = [parse_unit(unit, network.layers) for unit in units]
        columns = [world.attribute_index(name) for name in attributes]
        recorded = monitor_episodes(world, network, range(seed, seed + episodes), steps, progress)
        matching = match_units(recorded, world.attributes, spectrum)
        rho = correlate_phases(recorded, world.attributes, spectrum).rho(spectrum)
        shown = next(episode for episode in recorded if episode.seed == matching.used[0])
        if not attributes:
            columns = movable_columns(world.attributes, recorded)[:_FEW]
        best = [matching.ranked_units(column) for column in columns]
        if not columns or (not units and any(not ranked.size for ranked in best)):
            flaws = "; ".join(f"{name}: {flaw}" for name, flaw in matching.flaws.items())
            raise PictureError(
                f"{robot}: no attribute that a unit could be matched with: {flaws or 'none varies'}"
            )
        flats = flats or [int(ranked[0]) for ranked in best]
        pairs = [
            MatchedCurve(
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
        return MatchedEpisode(robot, network.name, shown.seed, times, tuple(pairs))


def draw_matched_curves(
    path: Path, curves: MatchedEpisode, *, start: float = 0.0, seconds: float | None = 10.0
) -> None:
    """Draw the pairs, one panel and one colour each: the attribute as a line, the unit dashed.

    Args:
        path: a PNG; an existing file is replaced once the picture is whole.
        curves: what to show.
        start, seconds: the part of the episode to show, s; None shows it to the end.

    Raises:
        PictureError: matplotlib is missing, the episode ends before `start`, or the file cannot be written.
    """
    end = curves.times[-1] if seconds is None else start + seconds
    part = (curves.times > start) & (curves.times <= end + 1e-9)
    if not part.any():
        raise PictureError(
            f"the episode lasts {curves.times[-1]:g} s; nothing is left to show from {start:g} s on"
        )
    title = f"{curves.robot}, driven by {curves.policy}: units and attributes, episode of seed {curves.seed}"
    with figure_page(path, 0.75 + _PANEL * len(curves.pairs), title) as figure:
        panels = figure.subplots(len(curves.pairs), 1, sharex=True, squeeze=False)[:, 0]
        for panel, pair, color in zip(panels, curves.pairs, cycle(CYCLE), strict=False):
            _draw_pair(panel, pair, curves.times, part, to_hex(color))
        panels[-1].set_xlabel("time since the reset (s)")
        panels[-1].set_xlim(curves.times[part][0], curves.times[part][-1])
        _draw_key(figure)


def _draw_pair(panel: Axes, pair: MatchedCurve, times: Floats, part: NDArray[np.bool_], color: str) -> None:
    attribute = pair.attribute
    panel.plot(times[part], pair.values[part], color=color)
    unit = f" ({attribute.unit})" if attribute.unit else ""
    panel.set_ylabel(f"{attribute.name}\n{unit.strip()}".strip(), color=color)
    right = panel.twinx()
    right.plot(times[part], pair.activation[part], color=color, linestyle=(0, (2.2, 1.2)), linewidth=0.9)
    right.set_ylabel(f"unit {pair.unit}", color=color)
    right.spines["right"].set_visible(True)
    panel.set_title(f"{attribute.name} and unit {pair.unit}: {_facts(pair)}")


def _facts(pair: MatchedCurve) -> str:
    parts = [
        f"discrepancy {pair.discrepancy:.3g}" if np.isfinite(pair.discrepancy) else "not matched",
        f"ρ = {pair.correlation:+.2f}" if np.isfinite(pair.correlation) else "no ρ",
    ]
    return ", ".join(parts)


def _draw_key(figure: Figure) -> None:
    from matplotlib.lines import Line2D

    lines = [
        Line2D([], [], color="black", label="attribute (left axis)"),
        Line2D(
            [],
            [],
            color="black",
            linestyle=(0, (2.2, 1.2)),
            linewidth=0.9,
            label="output of the unit (right axis)",
        ),
    ]
    figure.legend(handles=lines, loc="outside lower left", ncols=2)
