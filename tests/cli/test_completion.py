"""Completion as a shell does it: Bash really completes, in a terminal."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pexpect
import pytest
from click.testing import CliRunner

from pdtui.cli import main

PATIENCE = 120.0

BASH = shutil.which("bash")
needs_bash = pytest.mark.skipif(BASH is None, reason="needs bash")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a session, the program `pdtui` and its script for Bash."""
    folder = tmp_path_factory.mktemp("shell")
    program = folder / "pdtui"
    start = "import sys; sys.argv[0] = 'pdtui'; from pdtui.cli import main; main()"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -c "{start}" "$@"\n')
    program.chmod(0o755)
    (folder / "sessions").mkdir()
    (folder / "sessions" / "walk-home.rrd").write_bytes(b"")
    (folder / "notes.txt").write_text("")
    script = CliRunner().invoke(main, ["completion", "bash"]).output
    (folder / "completion.sh").write_text(script)
    return folder


def environment(folder: Path) -> dict[str, str]:
    return {
        **os.environ,
        "PATH": f"{folder}:{os.environ['PATH']}",
        "XDG_CONFIG_HOME": str(folder),
        "PYTHONPATH": str(Path(__file__).parents[2]),
        "INPUTRC": "/dev/null",
        "TERM": "dumb",
    }


def complete(folder: Path, *words: str) -> list[str]:
    """What Bash's completion offers for the last of the words."""
    quoted = " ".join(f"'{word}'" for word in ("pdtui", *words))
    commands = (
        f"source completion.sh; COMP_WORDS=({quoted}); COMP_CWORD={len(words)}; "
        '_pdtui_completion pdtui; printf "%s\\n" "${COMPREPLY[@]}"'
    )
    assert BASH is not None
    result = subprocess.run(
        [BASH, "--norc", "-c", commands],
        capture_output=True,
        text=True,
        check=True,
        cwd=folder,
        env=environment(folder),
        timeout=PATIENCE,
    )
    return result.stdout.split("\n")[:-1]


@needs_bash
@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (("dri",), ["drive"]),
        (("drive", "bip"), ["bipedal_walker"]),
        (("drive", "ant", "--map", "ant-"), ["ant-imprints"]),
        (("drive", "ant", "--pol"), ["--policy"]),
        (("drive", "a1", "--start", "for"), ["forest"]),
        (("tune", "ant", "hold\\ h"), ["hold\\ heading"]),
        (("tune", "ant", "hold\\ heading", "hold"), ["hold\\ speed"]),
        (("replay", "sessions/w"), ["sessions/walk-home.rrd"]),
        (("sessions", "sh"), ["show"]),
        (("sessions", "show", ""), ["sessions/walk-home.rrd"]),
        (("guide", "driv"), ["driving"]),
    ],
    ids=" ".join,
)
def test_names_are_offered(folder: Path, words: tuple[str, ...], offered: list[str]) -> None:
    found = complete(folder, *words)
    assert found[: len(offered)] == offered


@pytest.fixture
def shell(folder: Path) -> Iterator[pexpect.spawn[str]]:
    assert BASH is not None
    child = pexpect.spawn(
        BASH,
        ["--norc", "--noprofile", "-i"],
        cwd=str(folder),
        encoding="utf-8",
        env=environment(folder),
        timeout=PATIENCE,
        dimensions=(24, 120),
    )
    child.sendline("PS1='ready> '; source completion.sh; echo sourced")
    child.expect("\nsourced")
    child.expect("ready> ")
    yield child
    child.close(force=True)


@needs_bash
def test_tab_completes_in_a_terminal(shell: pexpect.spawn[str]) -> None:
    shell.send("pdtui drive bip\t")
    shell.expect("pdtui drive bipedal_walker ")
    shell.sendcontrol("u")
    shell.send("pdtui tune ant hold\\ h\t")
    shell.expect(r"\\ heading ")


@needs_bash
def test_tab_completes_files_where_no_name_fits(shell: pexpect.spawn[str]) -> None:
    shell.send("pdtui drive not\t")
    shell.expect("notes.txt")


@pytest.mark.parametrize("shell_name", ["bash", "zsh", "fish"])
def test_every_shell_has_a_script(shell_name: str) -> None:
    result = CliRunner().invoke(main, ["completion", shell_name])
    assert result.exit_code == 0
    assert f"_PDTUI_COMPLETE={shell_name}_complete" in result.output


def test_another_shell_is_refused() -> None:
    result = CliRunner().invoke(main, ["completion", "tcsh"])
    assert result.exit_code == 2
    assert "'bash', 'zsh', 'fish'" in result.output
