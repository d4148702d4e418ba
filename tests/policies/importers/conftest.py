"""Where the reference weights are, and what the importers' tests share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

Reference = Callable[[str], Path]


@pytest.fixture(scope="session")
def reference() -> Reference:
    """Path of a reference file; skips where the folder is not there."""
    folders = [parent / "shared" / "reference" for parent in Path(__file__).parents]
    found = next((folder for folder in folders if folder.is_dir()), None)

    def path(name: str) -> Path:
        if found is None:
            pytest.skip("../shared/reference, the authors' weights, is not here")
        return found / name

    return path


@pytest.fixture
def observations() -> Callable[[int], NDArray[np.float32]]:
    """50 seeded observations of a length, some of them far out."""

    def draw(size: int) -> NDArray[np.float32]:
        return np.random.default_rng(5).normal(0, 2, (50, size)).astype(np.float32)

    return draw
