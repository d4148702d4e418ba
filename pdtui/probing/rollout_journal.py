"""A file of finished roll-outs, with which an interrupted dissection resumes without loss."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from hashlib import blake2b
from pathlib import Path

import numpy as np

from pdtui.core.closable import Closable
from pdtui.core.errors import PdtuiError, RobotError
from pdtui.core.outcome import Outcome
from pdtui.probing.start_states import StartState
from pdtui.probing.stimulated_rollout import RolloutJob, RolloutOutcome
from pdtui.robots.simulators.python_state import digest_values

_SCHEMA = "CREATE TABLE IF NOT EXISTS rollouts (key BLOB PRIMARY KEY, outcome BLOB NOT NULL) WITHOUT ROWID"
_ENDS = (
    *(None, Outcome.FELL, Outcome.ARRIVED, Outcome.CRASHED, Outcome.LEFT_ROAD),
    *(Outcome.OUT_OF_TIME, Outcome.DIVERGED),
)
"""Numbers that stand for outcomes. Older journals tell only whether the robot fell, by 0 and 1."""


class RolloutJournal(Closable):
    """Outcomes of roll-outs by policy, robot, start, plan and length, which determine them.

    A dissection that is run again with the same arguments makes the same decisions. It reads the outcomes of
    finished roll-outs instead of running them, and soon arrives where it was interrupted.

    The SQLite database at `path` is created if it does not exist. The identity is what all roll-outs have in
    common, such as the robot and the hash of the policy.

    Raises:
        RobotError: the file is not a journal or cannot be written.
    """

    def __init__(self, path: Path, identity: str) -> None:
        self.path = path
        self._identity = identity.encode()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._database = sqlite3.connect(path)
            self._database.execute(_SCHEMA)
            self._database.execute("PRAGMA synchronous=OFF")
        except (sqlite3.Error, OSError) as error:
            raise RobotError(f"{path}: expected a journal of roll-outs or room for one: {error}") from error

    def __len__(self) -> int:
        return int(self._database.execute("SELECT count(*) FROM rollouts").fetchone()[0])

    def close(self) -> None:
        """Close the file."""
        self._database.close()

    def keys(
        self, jobs: Sequence[RolloutJob], starts: Sequence[StartState], steps: int, measure_from: int
    ) -> list[bytes]:
        """Return the key of each job."""
        prints = [fingerprint_start_state(start) for start in starts]
        length = f"{steps} {measure_from}".encode()
        parts = ((self._identity, prints[index], repr(plan).encode(), length) for plan, index in jobs)
        return [blake2b(b"\0".join(part), digest_size=16).digest() for part in parts]

    def read(self, keys: Sequence[bytes]) -> list[RolloutOutcome | None]:
        """Return the outcome for each key, or None where there is none."""
        found: list[RolloutOutcome | None] = []
        for key in keys:
            row = self._database.execute("SELECT outcome FROM rollouts WHERE key = ?", (key,)).fetchone()
            found.append(None if row is None else _decode(row[0]))
        return found

    def write(self, keys: Sequence[bytes], outcomes: Sequence[RolloutOutcome]) -> None:
        """Store outcomes.

        They then survive the end of this process, but not a crash of the machine, because SQLite hands them
        to the operating system and does not wait for the disk.

        Raises:
            PdtuiError: the disk is full or the file is gone.
        """
        rows = [(key, _encode(outcome)) for key, outcome in zip(keys, outcomes, strict=True)]
        try:
            with self._database:
                self._database.executemany("INSERT OR REPLACE INTO rollouts VALUES (?, ?)", rows)
        except sqlite3.Error as error:
            raise PdtuiError(f"{self.path}: cannot be written: {error}") from error


def fingerprint_start_state(start: StartState) -> bytes:
    """Return a hash of the whole state that a roll-out begins with: the robot's and the policy's."""
    return digest_values(start.snapshot, start.policy_state).to_bytes(8, "little")


def _encode(outcome: RolloutOutcome) -> bytes:
    end = _ENDS.index(outcome.outcome)
    return np.array([outcome.error, outcome.steps_survived, end, *outcome.means], "<f8").tobytes()


def _decode(row: bytes) -> RolloutOutcome:
    error, steps_survived, end, *means = np.frombuffer(row, "<f8").tolist()
    return RolloutOutcome(np.array(means), error, int(steps_survived), _ENDS[int(end)])
