"""Stable-Baselines3 archives act as Stable-Baselines3 does; what is no such policy is refused in one line."""

from __future__ import annotations

import json
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from pdtui.core.errors import PolicyError
from pdtui.policies.weights.import_options import ImportOptions, ObservationActionSpaces
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.policies.weights.policy_network import PolicyNetwork

sb3 = pytest.importorskip("stable_baselines3", reason="stable-baselines3 is not installed")
Draw = Callable[[int], NDArray[np.float32]]


def saved(path: Path, algorithm: str, env: str = "Pendulum-v1", **options: Any) -> tuple[Any, Path]:
    options = {"net_arch": [16, 8]} | options
    sde = options.pop("use_sde", False)
    extra = {"use_sde": True} if sde else {}
    model = getattr(sb3, algorithm)("MlpPolicy", env, policy_kwargs=options, seed=1, device="cpu", **extra)
    model.save(path / "model.zip")
    return model, path / "model.zip"


@pytest.mark.parametrize(
    ("algorithm", "options", "head", "activation"),
    [
        ("PPO", {}, "gaussian", "tanh"),
        ("PPO", {"activation_fn": torch.nn.ELU, "net_arch": {"pi": [12], "vf": [4]}}, "gaussian", "elu"),
        ("PPO", {"use_sde": True}, "mean", "tanh"),
        ("PPO", {"use_sde": True, "squash_output": True}, "tanh", "tanh"),
        ("A2C", {"activation_fn": torch.nn.LeakyReLU}, "gaussian", "leaky_relu"),
        ("SAC", {}, "squashed_gaussian", "relu"),
        ("SAC", {"use_sde": True, "clip_mean": 0.1}, "tanh", "relu"),
        ("TD3", {}, "tanh", "relu"),
        ("DDPG", {"activation_fn": torch.nn.Tanh}, "tanh", "tanh"),
    ],
)
def test_continuous_actions_are_those_of_predict(
    algorithm: str, options: dict[str, Any], head: str, activation: str, tmp_path: Path, observations: Draw
) -> None:
    model, path = saved(tmp_path, algorithm, **options)
    policy = load_policy(path)
    network = policy.module
    assert isinstance(network, PolicyNetwork)
    spec = network.spec
    assert (spec.head, spec.activation, spec.robot) == (head, activation, "")
    assert algorithm in spec.command
    for observation in observations(3):
        expected, _ = model.predict(observation, deterministic=True)
        action = policy.act(observation).action
        assert action.dtype == np.float32
        np.testing.assert_allclose(action, expected, atol=2e-6)


def test_discrete_actions_are_those_of_predict(tmp_path: Path, observations: Draw) -> None:
    model, path = saved(tmp_path, "PPO", "CartPole-v1", activation_fn=torch.nn.ReLU)
    policy = load_policy(path, spaces=ObservationActionSpaces("CartPole-v1", 4, 1, discrete_actions=2))
    chosen = []
    for observation in observations(4):
        expected, _ = model.predict(observation, deterministic=True)
        action = policy.act(observation).action
        assert action.shape == (1,)
        assert action[0] == expected
        chosen.append(int(expected))
    assert set(chosen) == {0, 1}


def test_drawn_actions_follow_the_model_s_distribution(tmp_path: Path) -> None:
    model, path = saved(tmp_path, "SAC", "Pendulum-v1")
    policy, rng = load_policy(path), np.random.default_rng(0)
    observation = np.array([0.5, -0.3, 1.0], np.float32)
    torch.manual_seed(0)
    theirs = np.array([model.predict(observation)[0] for _ in range(2000)])
    ours = np.array([policy.act(observation, rng=rng).action for _ in range(2000)])
    assert abs(theirs.mean() - ours.mean()) < 5 * theirs.std() / np.sqrt(1000)
    assert ours.std() == pytest.approx(theirs.std(), rel=0.1)


@pytest.mark.parametrize("algorithm", ["SAC", "TD3"])
def test_a_trained_off_policy_model_needs_no_statistics_that_it_never_had(
    algorithm: str, tmp_path: Path, observations: Draw
) -> None:
    model = getattr(sb3, algorithm)("MlpPolicy", "Pendulum-v1", learning_starts=20, seed=1, device="cpu")
    model.learn(30)
    model.save(tmp_path / "model.zip")
    policy = load_policy(tmp_path / "model.zip")
    for observation in observations(3)[:5]:
        expected, _ = model.predict(observation, deterministic=True)
        np.testing.assert_allclose(policy.act(observation).action, expected, atol=1e-5)


def normalized(tmp_path: Path) -> tuple[Any, Any, Path]:
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.vec_env import VecNormalize

    env = VecNormalize(make_vec_env("Pendulum-v1", seed=0), clip_obs=1.5)
    model = sb3.PPO("MlpPolicy", env, n_steps=64, n_epochs=1, seed=0, device="cpu")
    model.learn(64)
    model.save(tmp_path / "model.zip")
    env.save(str(tmp_path / "stats.pkl"))
    return model, env, tmp_path / "model.zip"


