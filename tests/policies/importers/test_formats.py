"""State dicts of other programs, told apart by the names in them, and files that are none."""

from __future__ import annotations

import io
import json
import pickle
import struct
import zipfile
import zlib
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from safetensors.torch import save_file
from torch import nn

from pdtui.core.errors import PolicyError
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions, ObservationActionSpaces
from pdtui.policies.weights.policy_loading import convert_policy, load_policy

Draw = Callable[[int], NDArray[np.float32]]
BOUNDS = ObservationActionSpaces("world", 5, 2, (-2.0, -1.0), (2.0, 3.0))
TANH = ImportOptions("tanh")


def mlp(*widths: int, activation: type[nn.Module] = nn.Tanh) -> nn.Sequential:
    torch.manual_seed(3)
    stages: list[nn.Module] = []
    for inputs, outputs in pairwise(widths):
        stages += [nn.Linear(inputs, outputs), activation()]
    return nn.Sequential(*stages[:-1])


class PpoAgent(nn.Module):
    """Named as CleanRL's agent of continuous actions."""

    def __init__(self) -> None:
        super().__init__()
        self.critic, self.actor_mean = mlp(5, 6, 1), mlp(5, 7, 6, 2)
        self.actor_logstd = nn.Parameter(torch.full((1, 2), -0.5))


class SacActor(nn.Module):
    """Named as CleanRL's actor of SAC; with `fc_mu` instead, that of TD3."""

    def __init__(self, mean: str = "fc_mean") -> None:
        super().__init__()
        torch.manual_seed(4)
        self.fc1, self.fc2 = nn.Linear(5, 8), nn.Linear(8, 8)
        setattr(self, mean, nn.Linear(8, 2))
        if mean == "fc_mean":
            self.fc_logstd = nn.Linear(8, 2)
        self.register_buffer("action_scale", torch.tensor([2.0, 0.5]))
        self.register_buffer("action_bias", torch.tensor([0.0, 1.0]))
        self.mean = mean

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        h = torch.relu(self.fc2(torch.relu(self.fc1(x))))
        scale, bias = self.get_buffer("action_scale"), self.get_buffer("action_bias")
        action: torch.Tensor = torch.tanh(getattr(self, self.mean)(h)) * scale + bias
        return action


def agree(policy: Any, expected: Callable[[torch.Tensor], torch.Tensor], draws: NDArray[np.float32]) -> None:
    for observation in draws:
        with torch.no_grad():
            wanted = expected(torch.from_numpy(observation)).numpy()
        np.testing.assert_allclose(policy.act(observation).action, wanted, atol=2e-6)


def test_cleanrl_ppo_asks_and_then_acts(tmp_path: Path, observations: Draw) -> None:
    agent, path = PpoAgent(), tmp_path / "agent.pt"
    torch.save(agent.state_dict(), path)
    with pytest.raises(PolicyError, match=r"CleanRL PPO does not say how outputs.*--squash none\|tanh\|clip"):
        load_policy(path, import_options=TANH, spaces=BOUNDS)
    with pytest.raises(PolicyError, match=r"does not say the activation function of its 2 hidden layers"):
        load_policy(path, import_options=ImportOptions(squash="clip"), spaces=BOUNDS)
    with pytest.raises(PolicyError, match=r"bounds of the 2 actions, which --squash clip needs"):
        load_policy(path, import_options=ImportOptions("tanh", "clip"))
    policy = load_policy(path, import_options=ImportOptions("tanh", "clip"), spaces=BOUNDS)
    low, high = torch.tensor(BOUNDS.low), torch.tensor(BOUNDS.high)
    agree(policy, lambda x: torch.clamp(agent.actor_mean(x), low, high), observations(5))
    free = load_policy(path, import_options=ImportOptions("tanh", "none"))
    agree(free, agent.actor_mean, observations(5))
    rng = np.random.default_rng(0)
    drawn = np.array([free.act(observations(5)[0], rng=rng).action for _ in range(2000)])
    np.testing.assert_allclose(drawn.std(0), np.exp(-0.5), rtol=0.1)


@pytest.mark.parametrize("mean", ["fc_mean", "fc_mu"])
def test_cleanrl_sac_and_td3_state_their_bounds(mean: str, tmp_path: Path, observations: Draw) -> None:
    actor, path = SacActor(mean), tmp_path / "actor.pt"
    torch.save((actor.state_dict(), {"fc1.weight": torch.zeros(3, 7)}), path)
    policy = load_policy(path, import_options=ImportOptions("relu"))
    agree(policy, actor, observations(5))


