"""Which keys to press next: of many schedules, the one that is expected to come farthest untouched."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.paper.forest.key_motion_model import KeyMotionModel, RobotMotion, predict_motion

HORIZON = 2.56
"""How far ahead is looked, s."""
_STEP = 0.08
_STEPS = round(HORIZON / _STEP)
_FIRST = (3, 6, 10, 16)
_SECOND = (5, 10, 18)
_HALF_BODY, _HALF_WIDTH = 0.2, 0.17
_UNSURE, _UNSURER = 0.1, 0.08
"""How far off a prediction is taken to be sideways: by so many m now, and by more each second. With the
paper's policy it is off by 0.1 m after 0.3 s and 0.44 m after 2 s, but keys on the way correct that."""
_HIT, _TOUCHING, _PRESS, _AWRY, _FALL = 8.0, 4.0, 0.25, 0.6, 6.0
_FOREST = 8.0
_AHEAD, _ASIDE = 12.0, 5.0


class KeyPlanner:
    """Chooses what to latch.

    Args:
        responses: of the choices; number 0 is the default.
        trees: x, y and radius, m, shape (N, 3).
    """

    def __init__(self, responses: Sequence[KeyMotionModel], trees: Floats) -> None:
        self._responses, self._trees = tuple(responses), trees
        self._schedules = _schedules(len(self._responses))
        self._presses = (np.diff(self._schedules, axis=1) != 0).sum(axis=1)

    def choose(self, place: RobotMotion, latched: int) -> int:
        """The choice to latch now; the one that is latched already if nothing is better by a press's worth.

        Args:
            place: of the robot, now.
            latched: the choice that is.
        """
        scores = self._scores(place, latched)
        return int(self._schedules[int(np.argmax(scores)), 0])

    def _scores(self, place: RobotMotion, latched: int) -> Floats:
        """Expected metres of progress, less what hits, presses and a wrong heading at the end are worth."""
        places, _ = predict_motion(self._responses, place, self._schedules, _STEP)
        touching, untouched = self._chances(places)
        falls = np.array([response.falls for response in self._responses])
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

    def _chances(self, places: Floats) -> tuple[Floats, Floats]:
        """Chance to touch a tree at each time, and not to have touched any up to it, shapes (C, T).

        A prediction's error is taken to be logistic, which is nearly normal and cheaper.
        """
        x, y = places[0, 0, :2]
        dx, dy = self._trees[:, 0] - x, self._trees[:, 1] - y
        near = self._trees[(dx > -1.0) & (dx < _AHEAD) & (np.abs(dy) < _ASIDE)]
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
    """One choice all along; or one for a while, another for a while, then the default or a third."""
    rows = [[choice] * _STEPS for choice in range(choices)]
    for first, second, third in product(range(choices), repeat=3):
        if first == second or third not in {0, 1, 2} or third == second:
            continue
        for one, two in product(_FIRST, _SECOND):
            rows.append(([first] * one + [second] * two + [third] * _STEPS)[:_STEPS])
    return np.unique(np.array(rows), axis=0)
