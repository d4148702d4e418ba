"""How motor primitives come about in training: figure 5 of the paper, with what probing says beside it.

The primitives are those of the last checkpoint of a training run: the first match of each attribute. What is
measured of each checkpoint before it is the discrepancy of these same units, and what they do when they are
overwritten.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import stats

from pdtui.core.attributes import Floats
from pdtui.core.errors import StudyError
from pdtui.policies.weights.weights_file import CHECKPOINT_FOLDER
from pdtui.probing.matching_hits import rank_correlation
from pdtui.spectra.matching_presets import MatchingPreset

_FEWEST = 3
"""Fewer checkpoints show no course."""
_DRAWS = 2000


@dataclass(frozen=True)
class DynamicsSettings:
    """How each checkpoint is measured.

    Attributes:
        preset: How units are matched.
        episodes, episode_steps: Monitored episodes, and their most control steps.
        first_seed: First seed of the monitored episodes.
        score_seeds, score_steps: Episodes that score a checkpoint, and their most control steps.
        values: Outputs at which the units are held.
        starts, start_steps: Number of starts of stimulated roll-outs, and the steps of a walk they are from.
        probed_steps: Control steps of a roll-out, the second half of which is measured.
    """

    preset: MatchingPreset
    episodes: int = 5
    episode_steps: int = 1000
    first_seed: int = 3000
    score_seeds: range = range(500, 508)
    score_steps: int = 600
    values: tuple[float, ...] = (-3.0, 3.0)
    starts: int = 4
    start_steps: range = range(20, 51)
    probed_steps: int = 40


class FinalPrimitives(NamedTuple):
    """The units that are followed, one for each attribute.

    Attributes:
        columns: Columns of the attributes.
        units: First match of each in the last checkpoint.
        random: A unit drawn at random for each, to compare with.
        spread: Standard deviation of each attribute in the monitored episodes of the last checkpoint.
    """

    columns: tuple[int, ...]
    units: tuple[int, ...]
    random: tuple[int, ...]
    spread: tuple[float, ...]


@dataclass(frozen=True)
class CheckpointMeasurement:
    """What one checkpoint does. NaN stands for what could not be measured because the robot falls at once.

    Attributes:
        steps: Control steps of training.
        mean_return, success: Mean return, and share of the episodes that end without a failure.
        discrepancies: Discrepancy of each primitive and its attribute.
        mean_discrepancies: Mean over all units of the discrepancy with each attribute.
        effects: Largest mean effect of each primitive on its attribute, in size, in standard deviations of
            the attribute in the last checkpoint. A fall counts as none.
        random_effects: The same of a unit drawn at random.
    """

    steps: int
    mean_return: float
    success: float
    discrepancies: tuple[float, ...]
    mean_discrepancies: tuple[float, ...]
    effects: tuple[float, ...]
    random_effects: tuple[float, ...]


class CorrelationInterval(NamedTuple):
    """A rank correlation over checkpoints, and the ends of its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class LearningDynamics:
    """The course of one training run.

    Attributes:
        name: Name of its folder.
        robot: Name of the robot.
        attributes: Names of the attributes.
        units: The primitive of each, as ``layer:index``.
        checkpoints: What was measured, in the order of training.
    """

    name: str
    robot: str
    attributes: tuple[str, ...]
    units: tuple[str, ...]
    checkpoints: tuple[CheckpointMeasurement, ...]

    @property
    def steps(self) -> Floats:
        """Control steps of training at each checkpoint, shape (C,)."""
        return np.array([one.steps for one in self.checkpoints], np.float64)

    @property
    def returns(self) -> Floats:
        """Mean return of each checkpoint, shape (C,)."""
        return np.array([one.mean_return for one in self.checkpoints])

    @property
    def success(self) -> Floats:
        """Share of episodes of each checkpoint that end without a failure, shape (C,)."""
        return np.array([one.success for one in self.checkpoints])

    def normalized_discrepancies(self) -> Floats:
        """Return discrepancies from 0, the least of an attribute's course, to 1, shape (C, attributes)."""
        return _normalize(np.array([one.discrepancies for one in self.checkpoints]))

    def normalized_mean_discrepancies(self) -> Floats:
        """Return the same of the mean over all units, each normalized by its own course."""
        return _normalize(np.array([one.mean_discrepancies for one in self.checkpoints]))

    def effects(self, random: bool = False) -> Floats:
        """Return effects of the primitives, or of random units, shape (C, attributes)."""
        return np.array([one.random_effects if random else one.effects for one in self.checkpoints])

    def correlate_with_discrepancy(self, scores: Floats) -> CorrelationInterval:
        """Correlate the mean normalized discrepancy of each checkpoint with its score, shape (C,)."""
        return correlate_course(mean_known(self.normalized_discrepancies()), scores)

    def correlate_with_mean_discrepancy(self, scores: Floats) -> CorrelationInterval:
        """Correlate the same of all units with the scores."""
        return correlate_course(mean_known(self.normalized_mean_discrepancies()), scores)

    def correlate_with_effect(self, scores: Floats) -> CorrelationInterval:
        """Correlate the mean effect of the primitives of each checkpoint with its score, shape (C,)."""
        return correlate_course(mean_known(self.effects()), scores)