def test_discrete_logits_choose(tmp_path: Path, observations: Draw) -> None:
    actor, path = mlp(5, 6, 3), tmp_path / "agent.pt"
    tensors = {f"actor.{name}": tensor for name, tensor in actor.state_dict().items()}
    torch.save(tensors | {f"critic.{name}": t for name, t in mlp(5, 6, 1).state_dict().items()}, path)
    policy = load_policy(
        path, import_options=TANH, spaces=ObservationActionSpaces("world", 5, 1, discrete_actions=3)
    )
    agree(policy, lambda x: actor(x).argmax().reshape(1).float(), observations(5))
    rng, observation = np.random.default_rng(0), observations(5)[0]
    drawn = np.bincount([int(policy.act(observation, rng=rng).action[0]) for _ in range(4000)], minlength=3)
    with torch.no_grad():
        shares = torch.softmax(actor(torch.from_numpy(observation)), 0).numpy()
    np.testing.assert_allclose(drawn / 4000, shares, atol=0.04)


@pytest.mark.parametrize("generation", [1, 2, 3])
def test_rsl_rl_checkpoints_of_three_generations(generation: int, tmp_path: Path, observations: Draw) -> None:
    actor, mean, std = mlp(5, 6, 2, activation=nn.ELU), torch.arange(5.0), torch.full((5,), 0.5)
    normalizer = {"_mean": mean[None], "_var": std[None] ** 2, "_std": std[None], "count": torch.tensor(9)}
    weights = actor.state_dict()
    checkpoint: dict[str, Any] = {"iter": 7, "infos": None, "optimizer_state_dict": {"state": {}}}
    if generation == 3:
        model = {f"mlp.{k}": v for k, v in weights.items()} | {"distribution.std_param": torch.ones(2)}
        model |= {f"obs_normalizer.{k}": v for k, v in normalizer.items()}
        checkpoint |= {"actor_state_dict": model, "critic_state_dict": {"mlp.0.weight": torch.zeros(6, 5)}}
    else:
        model = {f"actor.{k}": v for k, v in weights.items()} | {"std": torch.ones(2)}
        model |= {f"critic.{k}": v for k, v in mlp(5, 4, 1).state_dict().items()}
        if generation == 2:
            model |= {f"actor_obs_normalizer.{k}": v for k, v in normalizer.items()}
        else:
            checkpoint["obs_norm_state_dict"] = normalizer
        checkpoint["model_state_dict"] = model
    torch.save(checkpoint, tmp_path / "model_7.pt")
    policy = load_policy(tmp_path / "model_7.pt", import_options=ImportOptions("elu"))
    agree(policy, lambda x: actor((x - mean) / (std + 0.01)), observations(5))


@pytest.mark.parametrize("suffix", [".pt", ".npz", ".safetensors"])
def test_a_plain_chain_in_every_container(suffix: str, tmp_path: Path, observations: Draw) -> None:
    chain, path = mlp(5, 9, 8, 7, 2, activation=nn.SiLU), tmp_path / f"weights{suffix}"
    tensors = {f"net.{name}": tensor for name, tensor in chain.state_dict().items()}
    if suffix == ".pt":
        torch.save(tensors, path)
    elif suffix == ".npz":
        np.savez_compressed(path, **{name: tensor.numpy() for name, tensor in tensors.items()})
    else:
        save_file(tensors, path)
    policy = load_policy(path, import_options=ImportOptions("silu", "none"))
    assert policy.layers == (9, 8, 7)
    agree(policy, chain, observations(5))


