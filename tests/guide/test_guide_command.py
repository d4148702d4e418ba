"""`pdtui guide` where there is no terminal."""

from __future__ import annotations

from click.testing import CliRunner

from pdtui.cli import main
from pdtui.guide.guide_pages import GUIDE_FOLDER, TOPICS


def test_piped_it_prints_markdown() -> None:
    result = CliRunner().invoke(main, ["guide", "maps"])
    assert result.exit_code == 0
    assert result.output == (GUIDE_FOLDER / "maps.md").read_text(encoding="utf-8")
    assert CliRunner().invoke(main, ["guide"]).output.startswith("# The pdtui guide\n")


def test_it_lists_its_topics() -> None:
    lines = CliRunner().invoke(main, ["guide", "--list"]).output.splitlines()
    assert [line.split()[0] for line in lines] == list(TOPICS)
    assert lines[1].endswith("  Driving")


def test_an_unknown_topic_is_one_line() -> None:
    result = CliRunner().invoke(main, ["guide", "nothing"])
    assert result.exit_code == 1
    assert result.output.startswith("pdtui: no topic 'nothing' in the guide; available: index, driving, ")
    assert result.output.count("\n") == 1
