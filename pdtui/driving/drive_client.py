"""The screen's connection to a drive, which runs in another process."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import TYPE_CHECKING, Protocol

from pdtui.core.errors import PdtuiError
from pdtui.core.processes.process_start import prepare_processes, start_process
from pdtui.core.processes.worker_pool import describe_exit, end_with_parent
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot
from pdtui.driving.pacer import PaceRequest
from pdtui.driving.unit_bench.unit_search_snapshot import UnitSearchRequest
from pdtui.robots.robot_registry import find_own_robots

if TYPE_CHECKING:
    from pdtui.driving.drive_config import DriveConfig
    from pdtui.driving.live_spectra.spectra_snapshot import SpectraChoice

_SIMULATION = "pdtui.driving.drive_process"
"""Module that loads PyTorch and the recording library, which the screen's process does without."""
_LOADED_BY_PYARROW = "pandas"  # as soon as anything is recorded, where it is installed
_NOT_BEGUN = "stopped before the first step"
_PATIENCE = 60.0
"""Longest wait for the recording to be completed, s; after it, the process ends at once."""


class DriveConnection(Protocol):
    """The screen's end of the pipe to a drive."""

    def poll_message(self) -> DriveFacts | DriveSnapshot | None:
        """Return the next message, or None if none has arrived; the first is a `DriveFacts`.

        A call that returns a message asks for the next snapshot, so at most one is on its way. Once the
        simulation's process has ended, a `PdtuiError` says why.
        """

    def press_key(self, key: str) -> None:
        """Send a key or an edit that changes the run; it applies before the next control step."""

    def change_pace(self, request: PaceRequest) -> None:
        """Change the pace, which is no part of the run and is not recorded."""

    def toggle_ghost(self) -> None:
        """Turn the ghost on or off, which is no part of the run and is not recorded."""

    def seek(self, moment: int) -> None:
        """Pause, and show the moment at which so many control steps had been done.

        A replay that is watched goes on to a moment that is still to come, without its pace.
        """

    def choose_spectra(self, choice: SpectraChoice | None) -> None:
        """Have snapshots bring spectrograms of an attribute and a unit, or none."""

    def branch(self) -> None:
        """Begin a drive, with a recording of its own, that goes on from the moment that is shown."""

    def search_units(self, request: UnitSearchRequest) -> None:
        """Search for units that change an attribute from now on, which is no part of the run either."""

    def close(self) -> str:
        """End the drive, wait until its recording is complete, and return one line on how it ended."""


def prepare_simulation(robot: str = "") -> None:
    """Load what a drive needs in the background, and one of pdtui's own robots, so that it starts sooner."""
    module = find_own_robots().get(robot)
    prepare_processes(_SIMULATION, *filter(None, (module,)), _LOADED_BY_PYARROW)


def _simulate(connection: Connection, config: DriveConfig) -> None:
    # The recording library would print over the screen when the disk is full or a viewer has gone.
    os.environ.setdefault("RUST_LOG", "off")
    # The drive ends by itself once the screen has gone, unless its world is stuck in a step.
    threading.Thread(target=end_with_parent, args=(_PATIENCE,), daemon=True).start()
    from pdtui.driving import drive_process

    drive_process.serve_drive(connection, config)


