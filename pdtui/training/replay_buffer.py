"""A ring buffer of transitions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdtui.training.sac import TransitionBatch


class ReplayBuffer:
    """The last `capacity` transitions, sampled uniformly with replacement."""

    def __init__(self, capacity: int, observations: int, actions: int) -> None:
        self.capacity, self.count = capacity, 0
        self.arrays = TransitionBatch(
            np.zeros((capacity, observations), np.float32),
            np.zeros((capacity, actions), np.float32),
            np.zeros(capacity, np.float32),
            np.zeros(capacity, np.float32),
            np.zeros((capacity, observations), np.float32),
        )

    @property
    def size(self) -> int:
        return min(self.count, self.capacity)

    def add(self, rows: TransitionBatch) -> None:
        """Append transitions, leading axis (n,)."""
        places = (self.count + np.arange(len(rows.reward))) % self.capacity
        for array, new in zip(self.arrays, rows, strict=True):
            array[places] = new
        self.count += len(places)

    def sample(self, rng: np.random.Generator, updates: int, batch: int) -> TransitionBatch:
        """Draw batches, leading axes (updates / 2, 2, batch)."""
        index: NDArray[np.int64] = rng.integers(0, self.size, (updates // 2, 2, batch))
        return TransitionBatch(*(array[index] for array in self.arrays))

    def export(self) -> dict[str, NDArray[np.float32]]:
        """The filled part, by field name."""
        return {f"replay.{name}": array[: self.size] for name, array in self.arrays._asdict().items()}

    def load(self, tensors: dict[str, NDArray[np.float32]], count: int) -> None:
        """Take back what `export` gave."""
        self.count = count
        for name, array in self.arrays._asdict().items():
            array[: self.size] = tensors[f"replay.{name}"]
