"""What `pdtui evaluate` runs, with the reasons for each number, and the times of one run."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

BIN_SECONDS = 0.25
"""Time over which attributes are averaged before anything else is done with them, s: an onset is no finer."""


class RandomPurpose(IntEnum):
    """What random numbers of a seed are for: each purpose has a stream of its own."""

    PRESS = 1
    PUSHES = 2
    SENSOR_NOISE = 3
    START = 4
    RANDOM_UNITS = 5
    RANDOM_DIRECTION = 6
    PLACEBO_KEYS = 7
    OPERATOR_JUDGMENT = 8


def purpose_generator(purpose: RandomPurpose, *key: int) -> np.random.Generator:
    """Return the generator for one purpose of a seed, or of another key."""
    return np.random.default_rng((int(purpose), *key))


@dataclass(frozen=True)
class ProtocolSettings:
    """The sizes of an evaluation.

    Attributes:
        first_press, presses: The press comes before a control step drawn for each seed from `presses` steps,
            `first_press` being the first. By then the robot walks steadily, and 100 steps hold a whole stride
            of every shipped robot, so the press meets the whole gait. (Pressed at a step that was chosen, a
            behavior can succeed on 12 of 12 seeds, at another on none.)
        hold_steps, hold_seconds: A behavior is held for as many control steps, and at least for as long: the
            Ant's spin ends after 500 to 900 steps, so that shorter runs cannot tell it from one that lasts.
        window_seconds: Length of the first and of the last window of the hold, and time to recover after the
            release, s: it averages over several strides.
        draws: Number of random sets of units, and of random directions: if no one of 24 does as well, at most
            one in seven does (the 95 % interval of 0 of 24 ends at 0.14).
        draw_seeds: Number of seeds on which each draw is run.
        condition_seeds: Number of seeds on which each disturbed condition is run; 0 for the robot's own world
            alone. With 12, the least p-value is 1/2048, which is enough for a table of 100 rows.
        level: Level of the corrected tests.
    """

    first_press: int = 100
    presses: int = 100
    hold_steps: int = 1000
    hold_seconds: float = 10.0
    window_seconds: float = 5.0
    draws: int = 24
    draw_seeds: int = 4
    condition_seeds: int = 12
    level: float = 0.05


QUICK_SEEDS = 6
"""Number of seeds of a quick evaluation, the first ones."""
QUICK_PROTOCOL = ProtocolSettings(draws=4, draw_seeds=2, condition_seeds=3)
"""A look rather than a judgment: with 6 seeds, no p-value is below 1/32."""


def choose_protocol(*, quick: bool, hold: int | None, controls: bool = True) -> ProtocolSettings:
    """Return the full or the quick protocol, held for as many control steps if it says so.

    Without controls, neither substitutes nor disturbed worlds are run.
    """
    settings = QUICK_PROTOCOL if quick else ProtocolSettings()
    if not controls:
        settings = replace(settings, draws=0, condition_seeds=0)
    return settings if hold is None else replace(settings, hold_steps=hold)


@dataclass(frozen=True)
class RunTimes:
    """The times of one run in control steps.

    Attributes:
        press: The behavior is pressed before this step.
        held: Steps from the press to the release, or to the end of the period.
        after: Steps after that.
        window: Steps of the first and the last window.
        bin: Steps that are averaged.
        dt: Duration of a control step, s.
    """

    press: int
    held: int
    after: int
    window: int
    bin: int
    dt: float

    @property
    def steps(self) -> int:
        """All control steps of the run."""
        return self.press + self.held + self.after

    @property
    def first_bins(self) -> slice:
        """The bins of the first window."""
        return slice(0, min(self.window, self.held) // self.bin)

    @property
    def last_bins(self) -> slice:
        """The bins of the last window before the release."""
        return slice(max(0, self.held - self.window) // self.bin, self.held // self.bin)

    @property
    def held_bins(self) -> int:
        """The number of bins of the hold."""
        return self.held // self.bin

    @property
    def bins(self) -> int:
        """The number of bins from the press on."""
        return (self.held + self.after) // self.bin

    @property
    def bin_seconds(self) -> float:
        """Duration of a bin, s."""
        return self.bin * self.dt


def plan_run_times(settings: ProtocolSettings, seed: int, dt: float, period: float | None = None) -> RunTimes:
    """Return the times of a run: held for the whole hold, or for the period and followed for as long.

    All times but the press are multiples of a bin.

    Args:
        settings: The sizes of the evaluation.
        seed: The seed of the run.
        dt: Duration of a control step, s.
        period: Activation period of the behavior, s; None if it lasts until it is released.
    """
    size = max(1, round(BIN_SECONDS / dt))
    window = _round_up(settings.window_seconds / dt, size)
    whole = max(_round_up(max(settings.hold_steps, settings.hold_seconds / dt), size), 2 * window)
    drawn = purpose_generator(RandomPurpose.PRESS, seed).integers(settings.presses)
    press = settings.first_press + int(drawn)
    if period is None:
        return RunTimes(press, whole, window, window, size, dt)
    return RunTimes(press, _round_up(period / dt, size), whole, window, size, dt)


def _round_up(steps: float, size: int) -> int:
    return math.ceil(steps / size - 1e-9) * size
