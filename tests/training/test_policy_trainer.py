"""Training: it learns, it is seeded, and a run that was cut off ends as one that was not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from pdtui.core.errors import TrainingError
from pdtui.policies.weights.policy_network import NetworkSpec, PolicyNetwork
from pdtui.policies.weights.weights_file import CHECKPOINT_FOLDER, load_network, save_network

pytest.importorskip("jax", reason="the extra 'train' is not installed")

from pdtui.policies.weights.policy_loading import load_policy
from pdtui.training.actor_conversion import make_numpy_actor
from pdtui.training.policy_trainer import ActorScore, PolicyTrainer
from pdtui.training.ppo_trainer import PpoTrainer
from pdtui.training.robot_batch import TransitionBatch
from pdtui.training.sac_learner import SacLearner, run_actor
from pdtui.training.sac_trainer import ReplayBuffer, SacTrainer
from pdtui.training.training_config import PpoConfig, SacConfig

SMALL_PPO = PpoConfig(
    total_steps=640,
    worlds=4,
    chunk=16,
    minibatch=32,
    layers=(8, 8),
    evaluate_every=320,
    evaluate_episodes=2,
    evaluate_steps=20,
)
SMALL = SacConfig(
    total_steps=640,
    worlds=4,
    chunk=8,
    batch=16,
    layers=(8, 8),
    random_steps=64,
    capacity=500,
    evaluate_every=320,
    evaluate_episodes=2,
    evaluate_steps=20,
)


@pytest.fixture(autouse=True, scope="module")
def _compile_once(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Runs of the same settings share what XLA compiled."""
    import jax

    jax.config.update("jax_compilation_cache_dir", str(tmp_path_factory.mktemp("xla")))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)


def _make(folder: Path, config: SacConfig | PpoConfig) -> PolicyTrainer[PpoConfig] | PolicyTrainer[SacConfig]:
    if isinstance(config, PpoConfig):
        return PpoTrainer("ant", 3, folder, config, "pdtui train ant --seed 3")
    return SacTrainer("ant", 3, folder, config, "pdtui train ant --seed 3")


def _train(folder: Path, config: SacConfig | PpoConfig = SMALL, stop_at: int | None = None) -> Path:
    def report(steps: int, score: ActorScore | None, _: ActorScore | None) -> None:
        if stop_at is not None and score is not None and steps >= stop_at:
            raise KeyboardInterrupt

    trainer = _make(folder, config)
    if stop_at is None:
        return trainer.run(report)
    with pytest.raises(KeyboardInterrupt):
        trainer.run(report)
    return trainer.best_weights


@pytest.mark.parametrize(
    "config", [SMALL, SMALL_PPO, replace(SMALL_PPO, processes=True)], ids=["sac", "ppo", "ppo-processes"]
)
def test_a_run_that_was_cut_off_ends_as_one_that_was_not(
    tmp_path: Path, config: SacConfig | PpoConfig
) -> None:
    whole = load_network(_train(tmp_path / "whole", config))
    _train(tmp_path / "cut", config, stop_at=320)
    resumed = load_network(_train(tmp_path / "cut", config))
    assert whole.spec == resumed.spec
    for name, tensor in whole.state_dict().items():
        assert torch.equal(tensor, resumed.state_dict()[name])


def test_the_weights_drive_and_say_how_they_came_about(tmp_path: Path) -> None:
    path = _train(tmp_path)
    spec = load_network(path).spec
    assert spec.command == "pdtui train ant --seed 3"
    assert spec.score["episodes"] == 2
    assert spec.activation == "tanh"
    policy = load_policy(path, "ant")
    assert policy.layers == (8, 8)
    assert np.abs(policy.act(np.zeros(27)).action).max() <= 1.0


