"""The gait of a quadruped, named by the phases at which its feet touch down (Hildebrand, Science, 1965)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.robot_links_and_state import FootPlace
from pdtui.evaluation.gait.foot_metrics import Contacts, find_touchdowns

PLACES: tuple[FootPlace, ...] = ("front left", "front right", "rear left", "rear right")
"""The order of the feet; lags are those behind the first."""
IRREGULAR = "irregular"
# Lags of the gaits, in strides, in the order of PLACES. A gallop leads with either foot, in front and behind.
_GAITS: tuple[tuple[str, tuple[float, float, float, float]], ...] = (
    ("walk", (0.0, 0.5, 0.75, 0.25)),
    ("walk", (0.0, 0.5, 0.25, 0.75)),
    ("trot", (0.0, 0.5, 0.5, 0.0)),
    ("pace", (0.0, 0.5, 0.0, 0.5)),
    ("bound", (0.0, 0.0, 0.5, 0.5)),
    ("pronk", (0.0, 0.0, 0.0, 0.0)),
    ("gallop", (0.0, 0.2, 0.5, 0.7)),
    ("gallop", (0.0, 0.8, 0.5, 0.3)),
    ("gallop", (0.0, 0.2, 0.7, 0.5)),
    ("gallop", (0.0, 0.8, 0.3, 0.5)),
)
# Mean length of the phases' resultants below which strides have no common phase.
_LEAST_REGULARITY = 0.5


@dataclass(frozen=True)
class PhaseLags:
    """When the feet touch down in a stride.

    Attributes:
        lags: Lag of each foot behind the first, in strides from 0 to 1, in the order of `PLACES`.
        regularity: Mean length of the resultants of the phases of the other feet: 1 where each touches down
            at one phase of every stride, near 0 where at any.
    """

    lags: tuple[float, float, float, float]
    regularity: float


def measure_phase_lags(contacts: Contacts) -> PhaseLags | None:
    """Return the lags of four feet in the order of `PLACES`, shape (T, 4); None if a foot makes no stride.

    A stride lasts from one touchdown of the first foot to the next.
    """
    steps = [np.flatnonzero(column) for column in find_touchdowns(contacts).T]
    first, lags, lengths = steps[0], [0.0], []
    if len(first) < 2:
        return None
    for own in steps[1:]:
        within = own[(own >= first[0]) & (own < first[-1])]
        if not len(within):
            return None
        stride = np.searchsorted(first, within, side="right") - 1
        phases = (within - first[stride]) / (first[stride + 1] - first[stride])
        resultant = np.exp(2j * np.pi * phases).mean()
        lags.append(float(np.angle(resultant) / (2.0 * np.pi)) % 1.0)
        lengths.append(abs(resultant))
    return PhaseLags((lags[0], lags[1], lags[2], lags[3]), float(np.mean(lengths)))


def average_lags(walks: list[PhaseLags]) -> PhaseLags:
    """Return the mean lags of several walks, and the mean of their regularities."""
    phases = np.exp(2j * np.pi * np.array([walk.lags for walk in walks])).mean(axis=0)
    lags = (np.angle(phases) / (2.0 * np.pi)) % 1.0
    return PhaseLags(
        (0.0, float(lags[1]), float(lags[2]), float(lags[3])),
        float(np.mean([walk.regularity for walk in walks])),
    )


def name_gait(lags: PhaseLags) -> str:
    """Return the name of the nearest gait: walk, trot, pace, bound, gallop or pronk; or that it is irregular.

    The nearest is the one whose lags differ least from these in the root mean square over the feet, when the
    strides may begin at any phase.
    """
    if lags.regularity < _LEAST_REGULARITY:
        return IRREGULAR
    return min(_GAITS, key=lambda gait: _distance(np.array(lags.lags), np.array(gait[1])))[0]


def _distance(lags: Floats, gait: Floats) -> float:
    """Return the root mean square of the differences of phases, after the best common shift, in strides."""
    turns = np.exp(2j * np.pi * (lags - gait))
    shifted = np.angle(turns / turns.mean()) if abs(turns.mean()) > 1e-9 else np.angle(turns)
    return float(np.sqrt(np.mean(np.square(shifted))) / (2.0 * np.pi))
