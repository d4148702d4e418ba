"""Hostile files of every kind, given to the command line: each is refused in one line, and takes little."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hostile_files import Reading, list_hostile_files, run_pdtui, write_hostile_file

MEMORY = 1 << 30
PATIENCE = 300.0
"""Seconds; only what hangs takes them."""
QUICK = [("map", "too many behaviors"), ("map", "a period of 10³⁰⁸ s"), ("npz", "a shape of negative sizes")]
"""In the default suite; `tests/fuzz` reads the others' like without starting a process for each."""


def _check_refusal(reading: Reading) -> None:
    assert reading.seconds < PATIENCE
    assert reading.code in (1, 2), reading.error
    assert len(reading.error.splitlines()) == 1, reading.error
    assert reading.error.startswith("pdtui: ")
    assert len(reading.error) < 2000
    assert reading.memory < MEMORY


@pytest.mark.parametrize(("kind", "name"), QUICK)
def test_a_few_hostile_files_are_refused_in_one_line(kind: str, name: str, tmp_path: Path) -> None:
    _check_refusal(run_pdtui(write_hostile_file(tmp_path, kind, name).arguments, PATIENCE))


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "name"), [one for one in list_hostile_files() if one not in QUICK])
def test_every_hostile_file_is_refused_in_one_line(kind: str, name: str, tmp_path: Path) -> None:
    _check_refusal(run_pdtui(write_hostile_file(tmp_path, kind, name).arguments, PATIENCE))


LONG = "x" * 300
NAMES = [
    ("convert", LONG, "-o", "a.safetensors"),
    ("convert", "ant", "-o", LONG),
    ("drive", f"{LONG}.toml", "--headless"),
    ("drive", "ant", "--headless", "--policy", "x" * 250),
    ("drive", "ant", "--headless", "--keys", LONG),
    ("drive", "ant", "--headless", "--record", f"{LONG}.rrd"),
    ("sessions", "show", LONG),
    ("sessions", "list", LONG),
]


@pytest.mark.slow
@pytest.mark.parametrize("arguments", NAMES)
def test_names_that_no_file_can_have_are_refused_in_one_line(arguments: tuple[str, ...]) -> None:
    _check_refusal(run_pdtui(arguments))


def test_too_few_open_files_are_said_in_one_line() -> None:
    found = run_pdtui(("sessions", "list"), prefix=("sh", "-c", 'ulimit -n 12; exec "$@"', "sh"))
    assert found.error == "pdtui: expected at least 64 open files to be allowed (ulimit -n), found 12\n"
    assert found.code == 1
