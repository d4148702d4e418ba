"""The figures of a gait, from which feet touch the ground and where their soles are at each control step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats

Contacts = NDArray[np.bool_]
"""Whether each foot touches the ground at each control step, shape (T, F)."""


@dataclass(frozen=True)
class FootMetrics:
    """How one foot walks.

    Attributes:
        touchdown_rate: Touchdowns per second.
        duty_factor: Share of the time in which the foot touches the ground.
        clearance: Largest height of the sole in a swing above its mean height in the stance before, mean over
            swings, m; NaN without a whole swing.
        slip: Mean speed at which the sole slides while the foot touches the ground, m/s, over control steps
            that begin and end with contact; NaN without one.
    """

    touchdown_rate: float
    duty_factor: float
    clearance: float
    slip: float


def undo_contact_delays(reported: Contacts, delays: Sequence[int]) -> Contacts:
    """Return the contacts at each control step, shape (T − longest delay, F).

    Args:
        reported: The contacts that were reported at each control step, shape (T, F).
        delays: By how many control steps those of each foot are late.
    """
    steps = len(reported) - max(delays)
    columns = [reported[delay : delay + steps, foot] for foot, delay in enumerate(delays)]
    return np.stack(columns, axis=1)


def find_touchdowns(contacts: Contacts) -> Contacts:
    """Return the control steps at which each foot touches down, shape (T, F); the first has none."""
    touchdowns = np.zeros_like(contacts)
    touchdowns[1:] = contacts[1:] & ~contacts[:-1]
    return touchdowns


def compute_foot_metrics(
    contact: NDArray[np.bool_], height: Floats, sole_speed: Floats, dt: float
) -> FootMetrics:
    """Return the figures of one foot.

    Args:
        contact: Whether it touches the ground at each control step, shape (T,).
        height: Height of its sole, m, shape (T,).
        sole_speed: How fast its sole moves along the ground between steps, m/s, shape (T − 1,).
        dt: Duration of a control step, s.
    """
    stands = contact[1:] & contact[:-1]
    clearances = measure_clearances(contact, height)
    return FootMetrics(
        float(find_touchdowns(contact[:, None]).sum() / ((len(contact) - 1) * dt)),
        float(contact.mean()),
        float(clearances.mean()) if len(clearances) else float("nan"),
        float(sole_speed[stands].mean()) if stands.any() else float("nan"),
    )


def measure_clearances(contact: NDArray[np.bool_], height: Floats) -> Floats:
    """Return the clearance in each swing that begins and ends in the walk, m, shape (swings,).

    The ground under the foot is taken to be where it stood just before, so that it may be uneven.
    """
    changes = np.flatnonzero(np.diff(contact.astype(np.int8))) + 1
    runs = np.split(np.arange(len(contact)), changes)
    found = [
        float(height[swing].max() - height[stance].mean())
        for stance, swing, landing in zip(runs, runs[1:], runs[2:], strict=False)
        if contact[landing[0]]
    ]
    return np.array(found)


def time_share_by_feet_down(contacts: Contacts) -> Floats:
    """Return the share of the time on 0, 1, … and all F feet, shape (F + 1,)."""
    feet = contacts.shape[1]
    shares: Floats = np.bincount(contacts.sum(axis=1), minlength=feet + 1) / len(contacts)
    return shares


def measure_alternation(contacts: Contacts) -> float:
    """Return the share of touchdowns of two feet whose previous touchdown was of the other foot.

    Feet that touch down in the same control step do not alternate. NaN for fewer than two touchdowns.
    """
    touchdowns = find_touchdowns(contacts)
    events = touchdowns[touchdowns.any(axis=1)]
    if len(events) < 2:
        return float("nan")
    single = events.sum(axis=1) == 1
    changes = (events[1:] != events[:-1]).any(axis=1)
    return float((single[1:] & single[:-1] & changes).mean())


def measure_walking_speed(places: Floats, dt: float) -> float:
    """Return the mean distance covered in a second, m/s, so that swaying does not count.

    Args:
        places: Where the robot is at each control step, x and y in m, shape (T, 2).
        dt: Duration of a control step, s.
    """
    second = min(max(1, round(1.0 / dt)), len(places) - 1)
    moved = places[second:] - places[:-second]
    return float(np.hypot(moved[:, 0], moved[:, 1]).mean() / (second * dt))


def measure_tilt(quaternions: Floats) -> float:
    """Return the mean angle between a body's own vertical and that of the world, rad.

    Args:
        quaternions: Its orientations w x y z, shape (T, 4).
    """
    _, x, y, _ = quaternions.T
    return float(np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0)).mean())
