"""Damaged files of every kind: they are read or refused, and nothing else ever happens.

`pytest -m slow tests/fuzz` reads 10,000 of them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis.strategies import SearchStrategy

from pdtui.sessions.writer.session_recorder import SessionRecorder
from tests.fuzz.damage import Content, damaged, damaged_archive, damaged_session, damaged_weights, resealed
from tests.fuzz.foreign_policies import write_foreign_files
from tests.fuzz.reading import Reader
from tests.sessions.recorded_drives import events_of, make_loop, random_weights

KEYS = "# a drive\n3 w\n10 t\n20 space\n25 h\n25 left\n40 r\n"
SUITE = {"session": 200, "map": 150, "keys": 75, "weights": 75}
SUITE |= dict.fromkeys(("npz", "sb3", "torchscript", "statistics"), 15)
LONG = {kind: 20 * max(75, count) for kind, count in SUITE.items()}


@pytest.fixture(scope="module")
def good(map_text: str, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A good file of each kind; the session is short but has everything."""
    folder = tmp_path_factory.mktemp("good")
    paths = {kind: folder / f"good.{kind}" for kind in SUITE}
    paths["map"].write_text(map_text)
    paths["keys"].write_text(KEYS)
    random_weights(paths["weights"])
    write_foreign_files(paths)
    loop = make_loop(paths["weights"])
    info = replace(loop.info, map_text=map_text)
    with SessionRecorder(paths["session"], info, rows_per_write=8) as recorder:
        for step in range(24):
            recorder.write(loop.advance(events_of(step)))
    return paths


@pytest.fixture(scope="module")
def reader(map_path: Path) -> Iterator[Reader]:
    child = Reader(map_path)
    yield child
    child.close()


@pytest.mark.parametrize(
    ("kind", "count"),
    [*SUITE.items(), *(pytest.param(kind, count, marks=pytest.mark.slow) for kind, count in LONG.items())],
)
def test_damaged_files_are_read_or_refused(
    kind: str,
    count: int,
    good: dict[str, Path],
    reader: Reader,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert kind == "keys" or not reader.read(kind, good[kind]).startswith("it hangs")
    answers: Counter[str] = Counter()

    @settings(
        max_examples=count,
        derandomize=True,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(content=_strategy(kind, Content(good[kind].read_bytes())))
    def check(content: bytes) -> None:
        path = tmp_path / f"damaged.{kind}"
        path.write_bytes(content)
        answer = reader.read(kind, path).strip("'\"")
        answers[answer.partition(":")[0]] += 1
        if answer != "read" and not answer.startswith("refused: "):
            kept = path.rename(tmp_path / f"fault.{kind}")
            pytest.fail(f"{kind} file, kept as {kept}: {answer}")

    check()
    with capsys.disabled():
        print(
            f"\n{kind}: {answers.total()} inputs, {answers['read']} read, {answers['refused']} refused",
            end=" ",
        )
    assert answers.total() >= count
    assert answers["refused"] > count // 10


def test_good_files_are_read(good: dict[str, Path], reader: Reader) -> None:
    assert {kind: reader.read(kind, path) for kind, path in good.items()} == dict.fromkeys(SUITE, "'read'")


def test_checksums_that_are_computed_again_are_those_of_the_recorder(good: dict[str, Path]) -> None:
    content = good["session"].read_bytes()
    assert resealed(content) == content


def test_what_ends_the_reading_process_is_seen(reader: Reader, map_path: Path) -> None:
    assert "KeyError" in reader.read("no such kind", map_path)
    reader.close()
    assert reader.read("map", map_path) == "'read'"


def _strategy(kind: str, content: Content) -> SearchStrategy[bytes]:
    if kind == "session":
        return damaged_session(content)
    if kind in ("npz", "sb3", "torchscript"):
        return damaged_archive(content)
    return damaged_weights(content) if kind == "weights" else damaged(content)
