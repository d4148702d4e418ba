"""The built wheel, away from the checkout, brings its map, its weights and its samples."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder into which nothing but the wheel was unpacked."""
    dist, site = tmp_path_factory.mktemp("dist"), tmp_path_factory.mktemp("site")
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(dist), str(CHECKOUT)]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = dist.glob("*.whl")
    install = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--no-deps",
        "--quiet",
        "--target",
        str(site),
        str(wheel),
    ]
    subprocess.run(install, check=True, capture_output=True)
    return site


def _run(site: Path, folder: Path, *arguments: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(site)}
    result = subprocess.run(
        [sys.executable, "-P", *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_the_wheel_drives_the_ant(installed: Path, tmp_path: Path) -> None:
    where = _run(installed, tmp_path, "-c", "import pdtui; print(pdtui.__file__)")
    assert Path(where.strip()).is_relative_to(installed)
    said = _run(installed, tmp_path, "-m", "pdtui", "drive", "ant", "--headless", "--steps", "50")
    assert "50 steps, 2.5 s simulated" in said


def test_the_wheel_brings_the_samples(installed: Path, tmp_path: Path) -> None:
    code = "from pdtui.stimulation.map_library import shipped_folder; print(shipped_folder('sessions'))"
    shipped = Path(_run(installed, tmp_path, "-c", code).strip())
    assert shipped.is_relative_to(installed)
    assert list(shipped.glob("samples/*.rrd"))


def test_the_wheel_brings_the_guide(installed: Path, tmp_path: Path) -> None:
    assert _run(installed, tmp_path, "-m", "pdtui", "guide", "driving").startswith("# Driving\n")
    assert (installed / "pdtui" / "guide" / "images" / "headings.png").stat().st_size > 100_000
