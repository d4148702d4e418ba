"""Versions of the packages on which the numbers of a run depend."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

PACKAGES = (
    "pdtui", "mujoco", "pybullet", "box2d", "metadrive-simulator", "panda3d", "gymnasium", "torch", "numpy",
    "simple-pid", "rerun-sdk",
)  # fmt: skip


def list_package_versions() -> dict[str, str]:
    """Return the versions of those of `PACKAGES` that are installed."""
    found = {}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found
