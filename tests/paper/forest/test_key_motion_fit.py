"""What keys do is found again from drives of a robot that does just that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pdtui.core.errors import RobotError
from pdtui.core.outcome import Outcome
from pdtui.paper.forest.key_motion_fit import fit_key_motion_models
from pdtui.paper.forest.key_motion_model import (
    KeyMotionModel,
    ObservedDrive,
    RobotMotion,
    estimate_motion,
    predict_motion,
)

DT = 0.016
KEY_MODELS = {
    "default": KeyMotionModel(0.1, 1.4, 0.1, 2.5, 0.9, -0.1, 0.2, 0.0),
    "left": KeyMotionModel(1.5, 0.8, 0.3, 1.0, 0.8, -0.3, 0.4, 0.0),
    "right": KeyMotionModel(-0.9, 1.2, 0.2, 1.5, 1.1, 0.2, 0.3, 0.0),
}
NAMES = list(KEY_MODELS)


def _drive(rng: np.random.Generator) -> ObservedDrive:
    held = rng.integers(20, 80, 15)
    choices = np.repeat(np.arange(15) % 3, held)
    there, _ = predict_motion(list(KEY_MODELS.values()), RobotMotion(0, 0, 0, 1.0), choices[None], DT)
    return ObservedDrive(np.vstack([[0.0, 0.0, 0.0], there[0]]), choices, None)


def test_responses_are_found_again_and_predict_another_drive() -> None:
    rng = np.random.default_rng(0)
    found = fit_key_motion_models([_drive(rng) for _ in range(4)], NAMES, DT)
    for name, response in KEY_MODELS.items():
        assert found[name].pull == pytest.approx(response.pull, abs=0.15)
        assert found[name].lag == pytest.approx(response.lag, abs=0.1)
        assert found[name].drive / found[name].drag == pytest.approx(response.drive / response.drag, rel=0.05)
        assert found[name].slip == pytest.approx(response.slip, abs=0.05)
        assert found[name].falls == 0.0
    other = _drive(rng)
    errors = []
    for first in range(30, len(other.choices) - 63, 10):
        start = estimate_motion(other.places[: first + 1], DT)
        there, _ = predict_motion(list(found.values()), start, other.choices[None, first : first + 63], DT)
        errors.append(np.hypot(*(there[0, -1, :2] - other.places[first + 63, :2])))
    assert np.mean(errors) < 0.1  # m, after a second of about 2 m


def test_falls_count_for_each_press_of_what_was_latched() -> None:
    rng = np.random.default_rng(1)
    drives = [_drive(rng), replace(_drive(rng), outcome=Outcome.FELL)]
    found = fit_key_motion_models(drives, NAMES, DT)
    assert [found[name].falls for name in NAMES] == pytest.approx([0.0, 0.0, 0.1])


def test_a_choice_that_was_hardly_seen_is_named() -> None:
    rng = np.random.default_rng(2)
    with pytest.raises(
        RobotError, match="'never': expected at least 8 stretches of 1.2 s with this key, found 0"
    ):
        fit_key_motion_models([_drive(rng)], [*NAMES, "never"], DT)
