"""Drives, dissections and replays from Python as a notebook shows them, with progress and time limits."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest
import torch
from torch import nn

import pdtui
from pdtui.core.errors import MapError
from pdtui.dissection.dissection_result import Dissection
from tests.small_dissection import SMALL


class WantsBatch(nn.Module):
    """A network that flattens all but the first axis, as many do, and so needs a batch."""

    def __init__(self) -> None:
        super().__init__()
        self.body = nn.Sequential(nn.Flatten(), nn.Linear(11, 8), nn.Tanh(), nn.Linear(8, 3))

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        batch, _ = observation.shape
        output: torch.Tensor = self.body(observation)
        return output.reshape(batch, 3)


def test_a_policy_without_a_map_drives_alone() -> None:
    drive = pdtui.drive("Hopper-v5", policy=WantsBatch(), steps=30)
    assert (len(drive), drive.activations.shape) == (30, (30, 8))
    again = pdtui.drive("Hopper-v5", policy=pdtui.load_policy(WantsBatch(), "Hopper-v5"), steps=5)
    assert again.info.layers == (8,)


def test_a_robots_own_map_is_not_for_another_policy_unless_that_is_forced() -> None:
    other = nn.Sequential(nn.Linear(27, 256), nn.Tanh(), nn.Linear(256, 256), nn.Tanh(), nn.Linear(256, 8))
    alone = pdtui.drive("ant", policy=other, steps=5)
    assert len(alone) == 5
    forced = pdtui.drive("ant", policy=other, steps=5, keys={0: "x"}, force=True)
    assert forced.behaviors[0]
    with pytest.raises(MapError, match="made for a policy with SHA-256"):
        pdtui.drive("ant", "ant", policy=other, steps=5)


def test_without_a_policy_a_map_is_needed() -> None:
    with pytest.raises(MapError, match="no map 'Hopper-v5'"):
        pdtui.drive("Hopper-v5", steps=5)


def test_a_drive_ends_after_its_time(tmp_path: Path) -> None:
    path = tmp_path / "drive.rrd"
    drive = pdtui.drive("ant", steps=10_000_000, minutes=0.01, record=path)
    assert 0 < len(drive) < 10_000_000
    assert pdtui.replay(path).first_difference is None


def test_a_replay_ends_after_its_time_and_says_what_it_left(tmp_path: Path) -> None:
    path = tmp_path / "drive.rrd"
    pdtui.drive("ant", steps=60, record=path)
    replay = pdtui.replay(path, minutes=1e-9)
    assert (replay.steps, replay.left, replay.passed) == (1, 59, True)
    assert replay.verdict == "identical: 1 step; the time was over before the other 59"
    whole = pdtui.replay(path, minutes=10.0)
    assert (whole.left, whole.verdict) == (0, "identical: 60 steps")


def test_progress_is_shown_on_standard_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "drive.rrd"
    pdtui.drive("ant", steps=20, record=path, progress=True)
    pdtui.replay(path, progress=True)
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "driving" in shown.err
    assert "20/20" in shown.err
    assert "replaying" in shown.err


def test_a_notebook_shows_a_drive_as_curves_and_a_frame() -> None:
    drive = pdtui.drive("ant", keys={10: "x", 30: "space"}, steps=60)
    html = ElementTree.fromstring(f"<div>{drive._repr_html_()}</div>")
    texts = [one.text or "" for one in html.iter()]
    assert "Drive of ant by ant: 60 steps (3 s), 2 events, falls 0" in texts
    assert any(text.startswith("speed") for text in texts)
    assert "stop" in texts
    pytest.importorskip("pandas")
    frame = drive.to_pandas()
    assert len(frame) == 60
    assert list(frame["speed"]) == list(drive["speed"])
    assert set(frame["behaviors"]) == {"", "stop"}
    assert frame["time"].iloc[-1] == pytest.approx(3.0)


def test_a_notebook_shows_a_dissection_as_a_table_and_a_frame(dissection: Dissection) -> None:
    html = ElementTree.fromstring(f"<div>{dissection._repr_html_()}</div>")
    pairs = len(dissection.judgment.confirmations)
    assert len(html.findall(".//tbody/tr")) == pairs > 0
    pytest.importorskip("pandas")
    frame = dissection.to_pandas()
    assert len(frame) == pairs
    assert {"attribute", "unit", "effect", "low", "high", "confirmed"} <= set(frame.columns)


def test_a_dissection_shows_its_progress(capsys: pytest.CaptureFixture[str]) -> None:
    last = nn.Linear(4, 8)
    nn.init.constant_(last.weight, 0.01)
    network = nn.Sequential(nn.Linear(27, 4), nn.Tanh(), last)
    pdtui.dissect("ant", network, episodes=1, settings=SMALL, budget_minutes=0.0, progress=True)
    assert "dissecting" in capsys.readouterr().err
