"""The real Rerun viewer without a window, for tests that check what a user sees.

It needs a Vulkan driver; a software driver is enough (Debian: mesa-vulkan-drivers, libvulkan1). Without one,
these tests are skipped, unless the environment says PDTUI_VIEWER=required, as continuous integration does.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from rerun.experimental import ViewerClient, ViewerState

from pdtui.sessions.viewer.viewer_address import LOCAL, find_viewer

_PATIENCE = 120.0
"""Longest wait for the viewer, s."""
_NO_MATTER = ("Software rasterizer", "Failed to load examples")
_NO_DRIVER = ("No graphics adapter", "Failed to get render context")
ARTIFACTS = Path(os.environ.get("PDTUI_ARTIFACTS", Path(__file__).parents[1] / "test-artifacts"))
"""Where screenshots are kept."""


class NoDriverError(Exception):
    """The viewer has ended because it found no driver to draw with."""


class RealViewer:
    """A viewer in a process group of its own, which has drawn a frame.

    Without a driver the viewer answers first and ends when it is to draw, so only a drawn frame proves
    that it works.

    Args:
        port: A free port of this machine.

    Raises:
        NoDriverError: The viewer cannot draw on this machine.
        AssertionError: It ended for another reason, or did not answer.
    """

    def __init__(self, port: int) -> None:
        self.port = port
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 - it lives as long as the viewer
        command = [find_viewer(), "--headless", "--hide-welcome-screen", "--bind", LOCAL, "--port", str(port)]
        self._process = subprocess.Popen(
            command, stdout=self._log, stderr=subprocess.STDOUT, start_new_session=True
        )
        try:
            self.client = self._connect()
            self._draw_first_frame()
        except BaseException:
            self.kill()
            raise

    def show(self, path: Path) -> None:
        """Open a file and wait until it is loaded."""
        (opened,) = self.client.open(str(path.resolve())).store_ids
        self.wait_for(
            lambda state: state.active_recording == opened and bool(state.views) and not state.loading
        )

    def wait_for(self, condition: Callable[[ViewerState], bool]) -> ViewerState:
        """Wait until what the viewer shows meets a condition."""
        deadline = time.monotonic() + _PATIENCE
        while not condition(state := self.client.get_state()):
            assert time.monotonic() < deadline, f"not shown within {_PATIENCE:g} s: {state}"
            time.sleep(0.1)
        return state

    def view_names(self) -> list[str]:
        """What it shows, view by view; each has been painted."""
        return [view.name for view in self.client.get_state().views if view.visible]

    def picture(self, name: str, step: int | None = None) -> NDArray[np.uint8]:
        """Keep a screenshot and return it, shape (height, width, 3); no view may have reported anything.

        Args:
            name: of the file.
            step: control step at which the time cursor is put; None leaves it.
        """
        if step is not None:
            self.client.set_time("step", sequence=step, play_state="paused")
        ARTIFACTS.mkdir(parents=True, exist_ok=True)
        path = (ARTIFACTS / f"{name}.png").resolve()
        for _ in range(2):  # what a frame asks for is there in the next
            self.client.save_screenshot(str(path))
        complaints = {view.name: view.reports for view in self.client.get_state().views if view.reports}
        assert not complaints, complaints
        logged = [entry for entry in self.client.get_logs() if entry.level in ("WARN", "ERROR")]
        said = [entry for entry in logged if not any(one in entry.message for one in _NO_MATTER)]
        assert not said, said
        with Image.open(path) as picture:
            return np.asarray(picture.convert("RGB"))

    def signal(self, number: signal.Signals) -> None:
        """Send a signal to all of its processes."""
        os.killpg(self._process.pid, number)

    def kill(self) -> None:
        """End the viewer, and what it started, at once."""
        if self._process.poll() is None:
            self.signal(signal.SIGKILL)
        self._process.wait()

    def _connect(self) -> ViewerClient:
        deadline = time.monotonic() + _PATIENCE
        while time.monotonic() < deadline:
            if self._process.poll() is not None:
                raise self._death()
            try:
                socket.create_connection((LOCAL, self.port), 1.0).close()
                client = ViewerClient.connect(f"rerun+http://{LOCAL}:{self.port}/proxy")
                client.get_state()
            except (OSError, RuntimeError):
                time.sleep(0.1)
            else:
                return client
        raise AssertionError(f"the viewer did not answer within {_PATIENCE:g} s: {self._output()[-2000:]}")

    def _draw_first_frame(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            try:
                self.client.save_screenshot(str(Path(folder) / "first-frame.png"))
                self.client.get_state()
            except (OSError, RuntimeError):
                self._process.wait(_PATIENCE)
                raise self._death() from None

    def _death(self) -> Exception:
        """Return why the viewer has ended."""
        output = self._output()
        if any(words in output for words in _NO_DRIVER):
            return NoDriverError(
                "the Rerun viewer finds no Vulkan driver; mesa-vulkan-drivers is a software one"
            )
        return AssertionError(f"the viewer ended with code {self._process.returncode}: {output[-2000:]}")

    def _output(self) -> str:
        self._log.seek(0)
        return self._log.read().decode(errors="replace")


@contextmanager
def real_viewer() -> Iterator[RealViewer]:
    """Yield a viewer that is gone afterwards, whatever happens; skip the test where none can draw."""
    if reason := why_no_viewer():
        if os.environ.get("PDTUI_VIEWER") == "required":
            pytest.fail(reason)
        pytest.skip(reason)
    viewer = RealViewer(free_port())
    try:
        yield viewer
    finally:
        viewer.kill()


@cache
def why_no_viewer() -> str:
    """Return why the viewer cannot draw on this machine, or an empty string where it can; decided once."""
    try:
        RealViewer(free_port()).kill()
    except NoDriverError as error:
        return str(error)
    return ""


def free_port() -> int:
    """A port of this machine that nobody listens on."""
    with socket.create_server((LOCAL, 0)) as listener:
        port: int = listener.getsockname()[1]
        return port


def is_blank(picture: NDArray[np.uint8]) -> bool:
    """Whether nearly all of a picture is one color."""
    _, counts = np.unique(picture.reshape(-1, 3), axis=0, return_counts=True)
    return bool(counts.max() > 0.98 * counts.sum())
