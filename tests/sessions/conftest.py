"""What the tests of this room share."""

from __future__ import annotations

from pathlib import Path

import pytest

from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from tests.sessions.recorded_drives import random_weights, record_drive

Recorded = tuple[Path, ControlLoop, list[StepRecord]]


@pytest.fixture(scope="session")
def weights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small random policy."""
    return random_weights(tmp_path_factory.mktemp("policy") / "small.safetensors")


@pytest.fixture(scope="session")
def recorded(weights: Path, tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """A finished session of 100 steps, and what was put into it."""
    path = tmp_path_factory.mktemp("sessions") / "ant.rrd"
    loop, records = record_drive(path, weights)
    return path, loop, records
