"""Versions of the machine and the libraries, on which a bit-identical replay may depend."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from pdtui.core.processes.installed_packages import PACKAGES, list_package_versions

COMPUTES_NOTHING = ("system", "rerun-sdk")
"""Entries that may differ without affecting any number of a run."""


def collect_versions() -> dict[str, str]:
    """Collect the versions of the interpreter and the libraries, and a description of the machine.

    Packages that are not installed are left out.
    """
    return {
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.release()}",
        "machine": platform.machine(),
        "cpu": _cpu_name(),
        "blas": _blas_name(),
        "kernels": _kernels_name(),
        **list_package_versions(),
    }


def version_differences(a: Mapping[str, str], b: Mapping[str, str]) -> Iterator[tuple[str, str, str]]:
    """Yield name, version there and version here of whatever differs; a missing version is ``absent``."""
    for name in dict.fromkeys((*a, *b)):
        if a.get(name) != b.get(name):
            yield name, a.get(name, "absent"), b.get(name, "absent")


def list_version_differences(
    a: Mapping[str, str], b: Mapping[str, str], *, numeric: bool = False
) -> list[str]:
    """List the differences between two environments, such as ``numpy: 2.2.0 there, 2.3.1 here``.

    A package that a session does not name took no part in its drive, or was not looked for by the version of
    pdtui that recorded it, and is left out.

    Args:
        a: the versions there, from a session.
        b: the versions here.
        numeric: whether to list only what can affect the numbers of a run.
    """
    return [
        f"{name}: {there} there, {here} here"
        for name, there, here in version_differences(a, b)
        if not (numeric and name in COMPUTES_NOTHING) and not (name in PACKAGES and name not in a)
    ]


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
    chosen = os.environ.get("OPENBLAS_CORETYPE")  # other instructions sum in another order
    return f"{name}, {chosen}" if chosen else name


def _kernels_name() -> str:
    """Return the instruction set that torch uses, which determines the order in which a policy sums."""
    torch = sys.modules.get("torch")  # where it is not loaded, it computes nothing
    return torch.backends.cpu.get_cpu_capability() if torch is not None else "none"
