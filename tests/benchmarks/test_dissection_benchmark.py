from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from pdtui.benchmarks.dissection_benchmark import (
    DissectionBenchmarkSettings,
    record_episodes,
    widen_episode_columns,
)
from pdtui.benchmarks.matching_benchmark import match_by_loop, same_ranking
from pdtui.benchmarks.optional_librosa import load_librosa
from pdtui.benchmarks.released_procedure import run_released_procedure
from pdtui.cli import main
from pdtui.core.attributes import Attribute
from pdtui.core.errors import PdtuiError
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.spectra.episode_monitor import MonitoredEpisode
from pdtui.spectra.matching import match_units
from pdtui.spectra.matching_presets import PRESETS

SMALL = [
    "--episodes",
    "2",
    "--steps",
    "150",
    "--units",
    "20",
    "--attributes",
    "18",
    "--rounds",
    "2",
    "--memory-units",
    "300",
    "--probes",
    "4",
]


def test_the_command_measures_all_parts(weights: Path) -> None:
    result = CliRunner().invoke(main, ["bench", "dissect", "ant", "--policy", str(weights), *SMALL, "--json"])
    assert result.exit_code == 0, result.output
    data = json.loads(result.output)
    assert [one["preset"] for one in data["compared"]] == ["paper", "authors"]
    for one in data["compared"]:
        assert one["same_ranking"]
        assert one["largest_difference"] < 1e-6
        assert one["ratio"] > 0
    released = data["released"]
    assert released["matching_ratio"] > released["phases_ratio"] > 1
    assert released["overlap"] > 0.5
    assert {curve["grows"]: len(curve["sizes"]) for curve in data["curves"]} == {
        "units": 5, "attributes": 5, "episodes": 4,
    }  # fmt: skip
    assert data["memory_units"] == 300
    assert data["memory_peak_gb"] > data["memory_data_gb"] > 0
    assert data["probing_ratio"] > 0
    assert "shifted in time" in data["recorded"]
    table = CliRunner().invoke(main, ["bench", "dissect", "--policy", str(weights), *SMALL])
    assert "same" in table.output
    assert "2 workers over 1" in table.output


def test_the_loop_computes_what_matching_does() -> None:
    rng = np.random.default_rng(0)
    episodes = [
        MonitoredEpisode(
            seed, rng.standard_normal((200, 9)).astype(np.float32), rng.standard_normal((200, 2))
        )
        for seed in range(2)
    ]
    attributes = (Attribute("vx", "m/s"), Attribute("torque", "N m", scale=0.1))
    for one in PRESETS.values():
        found = match_units(episodes, attributes, one)
        loop = match_by_loop(episodes, attributes, one)
        np.testing.assert_allclose(found.discrepancy, loop, rtol=1e-6)
        assert same_ranking(found, loop) == (True, 0)
        assert not same_ranking(found, loop[:, ::-1])[0]
        assert same_ranking(found, np.column_stack([loop[:, :8], loop[:, 0]]))[1] == 2


def test_the_released_procedure_pads_and_keeps_each_episode_apart() -> None:
    rng = np.random.default_rng(1)
    one = MonitoredEpisode(0, rng.standard_normal((96, 3)).astype(np.float32), rng.standard_normal((96, 2)))
    attributes = (Attribute("vx", "m/s"), Attribute("torque", "N m", scale=0.1))
    found = run_released_procedure([one, one], attributes)
    assert len(found) == 2
    stft = load_librosa().stft
    for row, attribute in enumerate(attributes):
        target = np.abs(stft(one.attributes[:, row] * attribute.scale, n_fft=32))
        for unit in range(3):
            spectrum = np.abs(stft(one.activations[:, unit].astype(np.float64), n_fft=32))
            assert found[1][row, unit] == pytest.approx(np.linalg.norm(spectrum - target))


def test_columns_beyond_the_recorded_ones_are_other_series(weights: Path) -> None:
    with RolloutPool("ant", weights, 1) as pool:
        episodes, attributes = record_episodes(
            pool, DissectionBenchmarkSettings(episodes=1, steps=80, units=40, attributes=20)
        )
        alone = record_episodes(
            pool, DissectionBenchmarkSettings(episodes=1, steps=80, units=32, attributes=16)
        )[0][0]
    assert len({attribute.name for attribute in attributes}) == 20
    np.testing.assert_array_equal(episodes[0].activations[:, :32], alone.activations)
    assert np.abs(episodes[0].activations[:, 32] - alone.activations[:, 0]).max() > 0
    assert widen_episode_columns(alone, 7, 3).activations.shape == (80, 7)


def test_without_librosa_there_is_a_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "librosa", None)
    with pytest.raises(PdtuiError, match=r"librosa is not installed.*pip install 'pdtui\[bench\]'"):
        load_librosa()
