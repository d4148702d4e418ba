"""Step 3, match: which unit's spectrogram is nearest to an attribute's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.dissection.monitor import Episode
from pdtui.dissection.spectrum import Preset, spectrogram, transform
from pdtui.errors import PolicyError
from pdtui.robots.types import Attribute, Floats


@dataclass(frozen=True)
class Match:
    """Discrepancies of every pair of attribute and unit.

    Attributes:
        discrepancy: mean over the episodes used, shape (J, U); NaN where `flaws` names the attribute.
        level_share: part of the squared distance that lies in the bins that a constant fills, in [0, 1], mean
            over episodes, shape (J, U). Near 1, the match is one of mean levels (and of anything slower
            than those bins), not of movement.
        used: seeds of the episodes that count.
        skipped: (seed, steps) of the episodes that are shorter than one window.
        flaws: what is wrong with an attribute, by its name: not finite (left out), or constant (kept, but
            its spectrum says only at what level it stands).
    """

    discrepancy: Floats
    level_share: Floats
    used: tuple[int, ...]
    skipped: tuple[tuple[int, int], ...]
    flaws: dict[str, str]

    def ranked(self, column: int) -> NDArray[np.intp]:
        """Units by discrepancy with one attribute, the nearest first; empty for an attribute left out."""
        row = self.discrepancy[column]
        return np.argsort(row, kind="stable")[: int(np.isfinite(row).sum())]


def usable(episodes: Sequence[Episode], preset: Preset) -> list[Episode]:
    """The episodes that hold at least one window."""
    return [episode for episode in episodes if episode.steps >= preset.length]


def match(episodes: Sequence[Episode], attributes: Sequence[Attribute], preset: Preset) -> Match:
    """``Dis(z, s) = ‖SG_z − SG_s‖₂`` over all frequencies and windows, averaged over episodes (section 3.2).

    Distances are taken difference by difference: expanding the square would cancel the digits that tell near
    matches apart.

    Args:
        episodes: unstimulated roll-outs.
        attributes: of the robot; their scales apply.
        preset: of the spectrum.

    Raises:
        PolicyError: no episode is as long as one window.
    """
    used = usable(episodes, preset)
    skipped = tuple((episode.seed, episode.steps) for episode in episodes if episode.steps < preset.length)
    if not used:
        lengths = ", ".join(str(steps) for _, steps in skipped) or "none"
        raise PolicyError(
            f"expected an episode of at least {preset.length} steps (one window of preset '{preset.name}'), "
            f"got {lengths}"
        )
    discrepancies, shares = [], []
    for episode in used:
        units = spectrogram(transform(episode.activations, preset), preset)
        targets = spectrogram(transform(episode.scaled(attributes), preset), preset)
        distance = np.empty((len(targets), len(units)))
        share = np.empty_like(distance)
        for row, target in enumerate(targets):
            squares = (units - target) ** 2
            total = squares.sum(axis=(1, 2))
            level = squares[:, :, : preset.level_bins].sum(axis=(1, 2))
            distance[row] = np.sqrt(total)
            share[row] = np.divide(level, total, out=np.zeros_like(total), where=total > 0)
        discrepancies.append(distance)
        shares.append(share)
    flaws = _find_flaws(used, attributes)
    result, level_share = np.mean(discrepancies, axis=0), np.mean(shares, axis=0)
    for row, attribute in enumerate(attributes):
        if flaws.get(attribute.name, "").startswith("not finite"):
            result[row] = level_share[row] = np.nan
    return Match(result, level_share, tuple(episode.seed for episode in used), skipped, flaws)


def _find_flaws(episodes: Sequence[Episode], attributes: Sequence[Attribute]) -> dict[str, str]:
    flaws: dict[str, str] = {}
    for column, attribute in enumerate(attributes):
        series = [episode.attributes[:, column] for episode in episodes]
        broken = [
            episode.seed
            for episode, values in zip(episodes, series, strict=True)
            if not np.isfinite(values).all()
        ]
        if broken:
            flaws[attribute.name] = f"not finite in the episodes of seeds {broken}; left out"
        elif all(np.ptp(values) == 0 for values in series):
            flaws[attribute.name] = "constant in every episode; only its level can match"
    return flaws
