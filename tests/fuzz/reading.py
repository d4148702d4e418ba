"""A process that reads damaged files, so that one which takes it down is seen as a failing test."""

from __future__ import annotations

import resource
import select
import subprocess
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from pdtui.core.errors import PdtuiError

if TYPE_CHECKING:
    from pdtui.policies.foreign.reader_process import ForeignFile

SECONDS = 30
"""What reads so long hangs."""
MEMORY = 1 << 30
"""Bytes of memory that reading one small file may take beyond what the process had."""
_ADDRESSES = 32 << 30  # a last line, so that a fault here does not take the machine's memory


class Reader:
    """Reads files in a child process, which is started anew when a file has ended it.

    Args:
        map_path: the map that keystroke files are read for.
    """

    def __init__(self, map_path: Path) -> None:
        self._map_path = map_path
        self._child: subprocess.Popen[str] | None = None

    def read(self, kind: str, path: Path) -> str:
        """Read a file: ``read``, ``refused: …`` with the error's message, or what else happened."""
        if self._child is None:
            self._child = subprocess.Popen(
                [sys.executable, "-m", "tests.fuzz.reading", str(self._map_path)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
            self._answer()
        assert self._child.stdin is not None
        print(kind, path, file=self._child.stdin, flush=True)
        return self._answer()

    def close(self) -> None:
        """End the child."""
        if self._child is not None:
            self._child.kill()
            self._child.communicate()
            self._child = None

    def _answer(self) -> str:
        assert self._child is not None
        assert self._child.stdout is not None
        if not select.select([self._child.stdout], [], [], SECONDS)[0]:
            self.close()
            return f"it hangs: no answer in {SECONDS} s"
        line = self._child.stdout.readline()
        if not line:
            code = self._child.wait()
            self.close()
            return f"the process ended with {code}"
        return line.strip()


def read_session_file(path: Path) -> None:
    """Everything that a command does with a session before it simulates."""
    from rich.console import Console

    from pdtui.cli.output.session_tables import session_comparison_table, session_details
    from pdtui.driving.keystrokes import format_keystrokes
    from pdtui.driving.session_replay import config_from_session
    from pdtui.sessions.comparison.session_comparison import compare_sessions
    from pdtui.sessions.drive_path import compare_drive_paths, read_drive_path
    from pdtui.sessions.session_header import read_session_header
    from pdtui.sessions.session_integrity import examine_session
    from pdtui.sessions.session_reader import read_activations, read_session
    from pdtui.sessions.session_repair import repair_session
    from pdtui.sessions.session_summary import summarize_session

    with suppress(PdtuiError):
        read_session_header(path)
    output = path.with_name("repaired.rrd")
    try:
        session = read_session(path)
    except PdtuiError:
        if examine_session(path).steps:
            repair_session(path, output)
            assert examine_session(output).whole
        raise
    read_activations(path)
    examine_session(path)
    with Path("/dev/null").open("w") as nowhere:
        console = Console(file=nowhere)
        console.print(session_details(session, summarize_session(session)))
        course = read_drive_path(session)
        paths = compare_drive_paths(course, course, 0)
        console.print(session_comparison_table(compare_sessions(session, session), (session, session), paths))
    format_keystrokes(session.events)
    config_from_session(session, str(path))


def _read_policy(path: Path) -> None:
    """Read a policy of another program as its own process does, here, where a fault in it is seen."""
    from pdtui.policies.importers import import_network
    from pdtui.policies.weights.import_options import ImportOptions

    import_network(_read_content(path, "policy"), ImportOptions("tanh", "none"))


def _read_torchscript(path: Path) -> None:
    from pdtui.policies.runtime.policy import Policy
    from pdtui.policies.torchscript import build_torchscript

    Policy(build_torchscript(_read_content(path, "policy")), 3).act(np.zeros(3))


def _read_statistics(path: Path) -> None:
    from pdtui.policies.foreign.reader_process import ForeignFile

    found = _read_content(path, "statistics")
    assert isinstance(found, ForeignFile)


def _read_content(path: Path, content: Literal["policy", "statistics"]) -> ForeignFile:
    from pdtui.core.untrusted_file import FOREIGN_POLICY_BUDGET, STATISTICS_BUDGET
    from pdtui.policies.foreign.__main__ import READERS, pack_content
    from pdtui.policies.foreign.reader_process import unpack_content

    limit = (FOREIGN_POLICY_BUDGET if content == "policy" else STATISTICS_BUDGET).bytes
    try:
        return unpack_content(pack_content(READERS[content](path.read_bytes(), limit), "", limit), str(path))
    except RecursionError as error:  # refused by the process, too
        raise PdtuiError("too deeply nested") from error


def _reads(map_path: Path) -> dict[str, Callable[[Path], object]]:
    from pdtui.driving.keystrokes import read_keystrokes
    from pdtui.policies.weights.policy_loading import load_policy
    from pdtui.stimulation.map_policy_lookup import resolve_map_policy
    from pdtui.stimulation.map_reader import load_map

    known = load_map(map_path)
    return {
        "session": read_session_file,
        "map": lambda path: resolve_map_policy(load_map(path)),
        "keys": lambda path: read_keystrokes(path, known),
        "weights": load_policy,
        "npz": _read_policy,
        "sb3": _read_policy,
        "torchscript": _read_torchscript,
        "statistics": _read_statistics,
    }


def _serve(map_path: Path) -> None:
    reads = _reads(map_path)
    resource.setrlimit(resource.RLIMIT_AS, (_ADDRESSES, _ADDRESSES))
    print("ready", flush=True)
    for line in sys.stdin:
        kind, _, path = line.strip().partition(" ")
        before = _peak()
        try:
            reads[kind](Path(path))
            answer = "read"
        except PdtuiError as error:
            answer = f"refused: {error}"
        except BaseException as error:
            where = traceback.extract_tb(error.__traceback__)[-5:]
            answer = (
                f"{type(error).__name__}: {error} at {[(one.filename[-30:], one.lineno) for one in where]}"
            )
        if _peak() - before > MEMORY:
            answer = f"it took {_peak() - before} bytes of memory"
        print(ascii(answer), flush=True)


def _peak() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


if __name__ == "__main__":
    _serve(Path(sys.argv[1]))