def _normalize(values: Floats) -> Floats:
    known = np.where(np.isfinite(values), values, np.nan)
    if not np.isfinite(known).any():
        return known
    low = np.nanmin(known, axis=0, initial=np.inf)
    high = np.nanmax(known, axis=0, initial=-np.inf)
    reach = high - low
    return np.asarray(np.divide(known - low, reach, out=np.full_like(known, np.nan), where=reach > 0))


def mean_known(values: Floats) -> Floats:
    """Return the mean of each row without NaN; NaN for a row of nothing else."""
    known = np.isfinite(values)
    count = known.sum(axis=1)
    total = np.where(known, values, 0.0).sum(axis=1)
    return np.asarray(np.divide(total, count, out=np.full(len(values), np.nan), where=count > 0))


def correlate_course(values: Floats, scores: Floats) -> CorrelationInterval:
    """Return Spearman's correlation over the checkpoints of one run, with a 95 % interval.

    Checkpoints beside each other are alike, so the interval is from a circular bootstrap of blocks of about
    the cube root of their number (Politis and Romano, 1992). NaN where a side does not vary.
    """
    known = np.isfinite(values) & np.isfinite(scores)
    values, scores = values[known], scores[known]
    own = rank_correlation(values, scores)
    if not np.isfinite(own):
        return CorrelationInterval(own, own, own)
    count = len(values)
    size = max(2, round(count ** (1 / 3)))
    begins = np.random.default_rng(0).integers(count, size=(_DRAWS, -(-count // size)))
    drawn = ((begins[:, :, None] + np.arange(size)) % count).reshape(_DRAWS, -1)[:, :count]
    ranks = [stats.rankdata(one[drawn], axis=1) for one in (values, scores)]
    first, second = (one - one.mean(axis=1, keepdims=True) for one in ranks)
    sizes = np.sqrt((first**2).sum(axis=1) * (second**2).sum(axis=1))
    found = (first * second).sum(axis=1)[sizes > 0] / sizes[sizes > 0]
    low, high = np.quantile(found, [0.025, 0.975]).tolist()
    return CorrelationInterval(own, low, high)


def list_checkpoints(folder: Path, every: int) -> list[Path]:
    """Return the checkpoints of a training run in the order of training: every n-th, and the last.

    Raises:
        StudyError: There are too few.
    """
    kept = sorted((folder / CHECKPOINT_FOLDER).glob("*.safetensors"))
    chosen = [path for number, path in enumerate(reversed(kept)) if number % every == 0][::-1]
    if len(chosen) < _FEWEST or not all(path.stem.isdecimal() for path in chosen):
        raise StudyError(
            f"{folder / CHECKPOINT_FOLDER}: expected at least {_FEWEST} checkpoints of "
            f"`pdtui train --checkpoints`, found {len(chosen)}"
        )
    return chosen
