"""The fixture that keeps drives as tests, used as its documentation says."""

from __future__ import annotations

import inspect
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
import torch

from pdtui import pytest_plugin
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.headless_drive import drive_headless
from pdtui.driving.loop_builder import build_control_loop
from pdtui.policies.runtime.policy import Policy
from pdtui.policies.weights.weights_file import load_network, save_network
from pdtui.sessions.writer.session_recorder import SessionRecorder
from pdtui.stimulation.map_reader import load_map

pytest_plugins = ["pytester"]


@pytest.fixture
def suite(pytester: pytest.Pytester, map_path: Path, weights: Path) -> pytest.Pytester:
    """The example of the documentation, pasted, with a session and a policy beside it."""
    loop = build_control_loop(DriveConfig("ant", load_map(map_path), 3))
    session = pytester.path / "sessions" / "walk.rrd"
    drive_headless(loop, {10: ["w"]}, 40, SessionRecorder(session, loop.info))
    (pytester.path / "my_policy.safetensors").write_bytes(weights.read_bytes())
    document = inspect.getdoc(pytest_plugin)
    assert document is not None
    example = document.partition("Example::\n\n")[2].partition("\n\nA failing test")[0]
    (pytester.path / "test_walk.py").write_text(textwrap.dedent(example))
    return pytester


def test_the_example_passes_and_fails_with_a_changed_policy(suite: pytest.Pytester) -> None:
    result = suite.runpytest_subprocess("-p", "pdtui.pytest_plugin")
    result.assert_outcomes(passed=1)
    path = suite.path / "my_policy.safetensors"
    network = load_network(path)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.mul_(1.001)
    save_network(path, network)
    result = suite.runpytest_subprocess("-p", "pdtui.pytest_plugin")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        ["*walk.rrd: differs: step 0 of 40: * is off by *", "*: off by * there, by up to *"]
    )


def test_a_missing_session_is_named(pytester: pytest.Pytester) -> None:
    pytester.makepyfile("def test_gone(pdtui_session):\n    pdtui_session('gone.rrd')")
    result = pytester.runpytest_subprocess("-p", "pdtui.pytest_plugin")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*gone.rrd: cannot be replayed: *no such file"])


def test_loading_the_plugin_loads_nothing_heavy() -> None:
    heavy = ("torch", "mujoco", "rerun", "pyarrow", "gymnasium")
    code = f"import sys, pdtui.pytest_plugin; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_the_policy_may_be_live(suite: pytest.Pytester, policy: Policy) -> None:
    (suite.path / "test_walk.py").write_text(
        "import pdtui\n"
        "def test_live(pdtui_session):\n"
        "    network = pdtui.load_policy('my_policy.safetensors')\n"
        "    assert pdtui_session('sessions/walk.rrd', policy=network).identical\n"
    )
    suite.runpytest_subprocess("-p", "pdtui.pytest_plugin").assert_outcomes(passed=1)
