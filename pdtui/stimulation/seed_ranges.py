"""Seeds that are kept apart: those on which figures are published, and those on which anything is chosen.

A figure of something that was chosen on the same seeds is too good. The judging seeds are therefore reserved:
no search, tuning or dissection draws one, and a map records the seeds that went into it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from pdtui.core.errors import SeedError

JUDGING_SEEDS = range(1000)
"""Seeds on which figures are published."""
FIRST_SEARCH_SEED = JUDGING_SEEDS.stop
"""The first seed that a search may use; all larger ones are free, too."""

_RANGE = re.compile(r"(\d{1,9})(?:-(\d{1,9}))?")


def require_search_seeds(seeds: Sequence[int], purpose: str) -> None:
    """Check that none of the seeds on which something is chosen is a judging seed; else a `SeedError`.

    Args:
        seeds: the seeds.
        purpose: what uses them, for the message: "the search for 'hop'".
    """
    reserved = [seed for seed in seeds if seed in JUDGING_SEEDS]
    if reserved:
        raise SeedError(
            f"{purpose}: seed {reserved[0]} is reserved for judging; "
            f"expected seeds from {FIRST_SEARCH_SEED} on"
        )


def merge_seed_ranges(seeds: Iterable[int | range]) -> tuple[range, ...]:
    """Return the seeds as ranges in order, without overlaps."""
    parts = [part if isinstance(part, range) else range(part, part + 1) for part in seeds]
    merged: list[range] = []
    for part in sorted(parts, key=lambda one: one.start):
        if merged and part.start <= merged[-1].stop:
            merged[-1] = range(merged[-1].start, max(merged[-1].stop, part.stop))
        elif part:
            merged.append(part)
    return tuple(merged)


def format_seed_ranges(ranges: Sequence[range]) -> list[str]:
    """Return ranges as texts, such as ``1000-1007`` or ``7``."""
    return [f"{one.start}-{one.stop - 1}" if len(one) > 1 else str(one.start) for one in ranges]


def parse_seed_range(text: str) -> range:
    """Return the range that a text such as ``7`` or ``100-119`` states; another text is a `SeedError`."""
    match = _RANGE.fullmatch(text)
    if match is None or int(match[2] or match[1]) < int(match[1]):
        raise SeedError(f"'{text[:40]}': expected seeds such as 7 or 100-119")
    return range(int(match[1]), int(match[2] or match[1]) + 1)


def require_unused_seeds(seeds: Sequence[int], used: Sequence[range] | None, source: str) -> str:
    """Check that nothing in a map was chosen on the seeds on which it is to be judged; else a `SeedError`.

    Args:
        seeds: the seeds to judge by.
        used: the seeds that the map records; None if it records none.
        source: name of the map in messages.

    Returns:
        A warning if the map does not say enough to be sure; otherwise an empty string.
    """
    if used is None:
        reserved = all(seed in JUDGING_SEEDS for seed in seeds)
        what = f"{source} does not say on which seeds it was made"
        return "" if reserved else f"{what}; figures on seeds from {FIRST_SEARCH_SEED} on may be too good"
    common = [seed for seed in seeds if any(seed in one for one in used)]
    if common:
        raise SeedError(
            f"{source}: something in this map was chosen on seed {common[0]}, so that figures on it are too "
            f"good; used are {', '.join(format_seed_ranges(used))}"
        )
    return ""