def test_rllib_ppo_is_a_pair_or_logits_as_the_world_says(tmp_path: Path, observations: Draw) -> None:
    chain = mlp(5, 6, 6, 4)
    names = ("fc_1", "fc_2", "fc_out")
    linears = [stage for stage in chain if isinstance(stage, nn.Linear)]
    arrays: dict[str, Any] = {}
    for name, stage in zip(names, linears, strict=True):
        arrays[f"default_policy/{name}/kernel"] = stage.weight.detach().numpy().T
        arrays[f"default_policy/{name}/bias"] = stage.bias.detach().numpy()
    np.savez(tmp_path / "ppo.npz", **arrays)
    pair = load_policy(tmp_path / "ppo.npz", import_options=ImportOptions("tanh", "clip"), spaces=BOUNDS)
    low, high = torch.tensor(BOUNDS.low), torch.tensor(BOUNDS.high)
    agree(pair, lambda x: torch.clamp(chain(x)[:2], low, high), observations(5))
    logits = load_policy(
        tmp_path / "ppo.npz",
        import_options=TANH,
        spaces=ObservationActionSpaces("world", 5, 1, discrete_actions=4),
    )
    agree(logits, lambda x: chain(x).argmax().reshape(1).float(), observations(5))
    with pytest.raises(PolicyError, match=r"whether its 4 outputs are actions, pairs .*--robot"):
        convert_policy(
            tmp_path / "ppo.npz", tmp_path / "out.safetensors", ImportOptions("tanh", "none"), None
        )


def test_a_converted_policy_states_everything(tmp_path: Path, observations: Draw) -> None:
    torch.save(PpoAgent().state_dict(), tmp_path / "agent.pt")
    np.savez(tmp_path / "stats.npz", mean=np.ones(5), var=np.full(5, 4.0), clip_obs=3.0)
    import_options = ImportOptions("tanh", "clip", "stats.npz")
    spec = convert_policy(tmp_path / "agent.pt", tmp_path / "agent.safetensors", import_options, BOUNDS)
    assert (spec.robot, spec.layers, spec.observation_clip) == ("world", (7, 6), 3.0)
    before = load_policy(tmp_path / "agent.pt", import_options=import_options, spaces=BOUNDS)
    after = load_policy(tmp_path / "agent.safetensors", "world")
    for observation in observations(5):
        np.testing.assert_array_equal(before.act(observation).action, after.act(observation).action)
        np.testing.assert_array_equal(
            before.act(observation, rng=np.random.default_rng(1)).action,
            after.act(observation, rng=np.random.default_rng(1)).action,
        )
    with pytest.raises(PolicyError, match="already exists"):
        convert_policy(tmp_path / "agent.pt", tmp_path / "agent.safetensors", import_options, BOUNDS)
    with pytest.raises(PolicyError, match="its activation is 'tanh' and cannot be chosen, found 'relu'"):
        load_policy(tmp_path / "agent.safetensors", import_options=ImportOptions("relu"))


