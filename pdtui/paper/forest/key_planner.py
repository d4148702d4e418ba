"""Choice of the next key: of many key schedules, the one that should get farthest without a collision."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.paper.forest.key_motion_model import KeyMotionModel, RobotMotion, predict_motion

HORIZON = 2.56
"""Time that is planned ahead, s."""
_STEP = 0.08
_STEPS = round(HORIZON / _STEP)
_FIRST = (3, 6, 10, 16)
_SECOND = (5, 10, 18)
_HALF_BODY, _HALF_WIDTH = 0.2, 0.17
_UNSURE, _UNSURER = 0.1, 0.08
"""Sideways error assumed of a prediction: m now, and m more per second. With the paper's policy the error is
0.1 m after 0.3 s and 0.44 m after 2 s, but later keys correct some of it."""
_HIT, _TOUCHING, _PRESS, _AWRY, _FALL = 8.0, 4.0, 0.25, 0.6, 6.0
"""Costs in m of progress: a hit, contact all the time, a press, 1 rad of heading at the end, a fall."""
_FOREST = 8.0
"""Half the width of the forest, m."""
_BEHIND = 1.0
"""Distance behind the robot from which a tree no longer counts, m."""


class KeyPlanner:
    """Chooses the key to latch; index 0 is the default key."""

    def __init__(self, key_models: Sequence[KeyMotionModel]) -> None:
        self._key_models = tuple(key_models)
        self._schedules = _schedules(len(self._key_models))
        self._presses = (np.diff(self._schedules, axis=1) != 0).sum(axis=1)

    def choose(self, place: RobotMotion, trees: Floats, latched: int) -> int:
        """Return the index of the key to latch; the latched one unless another is worth a press.

        The trees in sight are x, y and radius in m, shape (N, 3).
        """
        scores = self._scores(place, trees, latched)
        return int(self._schedules[int(np.argmax(scores)), 0])

    def _scores(self, place: RobotMotion, trees: Floats, latched: int) -> Floats:
        """Return the expected progress in m minus the costs of hits, presses and a wrong final heading."""
        places, _ = predict_motion(self._key_models, place, self._schedules, _STEP)
        touching, untouched = self._touch_probabilities(places, trees)
        falls = np.array([model.falls for model in self._key_models])
        starts = self._schedules[:, 0]
        pressed = starts != latched
        gained = np.diff(places[:, :, 0], axis=1, prepend=place.x)
        outside = np.maximum(0.0, np.abs(places[:, :, 1]).max(axis=1) - _FOREST)
        scores: Floats = (
            (gained * untouched).sum(axis=1)
            - _HIT * (1.0 - untouched[:, -1])
            - _TOUCHING * touching.mean(axis=1)
            - _PRESS * (self._presses + pressed)
            - _AWRY * np.abs(places[:, -1, 2])
            - _FALL * falls[starts] * pressed
            - _HIT * outside
        )
        return scores

    @staticmethod
    def _touch_probabilities(places: Floats, trees: Floats) -> tuple[Floats, Floats]:
        """Return the probabilities of touching a tree at each time, and of no touch up to it, shapes (C, T).

        The prediction error is assumed to be logistic, which is nearly normal and cheaper.
        """
        near = trees[trees[:, 0] > places[0, 0, 0] - _BEHIND]
        cos, sin = np.cos(places[:, :, 2]), np.sin(places[:, :, 2])
        unsure = (_UNSURE + _UNSURER * _STEP * np.arange(1, _STEPS + 1)) / 1.7
        touching, untouched = np.zeros(cos.shape), np.ones(cos.shape)
        for tree in near:
            to_x, to_y = tree[0] - places[:, :, 0], tree[1] - places[:, :, 1]
            along = np.maximum(np.abs(cos * to_x + sin * to_y) - _HALF_BODY, 0.0)
            across = cos * to_y - sin * to_x
            clear = np.sqrt(along * along + across * across) - tree[2] - _HALF_WIDTH
            chance = 1.0 / (1.0 + np.exp(np.minimum(clear / unsure, 50.0)))
            touching = np.maximum(touching, chance)
            untouched *= 1.0 - np.maximum.accumulate(chance, axis=1)
        return touching, untouched


def _schedules(choices: int) -> NDArray[np.int64]:
    """Return schedules of one key throughout, and of up to three keys in turn."""
    rows = [[choice] * _STEPS for choice in range(choices)]
    for first, second, third in product(range(choices), repeat=3):
        if first == second or third not in {0, 1, 2} or third == second:
            continue
        for one, two in product(_FIRST, _SECOND):
            rows.append(([first] * one + [second] * two + [third] * _STEPS)[:_STEPS])
    return np.unique(np.array(rows), axis=0)