@pytest.mark.parametrize("config", [SMALL, replace(SMALL_PPO, layers=(6, 6))], ids=["sac", "ppo"])
def test_a_run_begins_by_imitating_a_policy(tmp_path: Path, config: SacConfig | PpoConfig) -> None:
    """The critics of SAC learn for as long as the imitated actor drives, and no actor learns yet."""
    torch.manual_seed(0)
    bounds = (-1.0,) * 8, (1.0,) * 8
    shown = PolicyNetwork(NetworkSpec("ant", 27, (8, 8), "tanh", 8, "squashed_gaussian", *bounds))
    save_network(tmp_path / "shown.safetensors", shown)
    initial = str(tmp_path / "shown.safetensors")
    config = replace(config, initial_policy=initial, imitation_rounds=1, worlds=2, total_steps=64)
    trainer = _make(tmp_path / "run", config)
    seen = np.concatenate([batch.observations for batch in trainer.batches])
    acted = make_numpy_actor(trainer.averaged_actor(), None)(seen)
    goal = np.tanh(shown(torch.from_numpy(seen)).detach().numpy()[:, :8])
    assert np.abs(acted - goal).mean() < 0.5 * np.abs(goal).mean()
    if isinstance(config, SacConfig):
        before = trainer.state
        for _ in range(2):
            trainer.advance()
        assert all(
            np.array_equal(a["w"], b["w"]) for a, b in zip(trainer.state.actor, before.actor, strict=True)
        )
        assert not np.array_equal(trainer.state.critics[0]["w"], before.critics[0]["w"])
        assert trainer.state.log_alpha == before.log_alpha
    first: list[tuple[int, ActorScore | None]] = []
    trainer.run(lambda steps, score, _: first.append((steps, score)))
    assert first[0][0] == 0
    assert first[0][1] is not None


def test_a_checkpoint_of_other_settings_is_refused(tmp_path: Path) -> None:
    _train(tmp_path, stop_at=320)
    with pytest.raises(TrainingError, match="expected shape .* was it made with other settings"):
        _make(tmp_path, replace(SMALL, layers=(4, 4)))
    (tmp_path / "checkpoint.safetensors").write_bytes(b"torn")
    with pytest.raises(TrainingError, match="expected a checkpoint of `pdtui train`"):
        _make(tmp_path, SMALL)


def test_sac_solves_a_bandit() -> None:
    """Reward −(a − 0.6)²: the mean action must come to 0.6, whatever the observation."""
    import jax

    config = SacConfig(total_steps=4000, steps_per_update=1, layers=(32, 32), batch=64, learning_rate=3e-3)
    learner = SacLearner(config, 2, 1)
    state = learner.init(0)
    rng = np.random.default_rng(0)
    replay = ReplayBuffer(2000, 2, 1)
    action = rng.uniform(-1, 1, (2000, 1)).astype(np.float32)
    observation = rng.normal(size=(2000, 2)).astype(np.float32)
    reward = -20 * (action[:, 0] - 0.6) ** 2
    replay.add(TransitionBatch(observation, action, reward, np.zeros(2000, np.float32), observation))
    for _ in range(20):
        state = learner.update(state, replay.sample(rng, 100, 64))
    mean, _ = run_actor(state.actor, jax.numpy.asarray(observation[:50]))
    np.testing.assert_allclose(np.tanh(np.asarray(mean)), 0.6, atol=0.12)


def test_the_replay_buffer_keeps_the_newest() -> None:
    replay = ReplayBuffer(4, 1, 1)
    for value in range(6):
        row = np.full((1, 1), value, np.float32)
        replay.add(TransitionBatch(row, row, row[0], row[0], row))
    assert sorted(replay.arrays.reward.tolist()) == [2, 3, 4, 5]
    assert set(replay.sample(np.random.default_rng(0), 2, 50).reward.ravel().tolist()) == {2, 3, 4, 5}


def test_policies_are_kept_after_each_part_of_a_run(tmp_path: Path) -> None:
    config = replace(SMALL_PPO, total_steps=6400, evaluate_every=6400, keeps_checkpoints=True)
    best = _train(tmp_path, config)
    kept = sorted((tmp_path / CHECKPOINT_FOLDER).iterdir())
    # 2 % are 128 control steps: two iterations.
    assert [int(path.stem) for path in kept] == list(range(0, 6401, 128))
    first, last = (load_network(path) for path in (kept[0], kept[-1]))
    assert last.spec.score == {"steps": 6400}
    weights = [network.state_dict()["hidden.0.weight"] for network in (first, last, load_network(best))]
    assert not torch.equal(weights[0], weights[1])
    assert torch.equal(weights[1], weights[2])


def test_no_policy_is_kept_unless_it_is_asked_for(tmp_path: Path) -> None:
    _train(tmp_path, SMALL_PPO)
    assert not (tmp_path / CHECKPOINT_FOLDER).exists()
