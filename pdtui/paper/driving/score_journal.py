"""A file of scores that is written during the experiment, so that it can go on after an interruption."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from pdtui.core.atomic_file import write_file
from pdtui.core.errors import PdtuiError
from pdtui.core.outcome import Outcome
from pdtui.paper.driving.driving_episode import DrivingScore


class ScoreJournal:
    """Keeps the score of each drive, one JSON object per line.

    Args:
        path: The file; None keeps nothing.

    Raises:
        PdtuiError: The file cannot be read or written, or a line is no score.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._scores: dict[str, DrivingScore] = {}
        if path is not None and path.exists():
            self._read(path)

    def find(self, key: str) -> DrivingScore | None:
        """Return the score of a drive that was kept; None if there is none."""
        return self._scores.get(key)

    def keep(self, key: str, score: DrivingScore) -> None:
        """Keep the score of a drive.

        Args:
            key: Everything that determines the drive, as text.
            score: Its score.

        Raises:
            PdtuiError: The file cannot be written.
        """
        self._scores[key] = score
        if self._path is None:
            return
        try:
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"drive": key, **asdict(score)}) + "\n")
        except OSError as error:
            raise PdtuiError(f"{self._path}: cannot be written: {error.strerror}") from error

    def _read(self, path: Path) -> None:
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise PdtuiError(f"{path}: cannot be read as a journal of drives: {error}") from error
        for number, line in enumerate(lines, start=1):
            try:
                fields = json.loads(line)
                key = fields.pop("drive")
                self._scores[key] = DrivingScore(outcome=Outcome(fields.pop("outcome")), **fields)
            except (ValueError, TypeError, KeyError, AttributeError) as error:
                if number == len(lines) and not line.endswith("}"):
                    # It was interrupted while it wrote the last line.
                    write_file(path, "".join(f"{one}\n" for one in lines[:-1]), PdtuiError)
                    return
                raise PdtuiError(f"{path}: line {number}: expected the score of a drive") from error
