"""The keys of the guide's moving picture, pressed on the real screen: what they record repeats."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import pdtui
from pdtui.driving.keystrokes import format_keystrokes
from pdtui.driving.session_replay import replay_session
from pdtui.guide.cast.cast_picture import CastPicture
from pdtui.guide.cast.cast_script import SCENES, SEED, perform_cast
from pdtui.guide.guide_pages import GUIDE_FOLDER
from pdtui.sessions.session_reader import read_session
from pdtui.stimulation.map_reader import load_map

SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.slow
async def test_the_keys_of_the_cast_are_recorded_branched_and_repeated_without_a_screen(
    tmp_path: Path,
) -> None:
    cast = await perform_cast(tmp_path, faster=2)
    assert load_map(cast.map).behaviors["lean"].magnitudes == {"0:187": -8.0}
    assert load_map(cast.map).behaviors["lean"].key == "y"
    first, branch = (read_session(path) for path in cast.sessions)
    told = [line.split(" ", 1)[1] for line in format_keystrokes(first.events).splitlines()]
    assert told == ["j", "space", "unit 0:187 -8", "space"]
    assert branch.info.branch is not None
    assert branch.info.branch.step < first.steps
    assert replay_session(cast.sessions[1]).verdict == f"identical: {branch.steps} steps"
    keys = tmp_path / "keys.txt"
    keys.write_text(format_keystrokes(branch.events))
    alone = pdtui.drive("ant", keys=keys, steps=branch.steps, seed=7, record=tmp_path / "headless.rrd")
    assert len(alone) == branch.steps
    assert np.array_equal(branch.digests, read_session(tmp_path / "headless.rrd").digests)
    picture = ElementTree.fromstring(CastPicture(cast.frames, "#000000", "a cast").compose())
    shown = {text.text for text in picture.iter(f"{SVG}text") if text.get("class") == "c"}
    assert shown == {scene.says for scene in SCENES}


def test_its_keys_drive_without_a_screen_and_replay_bit_for_bit(tmp_path: Path) -> None:
    keys, session = GUIDE_FOLDER / "images" / "cockpit.keys.txt", tmp_path / "headless.rrd"
    last = int(keys.read_text().splitlines()[-1].split()[0])
    drive = pdtui.drive("ant", keys=keys, steps=last + 20, seed=SEED, record=session)
    assert [event.kind for event in read_session(session).events][-1] == "behavior"
    assert drive.behaviors[-1] == ("spin right",)
    assert replay_session(session).verdict == f"identical: {last + 20} steps"


def test_the_picture_of_the_guide_shows_every_scene_and_is_small() -> None:
    path = GUIDE_FOLDER / "images" / "cockpit.svg"
    assert path.stat().st_size < 400_000
    picture = ElementTree.parse(path).getroot()
    captions = [text.text for text in picture.iter(f"{SVG}text") if text.get("class") == "c"]
    assert list(dict.fromkeys(captions)) == [scene.says for scene in SCENES]
    assert "cockpit.svg" in (GUIDE_FOLDER / "driving.md").read_text()