def zipped(**entries: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            archive.writestr(name.replace("__", "/").replace("_dot_", "."), content)
    return stream.getvalue()


def torch_file(content: Any) -> bytes:
    stream = io.BytesIO()
    torch.save(content, stream)
    return stream.getvalue()


def npz(**arrays: Any) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def bomb() -> bytes:
    """A zip whose directory says that 2 GiB come out."""
    return resized(2 << 30)


def lying_bomb() -> bytes:
    """A zip whose directory says 100 bytes where a megabyte comes out."""
    return resized(100)


def resized(size: int) -> bytes:
    content = bytearray(zipped(w_dot_npy=bytes(1 << 20)))
    directory = content.rindex(b"PK\x01\x02")
    for offset in (directory + 24, 22):
        struct.pack_into("<I", content, offset, size)
    return bytes(content)


def absurd() -> bytes:
    """An array whose header claims 10¹² numbers."""
    header = b"{'descr': '<f4', 'fortran_order': False, 'shape': (1000000, 1000000), }"
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    return zipped(w_dot_npy=b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + bytes(64))


class Evil:
    def __reduce__(self) -> Any:
        return (print, ("executed",))


FILES: dict[str, tuple[Callable[[], bytes], str]] = {
    "no model": (lambda: zipped(readme_dot_md=b"hello", a__b=b""), r"holds no policy: .* readme\.md, a/b"),
    "pickle": (lambda: pickle.dumps({"w": Evil()}), r"a pickle, which can run any code.*torch\.save"),
    "old pickle": (lambda: pickle.dumps({"w": 1}, protocol=0), r"a pickle, which can run any code"),
    "old torch": (
        lambda: b"\x80\x02\x8a\nl\xfc\x9cF\xf9 j\xa8P\x19.\x80\x02M\xe9\x03.",
        r"a pickle.*PyTorch 1\.6 or later",
    ),
    "torch with code": (lambda: torch_file({"w": Evil()}), r"objects other than tensors.*print"),
    "whole module": (lambda: torch_file(mlp(2, 2, 2)), r"objects other than tensors.*Sequential"),
    "npz with code": (lambda: npz(w=np.array([Evil()])), r"'w\.npy': holds Python objects"),
    "bomb": (bomb, r"at most .* 64 MiB in all; the zip would unpack to 1 entries of 2048 MiB"),
    "lying bomb": (lying_bomb, r"entry 'w\.npy'"),
    "absurd shape": (absurd, r"shape \(1000000, 1000000\) of float32 takes 4000000000000 bytes, found 64"),
    "absurd stride": (
        lambda: torch_file({"0.weight": torch.zeros(1).expand(10**6, 10**6)}),
        r"a tensor of shape \(1000000, 1000000\) claims more numbers than are stored",
    ),
    "compressed torch": (
        lambda: zipped(archive__data_dot_pkl=b"\x80\x02}.", archive__version=b"3"),
        r"whose entries are never compressed",
    ),
    "cut npz": (lambda: npz(w=np.zeros((9, 9)))[:-30], "a zip file that is cut off"),
    "convolutions": (
        lambda: torch_file({"conv.weight": torch.zeros(2, 3, 4, 4)}),
        r"found convolutions: conv\.weight \(2, 3, 4, 4\); export such a network as TorchScript",
    ),
    "two chains": (
        lambda: npz(**{f"{n}.{i}.weight": np.zeros(s) for n in "ab" for i, s in ((0, (4, 3)), (2, (2, 4)))}),
        r"expected one chain of linear layers, found 2: a\.0 … a\.2; b\.0 … b\.2",
    ),
    "no layers": (lambda: npz(x=np.zeros(3)), r"expected layers 'NAME\.weight'.* found x \(3,\)"),
    "broken chain": (
        lambda: torch_file(
            {"actor_mean.0.weight": torch.zeros(4, 3), "actor_mean.2.weight": torch.zeros(2, 5)}
        ),
        r"'actor_mean': layer 1 takes 5 inputs, but layer 0 has 4 outputs",
    ),
    "not finite": (
        lambda: npz(**{"n.0.weight": np.full((4, 3), np.nan), "n.1.weight": np.zeros((2, 4))}),
        r"tensor 'hidden\.0\.weight': expected finite numbers",
    ),
    "text": (lambda: b"dear reader, these are not weights", "no format that pdtui knows; expected Stable-B"),
    "hdf5": (lambda: b"\x89HDF\r\n\x1a\n" + bytes(64), "HDF5, such as Keras writes"),
    "gzip": (lambda: b"\x1f\x8b" + zlib.compress(b"x"), "a gzip file"),
    "empty": (lambda: b"", "an empty file"),
}


@pytest.mark.parametrize("name", FILES)
def test_what_is_no_policy_is_refused_in_one_line(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content, message = FILES[name]
    path = tmp_path / "policy.bin"
    path.write_bytes(content())
    with pytest.raises(PolicyError, match=message) as caught:
        load_policy(path, import_options=ImportOptions("tanh", "none"))
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)
    assert "executed" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (json.dumps({"mean": [0.0] * 5}), "expected 'mean' and 'var'.* found mean"),
        (json.dumps({"mean": [0.0] * 4, "var": [1.0] * 4}), r"'mean': expected shape \(5,\).* found \(4,\)"),
        (json.dumps({"mean": [0.0] * 5, "var": [-1.0] * 5}), "no negative variance"),
        (json.dumps({"mean": [0.0] * 5, "std": [0.0] * 5}), "expected positive standard deviations"),
        (
            json.dumps({"mean": [0.0] * 5, "var": [1.0] * 5, "clip_obs": -1}),
            "'clip_obs': expected one number",
        ),
        ("[" * 100_000, r"expected statistics as \.npz"),
        ("nonsense", r"expected statistics as \.npz"),
    ],
)
def test_statistics_are_checked(content: str, message: str, tmp_path: Path) -> None:
    torch.save(PpoAgent().state_dict(), tmp_path / "agent.pt")
    (tmp_path / "stats.json").write_text(content)
    with pytest.raises(PolicyError, match=message):
        load_policy(tmp_path / "agent.pt", import_options=ImportOptions("tanh", "none", "stats.json"))
    with pytest.raises(PolicyError, match=r"gone\.npz: no such file"):
        load_policy(tmp_path / "agent.pt", import_options=ImportOptions("tanh", "none", "gone.npz"))
    assert NO_OPTIONS.or_else(TANH) == TANH
