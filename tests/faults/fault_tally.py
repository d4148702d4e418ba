"""Count what becomes of recordings under faults, and print it as a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

COLUMNS = ("tried", "whole", "refused", "mended", "lost", "lied", "missing")
_ROW = "{:<52}" + "{:>9}" * len(COLUMNS)
MEANINGS = """\
whole    the file is whole without a repair, or there is none because no control step was done
refused  reported as broken in one line; there is nothing that could be rescued
mended   reported as not whole; repaired, it is whole, replays, and lacks nothing but what was damaged
lost     something that had to survive did not
lied     a file with changed data was reported as whole, or two drives said that they recorded one file
missing  most control steps that one recording lacks"""


class StepsLost(Exception):  # noqa: N818 - it names an event
    """Something that should have survived did not."""


class FalseReport(Exception):  # noqa: N818 - it names an event
    """pdtui said something about a recording that is not true."""


@dataclass
class FaultTally:
    """What became of recordings under one kind of fault.

    Attributes:
        kind: the kind of fault, in words.
        tried: number of faults.
        whole, refused, mended, lost, lied: number of recordings by what became of them.
        missing: most control steps that one recording lacks.
        notes: what else is to be said.
        troubles: one line for each recording that was lost, or about which pdtui lied.
    """

    kind: str
    tried: int = 0
    whole: int = 0
    refused: int = 0
    mended: int = 0
    lost: int = 0
    lied: int = 0
    missing: int = 0
    notes: list[str] = field(default_factory=list)
    troubles: list[str] = field(default_factory=list)

    @property
    def bad(self) -> int:
        """Number of recordings that were lost, or about which pdtui lied."""
        return self.lost + self.lied

    def mend(self, missing: int) -> None:
        """Count a recording that was mended and lacks this many control steps."""
        self.mended += 1
        self.missing = max(self.missing, missing)

    @contextmanager
    def try_fault(self, name: str) -> Iterator[None]:
        """Count one fault; whatever the block raises is a trouble."""
        self.tried += 1
        try:
            yield
        except FalseReport as report:
            self.lied += 1
            self.troubles.append(f"{name}: {report}")
        except StepsLost as loss:
            self.lost += 1
            self.troubles.append(f"{name}: {loss}")
        except Exception as error:
            self.lost += 1
            said = " ".join(str(error).split())
            self.troubles.append(f"{name}: {type(error).__name__}: {said}")

    def format_row(self) -> str:
        """Return the row of the table, and the lines below it."""
        row = _ROW.format(self.kind, *(getattr(self, column) for column in COLUMNS))
        return "\n".join([row, *(f"  {line}" for line in (*self.notes, *self.troubles))])


def format_heading() -> str:
    """Return the first line of the table."""
    return _ROW.format("kind of fault", *COLUMNS)


def format_verdict(tallies: Sequence[FaultTally]) -> str:
    """Return one line on the whole table."""
    tried, lost, lied = (sum(getattr(one, name) for one in tallies) for name in ("tried", "lost", "lied"))
    return f"{tried} faults, {lost} lost, {lied} lied"
