"""Drive a trained neural controller from a terminal by stimulating its hidden units.

From Python, use `load_policy`, `dissect`, `drive` and `replay`. PyTorch and the simulator are loaded when one
of them is first accessed, not when pdtui is imported.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pdtui.api import (
        QUICK_DISSECTION,
        Dissection,
        DissectionSettings,
        DriveArrays,
        ImportOptions,
        Policy,
        RobotSpec,
        dissect,
        drive,
        load_policy,
        replay,
    )

__version__ = "0.1.0"
__all__ = [
    "QUICK_DISSECTION",
    "Dissection",
    "DissectionSettings",
    "DriveArrays",
    "ImportOptions",
    "Policy",
    "RobotSpec",
    "__version__",
    "dissect",
    "drive",
    "load_policy",
    "replay",
]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'pdtui' has no attribute '{name}'")
    return getattr(import_module("pdtui.api"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
