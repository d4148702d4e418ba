"""What interventions of a map do to hidden units, against their formulas written out with NumPy."""

from __future__ import annotations

import base64

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from torch import nn

from pdtui.core.errors import MapError, PolicyError, RobotError
from pdtui.core.units import Stimulation
from pdtui.policies.runtime.policy import Policy, PolicyStep
from pdtui.robots import make_robot
from pdtui.robots.observation_edits.observation_edit import offset_observed_number, set_observed_number
from pdtui.stimulation.behavior_latch import BehaviorLatch
from pdtui.stimulation.map_reader import parse_map
from pdtui.stimulation.map_writer import compose_map
from tests.stimulation.interventions.walker_map import MAP_HEAD

Array = NDArray[np.floating]

ATTRIBUTES = make_robot("walker").attributes
AT_REST = np.zeros(len(ATTRIBUTES))
EDITS = (
    set_observed_number(0, "first", "m", "the first number has this value", scale=2.0),
    offset_observed_number(1, "second", "m", "the second number is larger by this much"),
)
WIDTH, INPUTS = 8, 5


class _Named(nn.Module):
    """The same network, but not a chain that has a fast pass."""

    def __init__(self, layers: nn.Sequential) -> None:
        super().__init__()
        self.first, self.second, self.third = layers[0], layers[2], layers[4]
        self.a, self.b = nn.Tanh(), nn.Tanh()

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        hidden: torch.Tensor = self.third(self.b(self.second(self.a(self.first(x)))))
        return hidden


@pytest.fixture(params=["fast pass", "hooks"])
def network(request: pytest.FixtureRequest) -> Policy:
    torch.manual_seed(0)
    layers = nn.Sequential(
        nn.Linear(INPUTS, WIDTH), nn.Tanh(), nn.Linear(WIDTH, WIDTH), nn.Tanh(), nn.Linear(WIDTH, 2)
    )
    return Policy(layers if request.param == "fast pass" else _Named(layers), INPUTS)


def _act(network: Policy, behavior: str, top: str = "", factor: float = 1.0) -> tuple[PolicyStep, Array]:
    """Latch the behavior, act once, and return the step and what the units put out without it."""
    text = f"""{MAP_HEAD}{top}
[[behaviors]]
name = "it"
key = "a"
{behavior}
"""
    latch = BehaviorLatch(parse_map(text, "m"), network.layers, ATTRIBUTES, 0.1, EDITS)
    latch.latch_behavior("it", AT_REST)
    latch.set_factor("it", factor)
    observation = np.linspace(-1.0, 1.0, INPUTS)
    natural = network.act(observation).activations
    return network.act(observation, latch.stimulate(AT_REST)), natural


def _vectors(name: str, rows: Array, layer: str = "0") -> str:
    data = base64.b64encode(rows.astype("<f4").tobytes()).decode()
    return f'[[vectors]]\nname = "{name}"\nlayer = "{layer}"\ncount = {len(rows)}\ndata = "{data}"\n'


def test_add_scale_and_clamp_change_units_by_their_formulas(network: Policy) -> None:
    acted, natural = _act(
        network,
        """
[[behaviors.interventions]]
kind = "add"
values = {"0:1" = 0.5}
[[behaviors.interventions]]
kind = "scale"
values = {"0:2" = -3.0, "1:4" = 0.0}
[[behaviors.interventions]]
kind = "clamp"
ranges = {"0:3" = [0.9, 1.0], "0:4" = [-9.0, 9.0]}
""",
        factor=0.5,
    )
    expected = natural.copy()
    expected[1] += 0.25
    expected[2] *= 1.0 + 0.5 * (-3.0 - 1.0)
    expected[3] = np.clip(natural[3], 0.9, 1.0)
    np.testing.assert_allclose(acted.activations[:WIDTH], expected[:WIDTH], rtol=1e-5)
    weights = network.module.second if isinstance(network.module, _Named) else network.module[2]  # type: ignore[index]
    with torch.inference_mode():
        second = np.tanh(weights(torch.from_numpy(acted.activations[:WIDTH])).numpy())
    second[4] *= 0.5
    np.testing.assert_allclose(acted.activations[WIDTH:], second, rtol=1e-4, atol=1e-6)


