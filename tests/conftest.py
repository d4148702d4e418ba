"""A small seeded policy and a map for it, so that tests need no training.

Fixtures import what takes seconds to load: the process that only distributes the tests needs none of it.
"""

from __future__ import annotations

import compileall
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import pdtui

if TYPE_CHECKING:
    from pdtui.dissection.dissection_result import Dissection
    from pdtui.policies.runtime.policy import Policy
    from pdtui.stimulation.stimulation_map import StimulationMap
    from tests.real_viewer import RealViewer


def pytest_configure(config: pytest.Config) -> None:
    """Compile pdtui once, for the hundreds of processes that tests start.

    Without this, each compiles all that it imports where ``PYTHONDONTWRITEBYTECODE`` is set.
    """
    if not hasattr(config, "workerinput"):
        compileall.compile_dir(Path(pdtui.__file__).parent, quiet=2)


@pytest.fixture(scope="session", autouse=True)
def _processes_at_once() -> None:
    """Load PyTorch and MuJoCo once for all processes that tests start."""
    from pdtui.driving.drive_client import prepare_simulation

    prepare_simulation("ant")


@pytest.fixture(scope="session")
def viewer() -> Iterator[RealViewer]:
    """The Rerun viewer, without a window."""
    from tests.real_viewer import real_viewer

    with real_viewer() as started:
        yield started


@pytest.fixture(scope="session", autouse=True)
def _weights_anywhere(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Maps and sessions of tests may name weights in any folder of the tests."""
    from pdtui.policies.weights.policy_file_lookup import POLICY_FOLDERS_VARIABLE

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(POLICY_FOLDERS_VARIABLE, str(tmp_path_factory.getbasetemp()))
        yield


@pytest.fixture(scope="session")
def weights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Weights of an untrained policy for the Ant, 2×16 tanh."""
    from tests.small_map import write_small_weights

    return write_small_weights(tmp_path_factory.mktemp("weights") / "small.safetensors")


@pytest.fixture(scope="session")
def policy(weights: Path) -> Policy:
    from pdtui.policies.weights.policy_loading import load_policy

    return load_policy(weights)


@pytest.fixture(scope="session")
def map_text(weights: Path, policy: Policy) -> str:
    from tests.small_map import SMALL_MAP

    return SMALL_MAP.format(policy=weights, sha256=policy.sha256)


@pytest.fixture(scope="session")
def map_path(map_text: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("maps") / "small.toml"
    path.write_text(map_text)
    return path


@pytest.fixture(scope="session")
def small_map(map_path: Path) -> StimulationMap:
    from pdtui.stimulation.map_reader import load_map

    return load_map(map_path)


@pytest.fixture(scope="session")
def policy_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Weights of a policy small enough to be dissected in a test."""
    from tests.small_dissection import small_network, write_policy

    return write_policy(tmp_path_factory.mktemp("policies") / "small.safetensors", small_network(7))


@pytest.fixture(scope="session")
def wired_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Weights of a policy of which one unit drives one motor."""
    from tests.wired_policy import write_wired_policy

    return write_wired_policy(tmp_path_factory.mktemp("policies") / "wired.safetensors")


@pytest.fixture(scope="session")
def dissection(policy_file: Path) -> Dissection:
    """What was found about it."""
    from pdtui.api import dissect
    from tests.small_dissection import SMALL

    return dissect("ant", policy_file, episodes=2, workers=2, settings=SMALL)
