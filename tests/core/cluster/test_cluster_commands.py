"""What commands find on a cluster is what they find on one machine."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import torch

from pdtui.api import dissect
from pdtui.core.cluster.ray_cluster import RayCluster
from pdtui.dissection.dissection_result import Dissection
from pdtui.driving.drive_config import DriveConfig
from pdtui.evaluation.key_release.key_release_evaluation import evaluate_key_releases
from pdtui.policies.weights.weights_file import load_network
from pdtui.stimulation.stimulation_map import StimulationMap
from tests.local_cluster import local_cluster
from tests.small_dissection import SMALL
from tests.training.test_policy_trainer import SMALL as SMALL_SAC
from tests.training.test_policy_trainer import SMALL_PPO

pytest.importorskip("jax", reason="the extra 'train' is not installed")

from pdtui.training.ppo_trainer import PpoTrainer
from pdtui.training.sac_trainer import SacTrainer
from pdtui.training.training_config import PpoConfig, SacConfig

pytestmark = pytest.mark.slow  # everything runs twice, and a cluster starts in 10 s


@pytest.fixture(scope="module")
def cluster() -> Iterator[RayCluster]:
    with local_cluster(2) as (joined, _):
        yield joined


def test_evaluate(cluster: RayCluster, small_map: StimulationMap) -> None:
    config = DriveConfig("ant", small_map, 0)
    here, there = (
        evaluate_key_releases(config, range(100, 102), held=20, workers=workers) for workers in (1, cluster)
    )
    assert there == here


def test_dissect(cluster: RayCluster, policy_file: Path, dissection: Dissection) -> None:
    found = dissect("ant", policy_file, episodes=2, workers=cluster, settings=SMALL)
    assert found.rollouts == dissection.rollouts
    for name in ("screen", "refined"):
        np.testing.assert_array_equal(getattr(found, name).effects, getattr(dissection, name).effects)
    for name in ("judgment", "attribute_movers", "steering", "behaviors", "controllers", "tasks"):
        assert repr(getattr(found, name)) == repr(getattr(dissection, name))


@pytest.mark.parametrize("config", [SMALL_SAC, SMALL_PPO], ids=["sac", "ppo"])
def test_train(cluster: RayCluster, tmp_path: Path, config: SacConfig | PpoConfig) -> None:
    found = []
    for name, where in (("here", None), ("there", cluster)):
        trainer = make_trainer(tmp_path / name, config, where)
        found.append(load_network(trainer.run(lambda *_: None)))
    for name, tensor in found[0].state_dict().items():
        assert torch.equal(tensor, found[1].state_dict()[name])


def make_trainer(
    folder: Path, config: SacConfig | PpoConfig, cluster: RayCluster | None
) -> PpoTrainer | SacTrainer:
    if isinstance(config, PpoConfig):
        return PpoTrainer("ant", 3, folder, config, "", cluster)
    return SacTrainer("ant", 3, folder, config, "", cluster)
