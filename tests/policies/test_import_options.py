"""Choices and spaces, as commands, maps and worlds state them."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium import spaces

from pdtui.core.errors import PolicyError
from pdtui.policies.weights.import_options import ACTIVATION_NAMES, ImportOptions, ObservationActionSpaces
from pdtui.policies.weights.policy_network import ACTIVATIONS


def test_every_activation_can_be_chosen() -> None:
    assert set(ACTIVATION_NAMES) == set(ACTIVATIONS)


def test_a_choice_is_one_of_the_known() -> None:
    with pytest.raises(PolicyError, match="unknown activation 'sine'; available: tanh, relu"):
        ImportOptions("sine")
    with pytest.raises(PolicyError, match="unknown squash 'hard'; available: none, tanh, clip"):
        ImportOptions(squash="hard")
    assert ImportOptions("elu").or_else(ImportOptions("tanh", "clip")) == ImportOptions("elu", "clip")


def test_spaces_are_read_from_gymnasium_s() -> None:
    seen = spaces.Box(-np.inf, np.inf, (2, 3))
    bounded = ObservationActionSpaces.of(
        "w", seen, spaces.Box(np.array([-1, -2], np.float32), np.array([3, 4], np.float32))
    )
    assert bounded == ObservationActionSpaces("w", 6, 2, (-1.0, -2.0), (3.0, 4.0), shape=(2, 3))
    assert ObservationActionSpaces.of(
        "w", seen, spaces.Box(-np.inf, np.inf, (2,))
    ) == ObservationActionSpaces("w", 6, 2, shape=(2, 3))
    assert ObservationActionSpaces.of("w", seen, spaces.Discrete(4)) == ObservationActionSpaces(
        "w", 6, 1, discrete_actions=4, shape=(2, 3)
    )
    with pytest.raises(PolicyError, match="expected observations of one shape"):
        ObservationActionSpaces.of("w", spaces.Dict(a=seen), spaces.Discrete(4))
    with pytest.raises(
        PolicyError,
        match=r"p: expected observations of shape \(6,\) and 4 discrete actions, as w has; the policy has "
        r"observations of shape \(6,\) and actions of shape \(4,\)",
    ):
        ObservationActionSpaces.of("w", seen, spaces.Discrete(4)).check("p", 6, 4, 0)
