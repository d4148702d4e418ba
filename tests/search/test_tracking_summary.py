from __future__ import annotations

import numpy as np
import pytest

from pdtui.search.gains.tracking_drives import STEPS_EACH, TrackingDriveJob, TrackingDriveResult
from pdtui.search.gains.tracking_summary import summarize_tracking


def _drive(seed: int, offset: float, swing: float) -> TrackingDriveResult:
    """A heading that swings about a value beside its target, five steps a stride."""
    stride = np.sin(2 * np.pi * np.arange(STEPS_EACH) / 5)
    errors = (offset + swing * stride)[None]
    return TrackingDriveResult(TrackingDriveJob("yaw", "hold", seed, (0.0,)), -errors, errors, (), None)


def test_the_bias_leaves_out_the_swing_of_the_gait_on_either_side_of_the_target() -> None:
    figures = summarize_tracking([_drive(100, 0.1, 0.5), _drive(101, -0.1, 0.5)], "rad")
    assert figures.bias == pytest.approx(0.1)
    assert figures.targets[0].bias == pytest.approx(0.1)
    assert figures.settled > 0.3


def test_without_a_swing_the_bias_is_the_settled_error() -> None:
    figures = summarize_tracking([_drive(100, 0.1, 0.0), _drive(101, -0.2, 0.0)], "rad")
    assert figures.bias == pytest.approx(figures.settled) == pytest.approx(0.15)
