"""The method's view of a drive while it runs: spectrograms of a unit and an attribute, and ranked units."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from pdtui.core.attributes import Attribute, unwrap_angles
from pdtui.core.closable import Closable
from pdtui.core.step_record import StepRecord
from pdtui.driving.live_spectra.spectra_snapshot import RankedUnit, SpectraChoice, SpectraSnapshot
from pdtui.driving.timeline.past_steps import PastSteps
from pdtui.spectra.episode_monitor import MonitoredEpisode
from pdtui.spectra.matching import measure_discrepancies
from pdtui.spectra.matching_presets import PRESETS, MatchingPreset
from pdtui.spectra.spectrogram import scaled_attribute_series, short_time_transform, spectrogram

WINDOWS = 12
"""Windows that are shown: of the paper's preset, 240 control steps."""
RANKED = 20


class LiveSpectra(Closable):
    """Computes spectrograms of the last windows, in a thread beside the drive, while they are asked for.

    They are computed anew when the drive has gone on by the hop of a window, or another moment, unit or
    attribute is shown. The run is only read.

    Args:
        attributes: those of the robot.
        dt: duration of a control step, s.
    """

    def __init__(self, attributes: Sequence[Attribute], dt: float) -> None:
        self._attributes, self._dt, self._preset = attributes, dt, PRESETS["paper"]
        self._choice: SpectraChoice | None = None
        self._pool: ThreadPoolExecutor | None = None
        self._work: Future[SpectraSnapshot] | None = None
        self._latest: SpectraSnapshot | None = None
        self._asked: tuple[SpectraChoice, int] | None = None

    def choose(self, choice: SpectraChoice | None) -> None:
        """Compute spectrograms of what is chosen, or none."""
        self._choice = choice
        if choice is None:
            self.close()

    def update(self, past: PastSteps, moment: int) -> SpectraSnapshot | None:
        """Return the latest spectrograms up to a moment, and have those that are due computed."""
        if self._choice is None:
            return None
        if self._work is not None and self._work.done():
            failed = self._work.exception()
            self._latest = SpectraSnapshot(self._choice, str(failed)) if failed else self._work.result()
            self._work = None
        preset, wanted = self._preset, (self._choice, moment // self._preset.hop)
        if wanted != self._asked and self._work is None:
            self._asked = wanted
            stretch = past.latest_stretch(moment, preset.length + (WINDOWS - 1) * preset.hop)
            self._pool = self._pool or ThreadPoolExecutor(1, "pdtui spectra")
            self._work = self._pool.submit(
                compute_spectra, stretch, self._attributes, self._choice, preset, self._dt
            )
        return self._latest or SpectraSnapshot(self._choice, "computing the spectrograms")

    def close(self) -> None:
        """Stop computing."""
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
        self._pool = self._work = self._latest = self._asked = None


def compute_spectra(
    stretch: Sequence[StepRecord],
    attributes: Sequence[Attribute],
    choice: SpectraChoice,
    preset: MatchingPreset,
    dt: float,
) -> SpectraSnapshot:
    """Return the spectrograms of an attribute and a unit over consecutive control steps of an episode.

    The windows end with the last step. Discrepancies are those of section 3.2 over these windows.
    """
    if len(stretch) < preset.length:
        found = f"a window needs {preset.length} control steps without a jump, here are {len(stretch)}"
        return SpectraSnapshot(choice, found)
    steps = len(stretch) - (len(stretch) - preset.length) % preset.hop
    records = stretch[-steps:]
    values = unwrap_angles(np.array([record.attributes for record in records]), attributes)
    column = choice.attribute
    attribute = attributes[column]
    activations = np.array([record.activations for record in records])
    episode = MonitoredEpisode(0, activations, values[:, [column]])
    discrepancies = measure_discrepancies(episode, [attribute], preset)[0]
    finite = np.flatnonzero(np.isfinite(discrepancies))
    order = finite[np.argsort(discrepancies[finite], kind="stable")][:RANKED].tolist()
    unit = choice.unit if choice.unit >= 0 or not order else order[0]
    powers = [
        spectrogram(short_time_transform(series, preset), preset)[0]
        for series in (
            scaled_attribute_series([episode], [attribute], preset)[0],
            activations[:, [max(unit, 0)]],
        )
    ]
    return SpectraSnapshot(
        choice,
        moment=records[-1].step + 1,
        steps=steps,
        unit=unit,
        frequencies=preset.frequencies(dt),
        attribute_power=powers[0],
        unit_power=powers[1],
        ranking=tuple(RankedUnit(one, float(discrepancies[one])) for one in order),
        discrepancy=float(discrepancies[unit]) if unit >= 0 else float("nan"),
    )