class DriveClient(DriveConnection):
    """Starts the simulation's process; create it before the screen takes over the terminal."""

    def __init__(self, config: DriveConfig) -> None:
        self._connection, theirs = multiprocessing.Pipe()
        self._process: BaseProcess | None = None
        self._last_words = ""
        self.failed = False
        """Whether the drive ended with an error; set by `close`."""
        self._asked = self._started = False
        self._first: DriveFacts | None = None
        self.recording = ""
        """File that the drive is recorded into; empty until it was created."""
        prepare_simulation(config.robot)
        # The screen need not wait until PyTorch is loaded.
        self._starter = threading.Thread(target=self._start, args=(theirs, config), daemon=True)
        self._starter.start()

    @property
    def pid(self) -> int:
        """Process id of the simulation; waits until it has one."""
        self._starter.join()
        return (self._process and self._process.pid) or 0

    @property
    def is_pictured(self) -> bool:
        """Whether the world is shown by pictures; known once the drive has started."""
        return self._first is not None and self._first.pictured

    def wait_until_started(self) -> None:
        """Wait until robot, policy and recording are ready; a `PdtuiError` says what cannot be loaded."""
        while self._first is None:
            message = self._receive(timeout=0.1)
            if isinstance(message, PdtuiError):
                raise message
            if isinstance(message, str):
                self._last_words = message
                raise PdtuiError(message)
            if isinstance(message, DriveFacts):
                self._first = message

    def poll_message(self) -> DriveFacts | DriveSnapshot | None:
        first, self._first = self._first, None
        message = first or self._receive()
        self._started = self._started or isinstance(message, DriveFacts)
        if isinstance(message, DriveFacts) and message.recorded:
            self.recording = message.recording
        if isinstance(message, DriveFacts) or (message is None and not self._asked):
            self._send("frame", None)
            self._asked = True
        elif isinstance(message, DriveSnapshot):
            self._send("frame", None)
        if isinstance(message, PdtuiError):
            raise message
        if isinstance(message, str):
            self._last_words = message
            raise PdtuiError(message)
        return message

    def press_key(self, key: str) -> None:
        self._send("press", key)

    def change_pace(self, request: PaceRequest) -> None:
        self._send("pace", request)

    def toggle_ghost(self) -> None:
        self._send("ghost", None)

    def seek(self, moment: int) -> None:
        self._send("seek", moment)

    def choose_spectra(self, choice: SpectraChoice | None) -> None:
        self._send("spectra", choice)

    def branch(self) -> None:
        self._send("branch", None)

    def search_units(self, request: UnitSearchRequest) -> None:
        self._send("search", request)

    def close(self) -> str:
        self._send("close", None)
        process = self._process
        if process is None:  # it will find its screen gone
            self._connection.close()
            return self._last_words or _NOT_BEGUN
        if not (self._started or self._first):
            process.terminate()  # what is still loading records nothing; a begun drive ends as usual
        deadline = time.monotonic() + _PATIENCE
        while not self._last_words and time.monotonic() < deadline:
            try:
                message = self._receive(timeout=0.1)
            except PdtuiError as error:
                message = error
            if isinstance(message, str | PdtuiError):
                self._last_words, self.failed = str(message), isinstance(message, PdtuiError)
            elif message is None and not process.is_alive():
                break
        process.join(timeout=max(0.0, deadline - time.monotonic()))
        if process.is_alive():
            process.kill()
            process.join()
        self._connection.close()
        if not (self._last_words or self._started) and process.exitcode == -signal.SIGTERM:
            self._last_words = _NOT_BEGUN
        return self._last_words or self._describe_death()

    def _start(self, theirs: Connection, config: DriveConfig) -> None:
        try:
            self._process = start_process("pdtui simulation", _SIMULATION, _simulate, theirs, config)
        except OSError as error:
            self._last_words = f"the simulation's process cannot be started: {error}"
        finally:
            theirs.close()

    def _receive(self, timeout: float = 0.0) -> DriveFacts | DriveSnapshot | PdtuiError | str | None:
        try:
            if not self._connection.poll(timeout):
                return None
            message: DriveFacts | DriveSnapshot | PdtuiError | str = self._connection.recv()
        except (EOFError, OSError):
            return PdtuiError(self._describe_death())
        return message

    def _send(self, kind: str, value: str | int | SpectraChoice | UnitSearchRequest | None) -> None:
        try:
            self._connection.send((kind, value))
        except OSError:
            return  # the process is gone; the next poll says why

    def _describe_death(self) -> str:
        self._starter.join()
        if self._process is None:
            return self._last_words
        line = f"the simulation's process {describe_exit(self._process)}"
        return f"{line}; the recording up to then is in {self.recording}" if self.recording else line
