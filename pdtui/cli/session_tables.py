"""The tables of `pdtui sessions`. Text from files goes into them as it is, with nothing to obey in it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from rich import filesize
from rich.console import Group
from rich.table import Table
from rich.text import Text

from pdtui.core.events import describe_event
from pdtui.core.printable_text import make_printable
from pdtui.sessions.session_comparison import AttributeDeviation, SessionComparison
from pdtui.sessions.session_reader import Session
from pdtui.sessions.session_summary import SessionSummary

_KEPT = {
    "all": "of every unit, in every step",
    "half": "of every unit, in every step, as float16",
    "off": "not recorded; a replay computes them again",
}


def _cell(text: object, style: str = "") -> Text:
    return Text(make_printable(str(text)), style)


def _table(*columns: str, left: Sequence[str] = ()) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in columns:
        table.add_column(column, justify="left" if column in left else "right", overflow="fold")
    return table


def list_table(rows: Iterable[dict[str, Any]], folder: Path) -> Any:
    """One row a file; a broken one says why, across the other columns."""
    table = _table(
        "session", "robot", "length", "keys", "size", "outcome", left=("session", "robot", "outcome")
    )
    for row in rows:
        name, size = _cell(Path(row["path"]).relative_to(folder)), filesize.decimal(row["bytes"])
        if row["broken"]:
            table.add_row(name, "", "", "", size, _cell(f"broken: {row['broken']}", "red"))
            continue
        table.add_row(
            name,
            _cell(row["robot"]),
            f"{row['seconds']:.1f} s",
            str(row["keys"]),
            size,
            _cell(row["outcome"]) if row["outcome"] else _cell("cut off: no outcome", "yellow"),
        )
    return table


def show_table(session: Session, summary: SessionSummary) -> Any:
    """Who drove what, key by key, and what it came to."""
    info = session.info
    facts = Table(box=None, pad_edge=False, show_header=False)
    for name, value in (
        ("session", session.path),
        ("robot", info.robot),
        ("policy", f"{info.policy}, SHA-256 {info.policy_hash[:12]}…"),
        ("layers", " ".join(map(str, info.layers))),
        ("activations", _KEPT[info.activations]),
        ("map", f"{len(info.map_text.splitlines())} lines, inside the session"),
        *([("start", info.start)] if info.start else []),
        ("seed", f"{info.seed}{', actions drawn at random' if info.stochastic else ''}"),
        ("driven", session.created),
        ("outcome", session.outcome or "none: the file was cut off"),
        *session.versions.items(),
    ):
        facts.add_row(Text(make_printable(str(name)), "dim"), _cell(value))
    figures = Table(box=None, pad_edge=False, show_header=False)
    for name, value in (
        ("length", f"{summary.steps} steps, {summary.seconds:g} s"),
        ("episodes", f"{summary.episodes}, of which {summary.falls} ended by themselves"),
        ("human involvement", _keyed(summary.involvement, summary.steps)),
        ("stimulated", f"{summary.stimulated} steps"),
        ("return", f"{summary.total_reward:.2f}"),
        ("collisions" if info.obstacles else "cost", f"{summary.total_cost:.{0 if info.obstacles else 2}f}"),
    ):
        figures.add_row(Text(name, "dim"), value)
    attributes = _table("attribute", "mean", "std", "unit", left=("attribute", "unit"))
    for row in summary.attributes:
        attributes.add_row(_cell(row.attribute), f"{row.mean:.3f}", f"{row.std:.3f}", _cell(row.unit))
    parts: list[Any] = [facts, figures, attributes, *_episodes(summary), _happened(session)]
    return Group(parts[0], *(one for part in parts[1:] for one in ("", part)))


def _keyed(involvement: int, steps: int) -> str:
    return f"{involvement} steps with a key ({100.0 * involvement / max(1, steps):.1f} %)"


def _episodes(summary: SessionSummary) -> list[Table]:
    """One row an episode, as the screen counted it; for a robot with a way to go or obstacles."""
    tallies = summary.tallies
    far, hits = (
        any(getattr(tally, name) is not None for tally in tallies) for name in ("distance", "collisions")
    )
    if not (far or hits):
        return []
    columns = ["distance"] * far + ["collisions"] * hits
    table = _table("episode", "steps", *columns, "human involvement")
    for tally in tallies:
        cells = [f"{tally.distance:.2f} m"] * far + [f"{tally.collisions:g}"] * hits
        table.add_row(str(tally.episode), str(tally.steps), *cells, _keyed(tally.involvement, tally.steps))
    return [table]


def _happened(session: Session) -> Table:
    """Events and endings in the order of their steps."""
    table = _table("time", "step", "key", "what", left=("key", "what"))
    rows = [(event.step, 0, event.key, describe_event(event)) for event in session.events]
    rows += [(step, 1, "", f"episode ended: {reason}") for step, reason in session.endings.items()]
    for step, _, key, what in sorted(rows, key=lambda row: row[:2]):
        table.add_row(f"{step * session.info.dt:.2f} s", str(step), _cell(key), _cell(what))
    return table


def deviation_table(deviations: Sequence[AttributeDeviation]) -> Table:
    """One row an attribute that differs."""
    table = _table("attribute", "at first", "mean", "largest", "step", "unit", left=("attribute", "unit"))
    for row in deviations:
        table.add_row(
            _cell(row.attribute),
            f"{row.first:.3g}",
            f"{row.mean:.3g}",
            f"{row.largest:.3g}",
            str(row.step),
            _cell(row.unit),
        )
    return table


def compare_table(result: SessionComparison) -> Any:
    """The first step that differs, and how far attributes are apart after it."""
    parts: list[Any] = [_cell(compare_line(result))]
    if result.first_event:
        parts.append(_cell(result.first_event))
    if result.deviations:
        parts += ["", deviation_table(result.deviations)]
    if result.circumstances:
        parts += ["", *(_cell(line, "dim") for line in result.circumstances)]
    return Group(*parts)


def compare_line(result: SessionComparison) -> str:
    lengths = result.lengths
    tail = "" if lengths[0] == lengths[1] else f"; they have {lengths[0]} and {lengths[1]} steps"
    if result.first_difference is None:
        return f"identical: {result.steps} steps{tail}"
    return f"differ from step {result.first_difference} of {result.steps} on{tail}"
