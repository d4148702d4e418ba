"""`pdtui serve`: who gets in, and a drive in a real browser."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from pdtui.cli import main
from pdtui.sessions.session_header import read_session_header

pytest.importorskip("textual_serve", reason="needs pdtui[serve]")
ROOT = Path(__file__).parents[2]
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
PATIENCE = 120_000.0  # ms
EMPTY_PAGE = 20_000
"""More bytes than a picture of an empty page has, which are 11,000."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("served")


@pytest.fixture(scope="module")
def address(folder: Path) -> Iterator[str]:
    """The address of a served drive."""
    command = [sys.executable, "-m", "pdtui", "serve", "--port", "0", "drive", "ant", "--record", "drive.rrd"]
    environment = {**os.environ, "XDG_CONFIG_HOME": str(folder)}
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    with subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as server:
        try:
            assert server.stdout is not None
            said = server.stdout.readline()
            yield said.removeprefix("open ").strip()
        finally:
            os.killpg(server.pid, signal.SIGTERM)


def status(address: str) -> int:
    try:
        with urllib.request.urlopen(address, timeout=60) as response:
            return int(response.status)
    except urllib.error.HTTPError as error:
        return error.code


def test_only_the_address_with_the_secret_is_found(address: str) -> None:
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{43}/", address)
    root, token = address.rstrip("/").rsplit("/", 1)
    assert status(address) == 200
    assert status(f"{address}static/js/textual.js") == 200
    for path in ("/", "/ws", "/static/js/textual.js", f"/{token[:-1]}/", f"/{token[::-1]}/"):
        assert status(root + path) == 404


def test_the_page_asks_nothing_of_other_sites(address: str) -> None:
    with urllib.request.urlopen(address, timeout=60) as response:
        assert response.headers["Referrer-Policy"] == "no-referrer"
        assert "default-src 'self'" in response.headers["Content-Security-Policy"]


@pytest.mark.skipif(BROWSER is None, reason="needs Chromium, such as Debian's chromium")
def test_a_drive_in_a_browser(address: str, folder: Path) -> None:
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright, which drives Chromium")
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=BROWSER, args=["--no-sandbox", "--disable-gpu"])
        try:
            page = browser.new_page(viewport={"width": 1200, "height": 800})
            page.set_default_timeout(PATIENCE)
            page.goto(address, wait_until="commit")
            page.wait_for_selector("body.-first-byte")
            page.focus(".xterm-helper-textarea")  # where xterm.js listens to keys
            _wait_for_size(page, folder / "drive.rrd")
            page.keyboard.press("a")
            picture = _picture_of_drive(page)
            page.keyboard.press("q")
            page.wait_for_selector("body.-closed")
        finally:
            browser.close()
    assert picture[:8] == b"\x89PNG\r\n\x1a\n"
    assert len(picture) > EMPTY_PAGE
    header = read_session_header(folder / "drive.rrd")
    assert [event.key for event in header.events] == ["a"]
    assert header.outcome


def _picture_of_drive(page: Any) -> bytes:
    """Take pictures until the browser has drawn the screen."""
    picture = b""
    for _ in range(60):
        page.wait_for_timeout(2000)
        picture = page.screenshot()
        if len(picture) > EMPTY_PAGE:
            break
    return picture


def _wait_for_size(page: Any, path: Path) -> None:
    """Wait until the drive has recorded something, so that it takes keys."""
    for _ in range(600):
        if path.exists() and path.stat().st_size > 0:
            return
        page.wait_for_timeout(200)
    raise AssertionError(f"{path}: nothing was recorded")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["maps"], "pdtui maps has no screen to serve; available: drive, replay, guide"),
        (["replay", "x.rrd"], "pdtui replay has a screen only with --watch"),
        (["drive", "ant", "--headless"], "--headless has no screen to serve"),
        (["drive"], "Missing argument 'ROBOT'"),
        (["drive", "ant", "--nope"], "No such option"),
    ],
)
def test_what_has_no_screen_is_refused(arguments: list[str], said: str) -> None:
    result = CliRunner(env={"COLUMNS": "200"}).invoke(main, ["serve", *arguments])
    assert result.exit_code in (1, 2)
    assert said in result.output