def test_a_step_reports_what_it_came_to(network: Policy) -> None:
    acted, natural = _act(
        network,
        """
magnitudes = {"0:0" = 2.0}
[[behaviors.interventions]]
kind = "add"
values = {"0:0" = 1.0, "0:5" = 1.0}
""",
    )
    assert acted.stimulation.units == (0, 5)
    np.testing.assert_allclose(acted.stimulation.values, [3.0, natural[5] + 1.0], rtol=1e-6)
    np.testing.assert_allclose(acted.natural, natural[[0, 5]], rtol=1e-6)
    again = network.act(np.linspace(-1.0, 1.0, INPUTS), acted.stimulation)
    np.testing.assert_array_equal(again.activations, acted.activations)
    np.testing.assert_array_equal(again.action, acted.action)


def test_a_direction_sets_or_adds_coordinates(network: Policy) -> None:
    rows = np.linalg.qr(np.random.default_rng(1).normal(size=(WIDTH, 2)))[0].T
    table = '[[behaviors.interventions]]\nkind = "direction"\nvectors = "u"\ncoordinates = [0.4, -0.2]\n'
    acted, natural = _act(network, table + "sets_coordinates = true", _vectors("u", rows))
    h = natural[:WIDTH]
    np.testing.assert_allclose(rows @ acted.activations[:WIDTH], [0.4, -0.2], atol=1e-5)
    expected = h + rows.T @ (np.array([0.4, -0.2]) - rows @ h)
    np.testing.assert_allclose(acted.activations[:WIDTH], expected, atol=1e-5)
    added, _ = _act(network, table, _vectors("u", rows), factor=2.0)
    np.testing.assert_allclose(added.activations[:WIDTH], h + rows.T @ [0.8, -0.4], atol=1e-5)


def test_an_affine_edit_reads_and_writes_vectors(network: Policy) -> None:
    rng = np.random.default_rng(2)
    write, read, bias = rng.normal(size=(2, WIDTH)), rng.normal(size=(2, WIDTH)), rng.normal(size=(1, WIDTH))
    acted, natural = _act(
        network,
        '[[behaviors.interventions]]\nkind = "affine"\nvectors = "w"\nreadout = "v"\nbias = "b"',
        _vectors("w", write) + _vectors("v", read) + _vectors("b", bias),
        factor=0.1,
    )
    h = natural[:WIDTH]
    expected = h + 0.1 * (write.T @ (read @ h) + bias[0])
    np.testing.assert_allclose(acted.activations[:WIDTH], expected, rtol=1e-4, atol=1e-5)


def test_an_imprint_shows_units_an_edited_observation(network: Policy) -> None:
    acted, natural = _act(
        network,
        """
[[behaviors.interventions]]
kind = "imprint"
units = ["0:3", "1:*"]
base = {first = 0.25}
values = {second = 1.5}
""",
        factor=2.0,
    )
    edited = np.linspace(-1.0, 1.0, INPUTS)
    edited[0], edited[1] = 0.5, edited[1] + 3.0
    shown = network.act(edited).activations
    expected = natural[:WIDTH].copy()
    expected[3] = shown[3]
    np.testing.assert_allclose(acted.activations[:WIDTH], expected, rtol=1e-6)
    np.testing.assert_array_equal(acted.activations[WIDTH:], shown[WIDTH:])
    assert acted.stimulation.units == (3, *range(WIDTH, 2 * WIDTH))


def test_an_imprint_of_every_unit_is_the_edited_observation(network: Policy) -> None:
    acted, _ = _act(
        network, '[[behaviors.interventions]]\nkind = "imprint"\nunits = ["0:*"]\nvalues = {second = 0.7}'
    )
    edited = np.linspace(-1.0, 1.0, INPUTS)
    edited[1] += 0.7
    np.testing.assert_array_equal(acted.action, network.act(edited).action)


