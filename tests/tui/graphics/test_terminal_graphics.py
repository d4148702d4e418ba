"""A world's picture in the graphics of a terminal that says it has them: the real program in a terminal."""

from __future__ import annotations

import os
import re
import sys
import time
from pathlib import Path

import pexpect
import pytest

pytest.importorskip("textual_image")
PATIENCE = 60.0
POLICY = Path(__file__).parents[2] / "fixtures" / "sb3-pendulum.zip"
ANSWERS = {
    "sixel": {b"\x1b[c": b"\x1b[?62;4c", b"\x1b[16t": b"\x1b[6;20;10t"},
    "kitty": {b"\x1b[c": b"\x1b[?62;c", b"a=q": b"\x1b_Gi=1;OK\x1b\\", b"\x1b[16t": b"\x1b[6;20;10t"},
    "half blocks": {b"\x1b[c": b"\x1b[?62;c"},
}
PICTURES = {
    "sixel": rb'\x1bP0;0;0q"1;1;(\d+);\1',  # Pendulum's picture is square
    "kitty": rb"\x1b_Gi=\d+,m=0,f=100",
    "half blocks": "▀".encode() * 3,
}


@pytest.mark.parametrize(
    "kind",
    [
        "sixel",
        pytest.param("kitty", marks=pytest.mark.slow),
        pytest.param("half blocks", marks=pytest.mark.slow),
    ],
)
def test_pictures_come_by_what_the_terminal_can(kind: str, tmp_path: Path) -> None:
    environment = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES")}
    child: pexpect.spawn[bytes] = pexpect.spawn(
        sys.executable,
        ["-m", "pdtui", "drive", "Pendulum-v1", "--policy", str(POLICY), "--no-record"],
        dimensions=(40, 120),
        cwd=str(tmp_path),
        env={**environment, "TERM": "xterm-256color"},
    )
    answers = dict(ANSWERS[kind])
    got: bytes = b""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline and len(re.findall(PICTURES[kind], got)) < 2:
        try:
            got += child.read_nonblocking(65536, 0.2)
        except pexpect.TIMEOUT:
            continue
        for asked in [one for one in answers if one in got]:
            child.send(answers.pop(asked))
    pictures = len(re.findall(PICTURES[kind], got))
    child.send("q")
    child.expect("stopped: ", timeout=PATIENCE)
    child.close(force=True)
    assert pictures >= 2
    others = [name for name in ("sixel", "kitty") if name != kind]
    assert not any(re.search(PICTURES[name], got) for name in others)
