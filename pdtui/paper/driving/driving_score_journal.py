"""The journal of scores, with which an interrupted experiment goes on."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from pdtui.core.outcome import Outcome
from pdtui.core.processes.result_journal import ResultJournal
from pdtui.paper.driving.driving_episode import DrivingScore

DrivingScoreJournal = ResultJournal[DrivingScore]


def open_driving_score_journal(path: Path | None) -> DrivingScoreJournal:
    """Open a file of scores, one JSON object per line; None keeps nothing.

    Raises:
        PdtuiError: The file cannot be read or written, or a line is no score.
    """
    return ResultJournal(path, asdict, _decode_score, "the score of a drive", key_field="drive")


def _decode_score(fields: dict[str, Any]) -> DrivingScore:
    return DrivingScore(outcome=Outcome(fields.pop("outcome")), **fields)
