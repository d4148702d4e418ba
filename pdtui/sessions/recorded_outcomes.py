"""The outcomes of the episodes of a session, with what the reasons in older sessions tell."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from pdtui.core.outcome import Outcome

_REASON_STARTS = {"fell": Outcome.FELL, "walked off": Outcome.LEFT_ROAD, "arrived": Outcome.ARRIVED}
"""How reasons begin in sessions that lack the word."""


def decode_outcomes(rows: Iterable[tuple[int, Any]], endings: Mapping[int, str]) -> dict[int, Outcome]:
    """Return outcomes by the control step in which they came about, in the order of the steps.

    Args:
        rows: control steps and words; of older sessions, none.
        endings: why episodes ended. Where an ending has no word, its reason gives it, if it says enough.

    Raises:
        ValueError: a word is no outcome.
    """
    words: dict[int, Any] = {}
    for step, reason in endings.items():
        if " diverged" in reason:
            words[step] = Outcome.DIVERGED
        for start, outcome in _REASON_STARTS.items():
            if reason.startswith(start):
                words[step] = outcome
    words |= dict(rows)
    for word in words.values():
        if not isinstance(word, str) or word not in list(Outcome):
            raise ValueError(f"expected one of {', '.join(Outcome)}, found {str(word)[:40]!r}")
    return {step: Outcome(word) for step, word in sorted(words.items())}
