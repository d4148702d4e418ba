"""The policy runtime: addresses, stimulation, and the bits of the bare network."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from torch import nn

from pdtui.core.errors import PolicyError
from pdtui.core.units import Stimulation, format_unit, parse_unit
from pdtui.policies.runtime.action_decoders import make_action_decoder
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.policies.weights.weights_file import load_network


def _observations(count: int, size: int = 27) -> np.ndarray:
    return np.random.default_rng(3).normal(size=(count, size))


def test_without_stimulation_actions_are_those_of_the_bare_network(weights: Path, policy: Policy) -> None:
    network = load_network(weights)
    decode = make_action_decoder(network)
    for observation in _observations(100):
        with torch.inference_mode():
            bare = decode(network(torch.from_numpy(observation.astype(np.float32))), None)
        np.testing.assert_array_equal(policy.act(observation).action, bare)


def test_stimulation_overwrites_after_the_activation_and_before_the_next_layer(
    weights: Path, policy: Policy
) -> None:
    tensors = {
        name: value.numpy().astype(np.float64) for name, value in load_network(weights).state_dict().items()
    }
    observation = _observations(1)[0].astype(np.float32).astype(np.float64)
    first = np.tanh(tensors["hidden.0.weight"] @ observation + tensors["hidden.0.bias"])
    natural_first = first[3]
    first[3] = 5.0
    second = np.tanh(tensors["hidden.1.weight"] @ first + tensors["hidden.1.bias"])
    natural_second = second[0]
    second[0] = -2.0
    output = tensors["head.weight"] @ second + tensors["head.bias"]

    step = policy.act(observation, Stimulation((3, 16), (5.0, -2.0)))

    np.testing.assert_allclose(step.activations, np.concatenate([first, second]), atol=1e-6)
    np.testing.assert_allclose(step.natural, [natural_first, natural_second], atol=1e-6)
    np.testing.assert_allclose(step.action, np.tanh(output[:8]), atol=1e-6)


def test_a_stimulation_leaves_no_trace(policy: Policy) -> None:
    observation = _observations(1)[0]
    before = policy.act(observation)
    policy.act(observation, Stimulation((0, 20), (9.0, 9.0)))
    after = policy.act(observation)
    np.testing.assert_array_equal(before.action, after.action)
    np.testing.assert_array_equal(before.activations, after.activations)


class _Branched(nn.Module):
    """No chain: a skip connection, and one activation module used twice."""

    def __init__(self) -> None:
        super().__init__()
        self.first, self.second, self.act = nn.Linear(4, 6), nn.Linear(6, 6), nn.ReLU()
        self.out = nn.Linear(6, 2)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        h = self.act(self.first(x))
        output: torch.Tensor = self.out(h + self.act(self.second(h)))
        return output


def test_any_module_has_its_units_in_the_config_of_the_calls() -> None:
    torch.manual_seed(0)
    module = _Branched()
    policy = Policy(module, 4)
    assert policy.layers == (6, 6)
    observation = _observations(1, 4)[0]
    step = policy.act(observation, Stimulation((1, 8), (2.0, 3.0)))
    with torch.no_grad():
        h = torch.relu(module.first(torch.from_numpy(observation.astype(np.float32))))
        h[1] = 2.0
        g = torch.relu(module.second(h))
        g[2] = 3.0
        expected = module.out(h + g)
    np.testing.assert_allclose(step.action, expected.numpy(), atol=1e-6)


class _Center(nn.Module):
    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return x - x.mean()


@pytest.mark.parametrize(
    ("stages", "hidden"),
    [
        ([nn.Linear(5, 32), nn.ELU(), nn.Linear(32, 32), nn.Tanh(), nn.Linear(32, 3)], ["1", "3"]),
        ([_Center(), nn.Linear(5, 40), nn.ReLU(), nn.Dropout(), nn.Linear(40, 8, bias=False)], ["2"]),
        ([nn.Linear(5, 32), _Center(), nn.Tanh(), nn.ReLU(), nn.Linear(32, 9), nn.Tanh()], ["2", "3", "5"]),
    ],
)
def test_chain_and_hooks_give_the_same_bits(stages: list[nn.Module], hidden: list[str]) -> None:
    torch.manual_seed(0)
    module = nn.Sequential(*stages)
    chain = Policy(module, 5)
    hooks = Policy(module, 5, hidden=hidden)
    assert chain.layers == hooks.layers
    stimulation = Stimulation((4, chain.units - 1), (1.5, -1.5))
    for observation in _observations(20, 5):
        a, b = chain.act(observation, stimulation), hooks.act(observation, stimulation)
        np.testing.assert_array_equal(a.action, b.action)
        np.testing.assert_array_equal(a.activations, b.activations)
        assert a.natural == b.natural


def test_a_step_is_not_changed_by_the_next(policy: Policy) -> None:
    first, second = _observations(2)
    step = policy.act(first)
    action, activations = step.action.copy(), step.activations.copy()
    policy.act(second)
    np.testing.assert_array_equal(step.action, action)
    np.testing.assert_array_equal(step.activations, activations)


def test_sampled_actions_come_from_the_generator(policy: Policy) -> None:
    observation = _observations(1)[0]
    draws = [policy.act(observation, rng=np.random.default_rng(seed)).action for seed in (1, 1, 2)]
    np.testing.assert_array_equal(draws[0], draws[1])
    assert not np.array_equal(draws[0], draws[2])


def test_addresses_go_both_ways() -> None:
    assert [parse_unit(text, (16, 8)) for text in ("0:0", "0:15", "1:0", "1:7")] == [0, 15, 16, 23]
    assert [format_unit(flat, (16, 8)) for flat in (0, 15, 16, 23)] == ["0:0", "0:15", "1:0", "1:7"]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: parse_unit("3:12", (256, 256)),
            r"unit 3:12 does not exist; the policy has layers 0\.\.1 of 256 units",
        ),
        (lambda: parse_unit("knee", (4,)), "unit 'knee': expected layer:index"),
        (lambda: Policy(nn.Sequential(nn.Linear(2, 2)), 2), "no hidden layer"),
        (lambda: Policy(_Branched(), 4, hidden=["legs"]), "no submodule 'legs'; available: first, second"),
        (
            lambda: Policy(_Branched(), 4).act(np.zeros(5)),
            r"expected an observation of shape \(4,\), got \(5,\)",
        ),
        (
            lambda: Policy(_Branched(), 4).act(np.zeros(4), Stimulation((99,), (1.0,))),
            "unit number 99 does not exist",
        ),
    ],
)
def test_errors_name_what_is_there(call: object, message: str) -> None:
    assert callable(call)
    with pytest.raises(PolicyError, match=message):
        call()


def test_loading_and_acting_leave_the_callers_threads_alone(weights: Path) -> None:
    before = torch.get_num_threads()
    torch.set_num_threads(3)
    try:
        policy = load_policy(weights)
        policy.act(np.zeros(policy.shape))
        assert torch.get_num_threads() == 3
    finally:
        torch.set_num_threads(before)