def test_a_recurrent_state_does_not_notice_an_imprint() -> None:
    class Recurrent(nn.Module):
        def __init__(self) -> None:
            super().__init__()
            torch.manual_seed(1)
            self.cell, self.head = nn.GRUCell(INPUTS, WIDTH), nn.Linear(WIDTH, 2)

        def forward(self, x: torch.Tensor, state: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
            state = self.cell(x, state)
            return self.head(state), state

    policy = Policy(Recurrent(), INPUTS, initial_state=torch.zeros(WIDTH))
    alone = Policy(Recurrent(), INPUTS, initial_state=torch.zeros(WIDTH))
    text = '[[behaviors.interventions]]\nkind = "imprint"\nunits = ["0:1"]\nvalues = {second = 0.7}'
    _act(policy, text)
    for _ in range(2):
        alone.act(np.linspace(-1.0, 1.0, INPUTS))
    for here, there in zip(policy.snapshot(), alone.snapshot(), strict=True):
        np.testing.assert_array_equal(here, there)


def test_what_is_latched_later_decides(network: Policy) -> None:
    text = (
        MAP_HEAD
        + """
[[behaviors]]
name = "adds"
key = "a"
together = ["sets"]
[[behaviors.interventions]]
kind = "add"
values = {"0:1" = 5.0}
[[behaviors]]
name = "sets"
key = "b"
magnitudes = {"0:1" = 1.0}
"""
    )
    observation = np.linspace(-1.0, 1.0, INPUTS)
    for order, expected in ((("adds", "sets"), 1.0), (("sets", "adds"), 6.0)):
        latch = BehaviorLatch(parse_map(text, "m"), network.layers, ATTRIBUTES, 0.1)
        for name in order:
            latch.latch_behavior(name, AT_REST)
        acted = network.act(observation, latch.stimulate(AT_REST))
        assert acted.activations[1] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("behavior", "kind", "says"),
    [
        ('kind = "imprint"\nunits = ["0:1"]\nvalues = {wind = 1.0}', MapError, "no edit 'wind'.*first, sec"),
        ('kind = "add"\nvalues = {"0:99" = 1.0}', PolicyError, "unit 0:99 does not exist"),
        ('kind = "add"\nvalues = {}', MapError, "at least one unit"),
        ('kind = "multiply"', MapError, "expected one of overwrite, add"),
        ('kind = "direction"\nvectors = "u"\ncoordinates = [1.0]', MapError, "no vectors 'u'"),
        ('kind = "clamp"\nranges = {"0:1" = [2.0, 1.0]}', MapError, "a low and a high end"),
        (
            'kind = "add"\nvalues = {"0:1" = 1.0}\nrange_gate = {attribute = "mood", low = 0, high = 1}',
            RobotError,
            "mood",
        ),
    ],
)
def test_errors_name_what_is_wrong(network: Policy, behavior: str, kind: type, says: str) -> None:
    with pytest.raises(kind, match=says):
        _act(network, f"[[behaviors.interventions]]\n{behavior}")


def test_vectors_of_another_layers_width_are_refused(network: Policy) -> None:
    table = '[[behaviors.interventions]]\nkind = "direction"\nvectors = "u"\ncoordinates = [1.0]'
    with pytest.raises(PolicyError, match="expected the 8 numbers of layer 0, found 3"):
        _act(network, table, _vectors("u", np.ones((1, 3))))
    with pytest.raises(MapError, match="orthonormal"):
        _act(network, table + "\nsets_coordinates = true", _vectors("u", np.ones((1, WIDTH))))


def test_a_map_with_interventions_is_written_as_it_is_read() -> None:
    rows = np.linalg.qr(np.random.default_rng(1).normal(size=(WIDTH, 2)))[0].T
    text = f"""{MAP_HEAD}{_vectors("u", rows)}
[[behaviors]]
name = "it"
key = "a"
onset = {{signal = "height", crosses = "down", level = 1.2, delay = 0.3}}
fade = 1.5
[[behaviors.interventions]]
kind = "direction"
vectors = "u"
coordinates = [0.5, 1.0]
sets_coordinates = true
time_gate = {{times = [0.0, 1.0], factors = [1.0, 0.0], repeat = 2.0, interpolate = true}}
[[behaviors.interventions]]
kind = "imprint"
units = ["0:1", "1:*"]
base = {{"height offset" = 0.1}}
rates = {{"pitch offset" = 0.2}}
phase_gate = {{signal = "0:3", factors = [1.0, 0.0, 0.5]}}
[[behaviors.interventions]]
kind = "clamp"
ranges = {{"0:1" = [0.0, 1.0]}}
range_gate = {{attribute = "height", low = 1.0, high = 2.0}}
"""
    first = parse_map(text, "m")
    second = parse_map(compose_map(first), "m")
    assert second.behaviors == first.behaviors
    np.testing.assert_array_equal(second.vectors["u"].rows, rows.astype(np.float32))


def test_a_stimulation_without_edits_is_the_one_that_is_reported(network: Policy) -> None:
    stimulation = Stimulation((3,), (0.5,))
    acted = network.act(np.zeros(INPUTS), stimulation)
    assert acted.stimulation is stimulation
