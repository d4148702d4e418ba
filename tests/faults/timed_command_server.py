"""A process that drives when it is told to.

Each recorder that it starts imports this module again, so that the heavy ones are imported in functions.
"""

from __future__ import annotations

import io
import json
import sys
import time
from contextlib import redirect_stderr, redirect_stdout
from itertools import pairwise
from pathlib import Path

from pdtui.core.processes.process_start import prepare_processes


def serve() -> None:
    """Run what comes down the pipe, each at its moment, and answer with how it ended."""
    # Recorders are forked from a server that has loaded them: those that load meanwhile, some seconds long,
    # would begin their files one after the other.
    prepare_processes("pdtui.sessions.writer.session_recorder")
    for line in sys.stdin:
        moment, arguments = json.loads(line)
        output, error = io.StringIO(), io.StringIO()
        with redirect_stdout(output), redirect_stderr(error):
            try:
                code = (
                    _record_numbered(moment, arguments) if "number" in arguments else _run(moment, arguments)
                )
            except SystemExit as ended:
                code = int(ended.code or 0)
        print(json.dumps([code, output.getvalue(), error.getvalue()]), flush=True)


def _run(moment: float, arguments: list[str]) -> int:
    from pdtui.cli import main

    _wait_until(moment)
    main(arguments, prog_name="pdtui")
    return 0


def _record_numbered(moment: float, arguments: list[str]) -> int:
    from pdtui.driving.drive_config import DriveConfig
    from pdtui.driving.loop_builder import build_control_loop
    from pdtui.sessions.writer.session_recorder import SessionRecorder
    from pdtui.stimulation.map_reader import load_map

    given = dict(pairwise(arguments))
    loop = build_control_loop(DriveConfig("ant", load_map(Path(given["--map"])), int(given["--seed"])))
    records = [loop.advance() for _ in range(int(given["--steps"]))]
    _wait_until(max(moment, time.monotonic()))
    with SessionRecorder(Path(given["--record"]), loop.info, existing="number") as recorder:
        for record in records:
            recorder.write(record)
    print(f"recorded in {recorder.path}")
    return 0


def _wait_until(moment: float) -> None:
    while time.monotonic() < moment:
        pass


if __name__ == "__main__":
    serve()
