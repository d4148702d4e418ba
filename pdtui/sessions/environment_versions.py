"""What a bit-identical replay may depend on besides the session: machine and libraries."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

PACKAGES = ("pdtui", "mujoco", "gymnasium", "torch", "numpy", "simple-pid", "rerun-sdk")
COMPUTES_NOTHING = ("system", "rerun-sdk")
"""What may differ without any number of a run being computed in another way."""


def collect_versions() -> dict[str, str]:
    """Versions of the interpreter and the libraries, and what is known of the machine.

    A package that is not installed is left out.
    """
    found = {
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.release()}",
        "machine": platform.machine(),
        "cpu": _cpu_name(),
        "blas": _blas_name(),
        "kernels": _kernels_name(),
    }
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def list_version_differences(a: Mapping[str, str], b: Mapping[str, str]) -> list[str]:
    """What differs between two environments, one line each, such as ``numpy: 2.2.0 there, 2.3.1 here``.

    Args:
        a: there, as a session holds it.
        b: here.
    """
    return [
        f"{name}: {a.get(name, 'absent')} there, {b.get(name, 'absent')} here"
        for name in dict.fromkeys((*a, *b))
        if a.get(name) != b.get(name)
    ]


def list_numeric_version_differences(a: Mapping[str, str], b: Mapping[str, str]) -> list[str]:
    """Those of `list_version_differences` that can change a bit of a run."""
    return list_version_differences(
        *({name: value for name, value in one.items() if name not in COMPUTES_NOTHING} for one in (a, b))
    )


def _cpu_name() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, "") or platform.processor() or "unknown"


def _blas_name() -> str:
    config = np.show_config(mode="dicts")
    blas = config.get("Build Dependencies", {}).get("blas", {}) if isinstance(config, dict) else {}
    name = f"{blas.get('name', 'unknown')} {blas.get('version', '')}".strip()
    chosen = os.environ.get("OPENBLAS_CORETYPE")  # another processor's instructions sum in another order
    return f"{name}, {chosen}" if chosen else name


def _kernels_name() -> str:
    """The instructions that torch computes with: they decide in which order a policy sums."""
    torch = sys.modules.get("torch")  # nothing is computed by it where it is not loaded
    return torch.backends.cpu.get_cpu_capability() if torch is not None else "none"
