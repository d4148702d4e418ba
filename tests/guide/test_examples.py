"""The examples of the README and the guide: commands exist, maps are maps, Python runs."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

import pdtui
from pdtui.cli import main
from pdtui.guide.guide_pages import GUIDE_FOLDER
from pdtui.stimulation.map_reader import parse_map
from tests.guide.guide_markdown import CHECKOUT, PAGES, CodeExample, code_examples

EXAMPLES = [example for page in PAGES for example in code_examples(page)]
REFERENCES = ("commands.md", "python.md")
QUICK = ("drive ant --headless", "guide", "replay", "sessions")
"""Beginnings of the commands that are not only checked but run."""


def commands_of(example: CodeExample) -> Iterator[list[str]]:
    """The `pdtui` commands of an example, split into words."""
    for line in example.text.splitlines():
        for part in line.split("#")[0].split("&&"):
            words = shlex.split(part)
            if words and Path(words[0]).name == "pdtui":
                yield words[1:]


def check_command(words: list[str], *, whole: bool) -> None:
    """Parse a command as click would, without running it.

    Args:
        words: after `pdtui`.
        whole: nothing may be missing; otherwise only commands and options have to exist.

    Raises:
        click.ClickException: a command, an option or an argument does not exist.
    """
    group: click.Command = main
    context = click.Context(main, info_name="pdtui", **main.context_settings)
    rest = list(words)
    while isinstance(group, click.Group) and rest and not rest[0].startswith("-"):
        name, *rest = rest
        found = group.get_command(context, name)
        if found is None:
            raise click.UsageError(f"no command '{name}'")
        group, context = found, click.Context(found, parent=context, info_name=name)
    if whole and not isinstance(group, click.Group):
        group.make_context(context.info_name, rest, parent=context.parent)
    known = {name for parameter in group.get_params(context) for name in parameter.opts}
    for word in rest:
        if word.startswith("-") and word not in known:
            raise click.NoSuchOption(word)


COMMANDS = [
    (example.page, example.line, words, example.language == "sh")
    for example in EXAMPLES
    if example.page != "commands.md" and example.language in ("", "sh")
    for words in commands_of(example)
]


@pytest.mark.parametrize(("page", "line", "words", "whole"), COMMANDS, ids=str)
def test_commands_exist(page: str, line: int, words: list[str], whole: bool) -> None:
    check_command(words, whole=whole)


@pytest.mark.parametrize(
    "line", ["pdtui fly ant", "pdtui drive ant --wings 2", "pdtui replay", "pdtui sessions sing"]
)
def test_a_command_that_does_not_exist_is_found(line: str) -> None:
    (words,) = commands_of(CodeExample("page", 1, "sh", line))
    with pytest.raises(click.ClickException):
        check_command(words, whole=True)


def test_there_are_commands_and_examples_to_check() -> None:
    assert len(COMMANDS) > 60
    assert {example.language for example in EXAMPLES} >= {"sh", "python", "toml"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A working directory with what the examples name.

    The sessions are recorded here: a shipped sample repeats bit for bit only where it was recorded.
    """
    folder = tmp_path_factory.mktemp("guide")
    shutil.copytree(CHECKOUT / "maps", folder / "maps")
    keys = next(example.text for example in EXAMPLES if example.text.startswith("# keys.txt"))
    (folder / "keys.txt").write_text(keys)
    walk = pdtui.drive("ant", keys={20: "x"}, steps=100, record=folder / "sessions" / "walk.rrd")
    assert len(walk) == 100
    (folder / "sessions" / "samples").mkdir()
    shutil.copy(folder / "sessions" / "walk.rrd", folder / "sessions" / "samples" / "ant.rrd")
    return folder


def quick_commands() -> list[list[str]]:
    """Quick commands whose files there are; a drive comes before what looks at it."""
    lines = {
        shlex.join(words): words
        for example in EXAMPLES
        if example.language == "sh"
        for words in commands_of(example)
        if shlex.join(words).startswith(QUICK)
        and "--watch" not in words
        and words[:2] != ["sessions", "open"]
    }
    return sorted(lines.values(), key=lambda words: words[0] != "drive")


def test_quick_commands_run(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    commands = quick_commands()
    assert len(commands) >= 8
    for words in commands:
        result = CliRunner().invoke(main, words)
        expected = 3 if words[:2] == ["sessions", "compare"] else 0  # the two drives of the guide differ
        assert result.exit_code == expected, (words, result.output)
    assert (folder / "a.parquet").stat().st_size > 0


PYTHON = [
    example
    for example in EXAMPLES
    if example.language == "python" and example.page not in (*REFERENCES, "your-world.md")
]


@pytest.mark.parametrize("example", PYTHON, ids=lambda example: f"{example.page}:{example.line}")
def test_python_runs(example: CodeExample, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A block runs as it is; one that is a test runs under pytest, on a policy that there is."""
    monkeypatch.chdir(folder)
    if "def test_" not in example.text:
        exec(compile(example.text, f"{example.page}:{example.line}", "exec"), {})
        return
    Path("test_walk.py").write_text(example.text.replace("my_policy.safetensors", "ant"))
    command = [sys.executable, "-m", "pytest", "-q", "-p", "pdtui.pytest_plugin", "test_walk.py"]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize(
    "example",
    [example for example in EXAMPLES if example.language == "toml"],
    ids=lambda example: f"{example.page}:{example.line}",
)
def test_toml_is_valid(example: CodeExample) -> None:
    tomllib.loads(example.text)
    if "schema" in example.text:
        parse_map(example.text, f"{example.page}:{example.line}")


def test_the_guide_names_every_field_of_a_map() -> None:
    """The fields that the reader of maps asks for, against the tables of the page."""
    room = CHECKOUT / "pdtui" / "stimulation"
    readers = (*room.glob("*_reader.py"), *room.glob("interventions/*_reader.py"))
    asked = r'\.(?:take|text|texts|choice|number|numbers|number_list|table|tables)\(\s*"(\w+)"'
    fields = {field for path in readers for field in re.findall(asked, path.read_text(encoding="utf-8"))}
    assert len(fields) > 40
    pages = (GUIDE_FOLDER / f"{name}.md" for name in ("maps", "interventions"))
    page = "\n".join(path.read_text(encoding="utf-8") for path in pages)
    shown = ("`{}`", "[{}]", "[[{}]]", "{} = ")  # in a table, as a header, or in an example
    assert not {field for field in fields if not any(form.format(field) in page for form in shown)}
