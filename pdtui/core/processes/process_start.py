"""Starts processes: forked from a server that has loaded what they need, where the system can; else spawned.

Loading PyTorch and a simulator takes seconds. The server loads them once, in the background, and each process
that this one, or one of its processes, starts is then there at once. It does nothing else, so that what is
forked from it is as clean as what is spawned.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import forkserver, resource_tracker
from multiprocessing.process import BaseProcess
from typing import Any

_FORKS = sys.platform == "linux"  # elsewhere, system libraries may not survive a fork
_GROUP_SIGNALS = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
"""Signals that reach a whole group of processes. The server has to outlive those that it forked."""
_QUIET = {"RUST_LOG": "off"}
"""What libraries read when the server loads them, so that they do not print over the screen."""


def prepare_processes(*modules: str) -> None:
    """Start the server unless it runs, and have it load these modules; nobody waits for it.

    A server that runs keeps what it has loaded. Processes import what is missing themselves.
    """
    if not _FORKS or forkserver.get_inherited_fds() is not None:
        return
    forkserver.set_forkserver_preload(list(modules))
    resource_tracker.ensure_running()  # starting it lets the signals through again
    with _hold_back(_GROUP_SIGNALS):  # the server inherits this
        added = _QUIET.keys() - os.environ.keys()
        os.environ.update({name: _QUIET[name] for name in added})
        try:
            forkserver.ensure_running()
        finally:
            for name in added:
                del os.environ[name]


def start_process(name: str, module: str, target: Callable[..., object], *arguments: Any) -> BaseProcess:
    """Start a process, and leave Ctrl-C, which reaches the whole group, to this process.

    This waits until the server has loaded what it loads first.

    Args:
        name: name of the process.
        module: what the server loads first if it does not run yet.
        target: function of a module, which the process calls.
        arguments: arguments of the function.
    """
    prepare_processes(module)
    context: Any = multiprocessing.get_context("forkserver" if _FORKS else "spawn")
    process: BaseProcess = context.Process(
        target=_call_in, args=(dict(os.environ), target, arguments), name=name
    )
    # It is blocked from the first instruction on, so that no process prints a traceback.
    with _hold_back({signal.SIGINT}):
        process.start()
    return process


@contextmanager
def _hold_back(signals: set[signal.Signals]) -> Iterator[None]:
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signals)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _call_in(environment: dict[str, str], target: Callable[..., object], arguments: tuple[Any, ...]) -> None:
    """Call a function with the environment that the parent has now, which the server may not have had."""
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _GROUP_SIGNALS - {signal.SIGINT})
    for name in os.environ.keys() - environment.keys():
        del os.environ[name]
    os.environ.update(environment)
    if forkserver.get_inherited_fds() is not None:
        # Processes of this one come from the same server, as the library documents it. But the library looks
        # only for a server that this very process started, and would start another.
        vars(forkserver._forkserver)["ensure_running"] = _rely_on_server
    target(*arguments)


def _rely_on_server() -> None:
    """Do nothing: the server runs as long as any process that came from it."""
