"""The same control steps of two sessions, side by side."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pdtui.sessions.streams.step_block import StepBlock


def pair_blocks(a: Iterator[StepBlock], b: Iterator[StepBlock]) -> Iterator[tuple[StepBlock, StepBlock]]:
    """Yield blocks of the same control steps from both; steps that only one of them has are left out."""
    one, other = next(a, None), next(b, None)
    while one is not None and other is not None:
        length = min(len(one), len(other))
        unequal = np.flatnonzero(one.steps[:length] != other.steps[:length])
        if unequal.size and unequal[0] == 0:
            # The one that lags behind is taken on to where the other is, which may be in a later block.
            one = _skip_to(one, a, int(other.steps[0]))
            other = None if one is None else _skip_to(other, b, int(one.steps[0]))
            continue
        same = int(unequal[0]) if unequal.size else length
        yield one.part(0, same), other.part(0, same)
        one, other = _after(one, same, a), _after(other, same, b)


def _skip_to(block: StepBlock, blocks: Iterator[StepBlock], step: int) -> StepBlock | None:
    return _after(block, int(np.searchsorted(block.steps, step)), blocks)


def _after(block: StepBlock, rows: int, blocks: Iterator[StepBlock]) -> StepBlock | None:
    return block.part(rows, len(block)) if rows < len(block) else next(blocks, None)