def test_vecnormalize_is_asked_for_and_applied(tmp_path: Path, observations: Draw) -> None:
    model, env, path = normalized(tmp_path)
    with pytest.raises(PolicyError, match=r"behind VecNormalize.*--normalizer FILE, or --normalizer none"):
        load_policy(path)
    with pytest.raises(PolicyError, match=r"stats\.pkl: a pickle.*numpy\.savez"):
        load_policy(path, import_options=ImportOptions(normalizer=str(tmp_path / "stats.pkl")))
    statistics = {
        "mean": env.obs_rms.mean.tolist(),
        "var": env.obs_rms.var.tolist(),
        "clip_obs": env.clip_obs,
        "epsilon": env.epsilon,
    }
    (tmp_path / "stats.json").write_text(json.dumps(statistics))
    np.savez(tmp_path / "stats.npz", **statistics)
    bare = load_policy(path, import_options=ImportOptions(normalizer="none"))
    for name in ("stats.json", "stats.npz"):
        # Found beside the weights, by its name alone.
        policy = load_policy(path, import_options=ImportOptions(normalizer=name))
        assert policy.sha256 != bare.sha256
        for observation in observations(3):
            expected, _ = model.predict(env.normalize_obs(observation), deterministic=True)
            np.testing.assert_allclose(policy.act(observation).action, expected, atol=1e-5)
    far = np.array([9.0, -9.0, 9.0], np.float32)
    assert not np.allclose(bare.act(far).action, policy.act(far).action)


def test_the_pickles_in_data_are_never_read(tmp_path: Path) -> None:
    """A bomb in the place of every pickle does not go off."""
    _, path = saved(tmp_path, "PPO")
    witness = tmp_path / "witness"

    class Bomb:
        def __reduce__(self) -> Any:
            return (Path.touch, (witness,))

    import base64

    with zipfile.ZipFile(path) as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}
    data = json.loads(entries["data"])
    for value in data.values():
        if isinstance(value, dict) and ":serialized:" in value:
            value[":serialized:"] = base64.b64encode(pickle.dumps(Bomb())).decode()
    entries["data"] = json.dumps(data).encode()
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    assert load_policy(path).layers == (16, 8)
    assert not witness.exists()


def test_an_own_policy_class_is_asked_for_its_activation(tmp_path: Path, observations: Draw) -> None:
    model, path = saved(tmp_path, "PPO", activation_fn=torch.nn.Hardtanh)
    with pytest.raises(PolicyError, match=r"PPO does not say the activation.*--activation tanh\|relu\|elu"):
        load_policy(path)
    policy = load_policy(path, import_options=ImportOptions(activation="tanh"))
    observation = observations(3)[0] * 0.01
    expected, _ = model.predict(observation, deterministic=True)
    np.testing.assert_allclose(policy.act(observation).action, expected, atol=1e-2)


@pytest.mark.parametrize("algorithm", ["PPO", "SAC"])
def test_images_and_dictionaries_are_refused(algorithm: str, tmp_path: Path) -> None:
    import gymnasium

    class Looking(gymnasium.Env[Any, Any]):
        observation_space = gymnasium.spaces.Box(0, 255, (3, 36, 36), np.uint8)
        action_space = gymnasium.spaces.Box(-1, 1, (2,))

    options: dict[str, Any] = {"buffer_size": 10} if algorithm == "SAC" else {}
    model = getattr(sb3, algorithm)("CnnPolicy", Looking(), device="cpu", **options)
    model.save(tmp_path / "cnn.zip")
    with pytest.raises(
        PolicyError, match="expected an MlpPolicy, found .*Cnn.* with tensor '.*extractor.*TorchScript"
    ):
        load_policy(tmp_path / "cnn.zip")


def test_shapes_of_another_world_are_named(tmp_path: Path) -> None:
    _, path = saved(tmp_path, "PPO")
    with pytest.raises(
        PolicyError,
        match=r"expected observations of shape \(27,\) and actions of shape \(8,\), as ant has; the policy "
        r"has observations of shape \(3,\) and actions of shape \(1,\)",
    ):
        load_policy(path, spaces=ObservationActionSpaces("ant", 27, 8))


def test_other_algorithms_say_what_they_are(tmp_path: Path) -> None:
    _, path = saved(tmp_path, "DQN", "CartPole-v1")
    with pytest.raises(
        PolicyError, match=r"expected an actor of PPO, A2C, SAC, TD3 or DDPG, found DQNPolicy"
    ):
        load_policy(path)


def test_a_file_cut_off_is_named(tmp_path: Path) -> None:
    _, path = saved(tmp_path, "TD3")
    content = path.read_bytes()
    for share in (0.1, 0.5, 0.99):
        path.write_bytes(content[: int(len(content) * share)])
        with pytest.raises(PolicyError, match=r"model\.zip: a zip file that is cut off"):
            load_policy(path)
