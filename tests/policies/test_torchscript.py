"""TorchScript files: the same bits as the network itself, and nothing of the file is executed."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import nn

import pdtui
from pdtui.core.errors import PolicyError
from pdtui.core.units import Stimulation
from pdtui.policies.foreign.reader_process import read_foreign_file
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.torchscript import build_torchscript
from pdtui.policies.weights.import_options import ObservationActionSpaces
from pdtui.policies.weights.policy_loading import load_policy
from tests.hostile_networks import TORCHSCRIPT
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

pytestmark = pytest.mark.filterwarnings(
    "ignore::DeprecationWarning", "ignore::FutureWarning", "ignore::torch.jit.TracerWarning"
)


def _script(module: nn.Module, path: Path) -> Path:
    torch.jit.script(module).save(str(path))
    return path


@pytest.fixture(params=["scripted", "traced"])
def conv_file(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / "dot.pt"
    if request.param == "scripted":
        return _script(trained_conv(), path)
    torch.jit.trace(trained_conv(), torch.zeros(1, 2, SIDE, SIDE)).save(str(path))
    return path


@pytest.fixture(params=["scripted", "traced"])
def lstm_file(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / "pole.pt"
    if request.param == "scripted":
        return _script(trained_lstm(), path)
    torch.jit.trace(trained_lstm(), (torch.zeros(1), initial_state())).save(str(path))
    return path


def test_a_convolutional_file_acts_and_is_stimulated_as_the_network(conv_file: Path) -> None:
    live, policy = dot_policy(), pdtui.load_policy(conv_file, Dot(), batched=True)
    assert policy.layers == live.layers
    assert policy.layers.names == live.layers.names
    rng = np.random.default_rng(0)
    for _ in range(20):
        image = rng.random((2, SIDE, SIDE))
        stimulation = Stimulation((3, 150), (float(rng.normal()) * 4, -2.0))
        for given in (Stimulation(), stimulation):
            a, b = live.act(image, given), policy.act(image, given)
            np.testing.assert_array_equal(a.action, b.action)
            np.testing.assert_allclose(a.activations, b.activations, atol=1e-6)


def test_a_recurrent_file_remembers_as_the_network(lstm_file: Path) -> None:
    live = pole_policy()
    policy = pdtui.load_policy(lstm_file, observations=1, initial_state=initial_state())
    assert policy.layers.names == (("lstm",),)
    for step, value in enumerate(np.random.default_rng(0).normal(size=(30, 1))):
        given = Stimulation((5,), (1.0,)) if step % 3 == 2 else Stimulation()
        a, b = live.act(value, given), policy.act(value, given)
        np.testing.assert_allclose(a.action, b.action, atol=1e-6)
    for kept, other in zip(live.snapshot(), policy.snapshot(), strict=True):
        np.testing.assert_allclose(kept, other, atol=1e-6)


def test_a_file_is_loaded_by_its_name_for_a_world(conv_file: Path, tmp_path: Path) -> None:
    policy = load_policy(conv_file, "dot", spaces=ObservationActionSpaces.of_world(Dot()))
    image, _ = Dot().reset(seed=1)
    np.testing.assert_array_equal(policy.act(image).action, dot_policy().act(image).action)
    network = _script(nn.Sequential(nn.Linear(1, 4), nn.Tanh(), nn.Linear(4, 3)), tmp_path / "three.pt")
    with pytest.raises(PolicyError, match="expected 1 outputs for 'pole', the network gives 3"):
        load_policy(network, "pole", spaces=ObservationActionSpaces.of_world(Pole()))
    with pytest.raises(PolicyError, match="TorchScript does not state shapes"):
        load_policy(network)


class _ReadsAFile(nn.Module):
    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return x + torch.from_file("/etc/hostname", False, 1, dtype=torch.uint8)


class _Loops(nn.Module):
    def forward(self, x: torch.Tensor) -> torch.Tensor:
        while bool(x.sum() < 1e9):
            x = x + 1.0
        return x


class _HasItsOwnState(nn.Module):
    def __init__(self) -> None:
        super().__init__()
        self.size = 3
        self.training = False

    @torch.jit.export
    def __getstate__(self) -> tuple[int, bool]:
        return self.size, self.training

    @torch.jit.export
    def __setstate__(self, state: tuple[int, bool]) -> None:
        self.size, self.training = state

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return x * self.size


@pytest.mark.parametrize(
    ("module", "message"),
    [
        (_ReadsAFile(), "uses the operator 'from_file', which is not on pdtui's list"),
        (_Loops(), "its code has a statement 'While', which pdtui does not run"),
        (_HasItsOwnState(), "expected the attributes of a module by their names"),
        (nn.Sequential(nn.Linear(2, 2)), "no hidden layer"),
    ],
)
def test_code_that_does_more_than_mathematics_is_refused_by_name(
    module: nn.Module, message: str, tmp_path: Path
) -> None:
    path = _script(module, tmp_path / "odd.pt")
    with pytest.raises(PolicyError, match=message):
        pdtui.load_policy(path, observations=2)


class _MakesZeros(nn.Module):
    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return torch.tanh(x) + torch.zeros([3_000_000_000])


class _MakesFull(nn.Module):
    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return torch.tanh(x) + torch.full([100_000, 100_000], 1.0)


class _MakesRange(nn.Module):
    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return torch.tanh(x) + torch.arange(10_000_000_000)


class _Repeats(nn.Module):
    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return torch.tanh(x).repeat([100_000, 100_000])


class _Broadcasts(nn.Module):
    def forward(self, x: torch.Tensor) -> torch.Tensor:
        line = torch.ones([1_000_000])
        return torch.tanh(x) + (line.unsqueeze(0) * line.unsqueeze(1)).sum()


class _GrowsAnInteger(nn.Module):
    def forward(self, x: torch.Tensor) -> torch.Tensor:
        number = x.size(0) + 1_000_000_007
        number = number * number
        number = number * number
        return torch.tanh(x) * number


class _DividesByZero(nn.Module):
    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return torch.tanh(x) * (7 // (x.size(0) - 2))


@pytest.mark.parametrize(
    ("module", "message"),
    [
        (_MakesZeros(), "torch.zeros would create 3000000000 elements, expected at most 67108864"),
        (_MakesFull(), "torch.full would create 10000000000 elements"),
        (_MakesRange(), "torch.arange would create 10000000000 elements"),
        (_Repeats(), "torch.repeat would create 20000000000 elements"),
        (_Broadcasts(), "torch.mul would create 1000000000000 elements"),
        (_GrowsAnInteger(), "torch.mul gives an integer of more than 64 bits"),
        (_DividesByZero(), "cannot compute torch.floordiv: integer division or modulo by zero"),
    ],
)
def test_code_that_takes_too_much_is_refused_before_it_does(
    module: nn.Module, message: str, tmp_path: Path
) -> None:
    path = _script(module, tmp_path / "large.pt")
    with pytest.raises(PolicyError, match=message):
        pdtui.load_policy(path, observations=2)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("a tensor of stride 0", r"shape \(32768, 32768\) claims more numbers than are stored"),
        ("many ones", "takes more than 256 MiB of memory per step"),
        ("squarings", "takes more than 4294967296 multiplications per step"),
        ("an empty product", "torch.mm would create 900000000 elements"),
        ("products of many matrices", "takes more than 256 MiB of memory per step"),
        ("a long sequence", "takes more than"),
        ("a million parts", "torch.unbind would give 4000000 tensors, expected at most 4096"),
        ("functions that double", "evaluates more than 100000 expressions per step"),
        ("lists that are compared", "uses torch.eq on lists in lists"),
        ("a function that calls itself", "its code fails when it is given .*recursion"),
        ("an f-string", "took longer to read than 2 s"),
        ("lists that share", "holds more than 100000 values"),
    ],
)
def test_archives_made_to_take_a_machine_are_refused(name: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "hostile.pt"
    path.write_bytes(TORCHSCRIPT[name]())
    with pytest.raises(PolicyError, match=message):
        pdtui.load_policy(path, observations=27)


def _rewrite(path: Path, change: Callable[[str, bytes], bytes]) -> Path:
    other = path.with_name("other.pt")
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(other, "w") as target:
        for name in source.namelist():
            target.writestr(name, change(name, source.read(name)))
    return other


@pytest.mark.parametrize(
    "hostile",
    [
        b"cposix\nsystem\n(X\x0a\x00\x00\x00touch PATHtR.",
        b"\x80\x02cbuiltins\nexec\nX\x04\x00\x00\x00passq\x00\x85R.",
        b"(S'touch PATH'\niposix\nsystem\n.",
        b"\x80\x04\x8c\x05posix\x8c\x06system\x93X\x0a\x00\x00\x00touch PATH\x85R.",
    ],
)
def test_a_pickle_that_calls_is_not_obeyed(
    hostile: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = _script(nn.Sequential(nn.Linear(2, 2), nn.Tanh()), tmp_path / "net.pt")
    other = _rewrite(path, lambda name, content: hostile if name.endswith("/data.pkl") else content)
    with pytest.raises(PolicyError, match=r"would call (posix.system|builtins.exec)|holds pickle's"):
        read_foreign_file(other)
    assert not (tmp_path / "PATH").exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda name, b: b[:-4] if "/data/" in name else b,
            r"storage '\d': expected \d numbers, found \d+ bytes",
        ),
        (lambda name, b: b[:40] if name.endswith("/data.pkl") else b, "damaged: "),
        (lambda name, b: b"def (" if name.endswith(".py") else b, "not TorchScript"),
        (
            lambda name, b: b"class A(Module):\n  pass" if name.endswith(".py") else b,
            "has no method 'forward'",
        ),
    ],
)
def test_damage_is_named(change: Callable[[str, bytes], bytes], message: str, tmp_path: Path) -> None:
    path = _script(nn.Sequential(nn.Linear(2, 2), nn.Tanh()), tmp_path / "net.pt")
    other = _rewrite(path, change)
    with pytest.raises(PolicyError, match=message):
        pdtui.load_policy(other, observations=2)


def test_other_files_are_no_torchscript(tmp_path: Path) -> None:
    text = tmp_path / "text.pt"
    text.write_text("text")
    torch.save(nn.Linear(2, 2).state_dict(), tmp_path / "weights.pt")
    with pytest.raises(PolicyError, match="no format that pdtui knows"):
        read_foreign_file(text)
    with pytest.raises(PolicyError, match="expected a TorchScript archive, found tensors"):
        build_torchscript(read_foreign_file(tmp_path / "weights.pt"))
    assert isinstance(pdtui.load_policy("ant"), Policy)
