"""Networks that are no multilayer perceptron: images, convolutions, memory, discrete actions."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import torch
from torch import nn

from pdtui.core.errors import PolicyError
from pdtui.core.units import LayerWidths, Stimulation, format_unit, parse_unit
from pdtui.policies.runtime.action_decoders import decode_categorical_action
from pdtui.policies.runtime.policy import Policy
from tests.small_worlds import (
    SIDE,
    Dot,
    Pole,
    dot_policy,
    initial_state,
    pole_policy,
    trained_conv,
    trained_lstm,
)


def test_the_trained_networks_do_their_work() -> None:
    dot, policy = Dot(), dot_policy()
    observation, _ = dot.reset(seed=0)
    reached = 0
    for _ in range(200):
        mark = dot.state[2:].copy()
        observation, *_ = dot.step(policy.act(observation).action)
        reached += not np.array_equal(mark, dot.state[2:])
    assert reached > 15
    pole, remembers = Pole(), pole_policy()
    lasted = {}
    for forgets in (False, True):
        observation, _ = pole.reset(seed=0)
        remembers.reset()
        for lasted[forgets] in range(300):
            if forgets:
                remembers.reset()
            observation, _, fell, *_ = pole.step(remembers.act(observation).action)
            if fell:
                break
    assert lasted[False] == 299
    assert lasted[True] < 200


def test_units_of_a_convolution_are_its_flattened_outputs_by_number_and_by_name() -> None:
    policy = dot_policy()
    assert list(policy.layers) == [4 * SIDE * SIDE, 24]
    assert policy.layers.names == (("features.0", "features.1"), ("fc", "act"))
    for address in ("0:37", "features.0:37", "features.1:37"):
        assert parse_unit(address, policy.layers) == 37
    assert format_unit(37, policy.layers) == "features.0:37"
    assert format_unit(4 * SIDE * SIDE + 5, policy.layers) == "fc:5"
    with pytest.raises(
        PolicyError, match=r"unit fc:24 does not exist; the policy has layers 0 \(features.0\)"
    ):
        parse_unit("fc:24", policy.layers)
    again: LayerWidths = pickle.loads(pickle.dumps(policy.layers))
    assert again.names == policy.layers.names


def test_an_overwritten_pixel_is_what_the_next_layer_reads() -> None:
    policy, network = dot_policy(), trained_conv()
    image, _ = Dot().reset(seed=4)
    unit, fc_unit = parse_unit("features.0:85", policy.layers), parse_unit("fc:3", policy.layers)
    step = policy.act(image, Stimulation((unit, fc_unit), (7.0, -3.0)))
    with torch.no_grad():
        weight, bias = network.features[0].weight, network.features[0].bias
        assert isinstance(weight, torch.Tensor)
        assert isinstance(bias, torch.Tensor)
        padded = np.pad(image, ((0, 0), (1, 1), (1, 1)))
        conv = np.zeros((4, SIDE, SIDE))
        for row in range(SIDE):
            for column in range(SIDE):
                patch = padded[:, row : row + 3, column : column + 3]
                conv[:, row, column] = (weight.numpy() * patch).sum(axis=(1, 2, 3)) + bias.numpy()
        features = np.maximum(conv, 0.0).reshape(-1)
        natural, features[85] = features[85], 7.0
        hidden = np.tanh(network.fc.weight.numpy() @ features + network.fc.bias.numpy())
        natural_fc, hidden[3] = hidden[3], -3.0
        logits = network.logits.weight.numpy() @ hidden + network.logits.bias.numpy()
    np.testing.assert_allclose(step.activations, np.concatenate([features, hidden]), atol=1e-5)
    np.testing.assert_allclose(step.natural, [natural, natural_fc], atol=1e-5)
    assert step.action == [np.argmax(logits)]


def test_a_stimulated_unit_chooses_the_move() -> None:
    policy, network = dot_policy(), trained_conv()
    image, _ = Dot().reset(seed=4)
    strongest = network.logits.weight.abs().sum(0).argmax()
    moves = {
        value: int(policy.act(image, Stimulation((4 * SIDE * SIDE + int(strongest),), (value,))).action[0])
        for value in (-30.0, 30.0)
    }
    column = network.logits.weight[:, strongest]
    assert moves == {-30.0: int(column.argmin()), 30.0: int(column.argmax())}


def test_discrete_actions_are_drawn_from_the_softmax() -> None:
    logits = torch.tensor([[0.0, 1.0, -1.0]])
    rng = np.random.default_rng(0)
    draws = np.array([decode_categorical_action(logits, rng) for _ in range(4000)])
    assert draws.shape == (4000, 1)
    assert draws.dtype == np.float32
    counted = np.bincount(draws[:, 0].astype(int), minlength=3) / 4000
    np.testing.assert_allclose(counted, torch.softmax(logits[0], 0).numpy(), atol=0.03)
    assert decode_categorical_action(logits, None) == [1.0]


def test_an_overwritten_memory_cell_is_read_by_the_next_layer_and_not_by_the_next_step() -> None:
    policy, network = pole_policy(), trained_lstm()
    assert list(policy.layers) == [24]
    assert policy.layers.names == (("lstm",),)
    weights = {name: tensor.numpy() for name, tensor in network.lstm.state_dict().items()}
    w_x, w_h = weights["weight_ih_l0"], weights["weight_hh_l0"]
    bias = weights["bias_ih_l0"] + weights["bias_hh_l0"]

    def sigmoid(x: np.ndarray) -> np.ndarray:
        squashed: np.ndarray = 1.0 / (1.0 + np.exp(-x))
        return squashed

    h, c = np.zeros(24), np.zeros(24)
    for step, value in enumerate((0.3, -0.2, 0.5, 0.1)):
        gates = w_x @ np.array([value]) + w_h @ h + bias
        i, f, g, o = np.split(gates, 4)
        c = sigmoid(f) * c + sigmoid(i) * np.tanh(g)
        h = sigmoid(o) * np.tanh(c)
        read = h.copy()
        read[5] = 2.0
        stimulated = step % 2 == 1
        expected = network.out.weight.detach().numpy() @ (read if stimulated else h)
        acted = policy.act(np.array([value]), Stimulation((5,), (2.0,)) if stimulated else Stimulation())
        np.testing.assert_allclose(acted.action, expected + network.out.bias.detach().numpy(), atol=1e-5)
        np.testing.assert_allclose(acted.activations, read if stimulated else h, atol=1e-5)
        assert acted.natural == (pytest.approx(h[5], abs=1e-5),) * stimulated


class _Cells(nn.Module):
    """A cell hands on one tensor as output and as state."""

    def __init__(self, cell: type[nn.LSTMCell | nn.GRUCell]) -> None:
        super().__init__()
        self.encode, self.act, self.cell, self.out = nn.Linear(2, 6), nn.Tanh(), cell(6, 5), nn.Linear(5, 1)

    def forward(self, x: torch.Tensor, state: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        after = self.cell(self.act(self.encode(x)), state)
        return self.out(after[0] if isinstance(after, tuple) else after), after


@pytest.mark.parametrize("cell", [nn.LSTMCell, nn.GRUCell])
def test_a_cell_keeps_its_natural_state_and_reads_what_the_layer_before_was_overwritten_with(
    cell: type[nn.LSTMCell | nn.GRUCell],
) -> None:
    torch.manual_seed(0)
    network, zero = _Cells(cell), torch.zeros(5)
    policy = Policy(network, 2, initial_state=(zero, zero) if cell is nn.LSTMCell else zero)
    assert policy.layers.names == (("encode", "act"), ("cell",))
    x = np.array([0.4, -0.7])
    natural = policy.act(x)
    kept = policy.snapshot()
    policy.reset()
    pushed = policy.act(x, Stimulation((8,), (3.0,)))
    assert pushed.activations[8] == 3.0
    with torch.no_grad():
        expected = network.out(torch.from_numpy(pushed.activations[6:]))
    np.testing.assert_array_equal(pushed.action, expected.numpy())
    for state, other in zip(kept, policy.snapshot(), strict=True):
        np.testing.assert_array_equal(state, other)
    policy.restore(kept)
    again = policy.act(x).action
    policy.restore(kept)
    np.testing.assert_array_equal(policy.act(x).action, again)
    policy.reset()
    policy.act(x, Stimulation((2,), (3.0,)))
    assert not np.array_equal(policy.snapshot()[0], kept[0])
    assert not np.array_equal(natural.action, pushed.action)


def test_a_hidden_state_is_restored_bit_for_bit() -> None:
    policy = pole_policy()
    seen = np.random.default_rng(0).normal(size=(30, 1))
    first = [policy.act(x).action for x in seen[:10]]
    kept = policy.snapshot()
    then = [policy.act(x).action for x in seen[10:]]
    policy.restore(pickle.loads(pickle.dumps(kept)))
    assert [policy.act(x).action for x in seen[10:]] == then
    policy.reset()
    assert [policy.act(x).action for x in seen[:10]] == first
    with pytest.raises(
        PolicyError, match=r"expected a recurrent state of shapes \[\(1, 24\), \(1, 24\)\], got \[\]"
    ):
        policy.restore(())


def test_the_callers_module_is_left_alone() -> None:
    last = nn.Linear(3, 1)
    network = nn.Sequential(nn.Linear(2, 3), nn.ReLU(), nn.Dropout(0.5), last).train()
    policy = Policy(network, 2, hidden=["1"])
    before = policy.act(np.ones(2)).action
    assert network.training
    with torch.no_grad():
        last.bias.add_(1.0)
    np.testing.assert_array_equal(policy.act(np.ones(2)).action, before)


class _Odd(nn.Module):
    def __init__(self) -> None:
        super().__init__()
        self.lin, self.lstm = nn.Linear(2, 2), nn.LSTM(2, 3)

    def forward(self, x: torch.Tensor, state: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        del state
        return self.lstm(self.lin(x).reshape(1, -1))[0].reshape(-1), torch.zeros(7)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: Policy(trained_conv(), (2, SIDE, SIDE)),
            r"cannot take an observation of shape \(2, 6, 6\) \(without a batch axis, without a recurrent",
        ),
        (lambda: Policy(trained_lstm(), 1), "without a recurrent state"),
        (lambda: Policy(_Odd(), 2, initial_state=torch.zeros(3)), r"expected shapes \[\(3,\)\], the"),
        (lambda: Policy(_Odd(), 2, initial_state="zero"), "expected a tensor, or tuples .*, found str"),
        (
            lambda: dot_policy().act(np.zeros((2, 6, 7))),
            r"dot: expected an observation of shape \(2, 6, 6\), got \(2, 6, 7\)",
        ),
        (lambda: parse_unit("conv9:1", dot_policy().layers), r"unit conv9:1 does not exist.*1 \(fc\) of 24"),
    ],
)  # fmt: skip
def test_errors_say_what_the_network_was_given(call: object, message: str) -> None:
    assert callable(call)
    with pytest.raises(PolicyError, match=message):
        call()


def test_initial_states_are_copied() -> None:
    state = initial_state()
    policy = Policy(trained_lstm(), 1, initial_state=state)
    first = policy.act(np.ones(1)).action
    state[0].fill_(5.0)
    policy.reset()
    np.testing.assert_array_equal(policy.act(np.ones(1)).action, first)
