"""The tables of `pdtui sessions`. Text from files is shown literally: no markup, no control characters."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich import filesize
from rich.console import Group
from rich.table import Table
from rich.text import Text

from pdtui.core.console.text_tables import new_facts_table, new_table
from pdtui.core.drive_events import describe_event
from pdtui.core.outcome import describe_outcomes
from pdtui.core.printable_text import make_printable
from pdtui.robots.options.robot_option import format_robot_options
from pdtui.sessions.comparison.branch_descriptions import describe_branch, describe_branches

if TYPE_CHECKING:
    from pdtui.sessions.comparison.session_comparison import SessionComparison
    from pdtui.sessions.drive_path import PathDifference
    from pdtui.sessions.episode_statistics import EpisodeStatistics
    from pdtui.sessions.session_header import SessionHeader
    from pdtui.sessions.session_summary import SessionSummary
    from pdtui.sessions.streams.run_deviations import AttributeDeviation

_LONGEST_NAME = 60
_KEPT = {
    "all": "every unit, every step",
    "half": "every unit, every step, as float16",
    "off": "not recorded; a replay computes them",
}


def _cell(text: object, style: str = "") -> Text:
    return Text(make_printable(str(text)), style)


def session_list_table(rows: Iterable[dict[str, Any]], folder: Path) -> Any:
    """Return one row per file; that of a broken file says what is wrong."""
    rows = list(rows)
    told = ["episodes"] if any(row.get("outcomes") for row in rows) else []
    table = new_table(
        *("", "session", "robot", "length", "keys", "size", *told, "outcome"),
        left=("session", "robot", *told, "outcome"),
    )
    # A name is for copying: where there is little space, the other columns are folded.
    longest = max((len(str(Path(row["path"]).relative_to(folder))) for row in rows), default=0)
    table.columns[0].min_width = min(longest, _LONGEST_NAME)
    for column in (table.columns[0], *table.columns[2:5]):
        column.no_wrap = True
    for row in rows:
        name, size = _cell(Path(row["path"]).relative_to(folder)), filesize.decimal(row["bytes"])
        if row["broken"]:
            table.add_row(name, "", "", "", size, *[""] * len(told), _cell(f"broken: {row['broken']}", "red"))
            continue
        table.add_row(
            name,
            _cell(row["robot"]),
            f"{row['seconds']:.1f} s",
            str(row["keys"]),
            size,
            *[describe_outcomes(row["outcomes"]) if row["outcomes"] else ""] * len(told),
            _cell(row["outcome"]) if row["outcome"] else _cell("cut off: no outcome", "yellow"),
        )
    return table


def session_details(session: SessionHeader, summary: SessionSummary) -> Any:
    """Return everything about a session: facts, figures, attributes, episodes and events."""
    from pdtui.sessions.streams.step_numbers import describe_step_ranges

    info = session.info
    facts = [
        ("session", session.path),
        ("robot", info.robot),
        *([("robot options", format_robot_options(info.robot_options))] if info.robot_options else []),
        ("policy", f"{info.policy}, SHA-256 {info.policy_hash}"),
        ("layers", " ".join(map(str, info.layers))),
        ("activations", _KEPT[info.activations]),
        ("map", f"{len(info.map_text.splitlines())} lines, inside the session"),
        *([("start", info.start)] if info.start else []),
        *([("missing", describe_step_ranges(session.gaps))] if session.gaps else []),
        ("seed", f"{info.seed}{', with action noise' if info.stochastic else ''}"),
        ("driven", session.created),
        *([("branched off", describe_branch(info.branch))] if info.branch is not None else []),
        ("outcome", session.outcome or "none: the file is cut off"),
        *session.versions.items(),
    ]
    figures = [
        ("length", f"{summary.steps} steps, {summary.seconds:g} s"),
        ("episodes", _ended(session, summary)),
        ("human involvement", _involvement(summary, summary)),
        *([("taken over", f"{summary.taken_over} steps")] if summary.taken_over else []),
        ("stimulated", f"{summary.stimulated} steps"),
        ("return", f"{summary.total_reward:.2f}"),
        ("collisions" if info.obstacles else "cost", f"{summary.total_cost:.{0 if info.obstacles else 2}f}"),
    ]
    attributes = new_table("", "attribute", "mean", "std", "unit", left=("attribute", "unit"))
    for row in summary.attributes:
        attributes.add_row(_cell(row.attribute), f"{row.mean:.3f}", f"{row.std:.3f}", _cell(row.unit))
    parts: list[Any] = [
        new_facts_table((make_printable(name), _cell(value)) for name, value in facts),
        new_facts_table(figures),
        attributes,
        *_episodes(summary),
        _happened(session),
    ]
    return Group(parts[0], *(one for part in parts[1:] for one in ("", part)))


def _involvement(part: SessionSummary | EpisodeStatistics, whole: SessionSummary) -> str:
    what = "with a key press or a takeover" if whole.taken_over else "with a key press"
    return f"{part.involvement} steps {what} ({100.0 * part.involvement / max(1, part.steps):.1f} %)"


def _ended(session: SessionHeader, summary: SessionSummary) -> str:
    """Return the number of episodes and how they ended, as far as an older session says it."""
    untold = len(session.endings.keys() - session.outcomes.keys())
    told = describe_outcomes(summary.outcomes) if summary.outcomes else "" if untold else "none ended"
    counted = f"{summary.episodes}: {told}" if told else f"{summary.episodes}"
    return f"{counted}, ended {untold}" if untold else counted


def _episodes(summary: SessionSummary) -> list[Table]:
    """Return one row per episode, where the robot has a distance or obstacles, or passed some."""
    tallies = summary.tallies
    far, hits = (
        any(getattr(tally, name) is not None for tally in tallies) for name in ("distance", "collisions")
    )
    over = any(tally.passed for tally in tallies)
    if not (far or hits or over):
        return []
    columns = ["distance"] * far + ["collisions"] * hits + ["obstacles passed"] * over
    table = new_table("", "episode", "steps", *columns, "human involvement", "outcome", left=("outcome",))
    for tally in tallies:
        cells = [_figure(tally.distance, ".2f", " m")] * far + [_figure(tally.collisions, "g")] * hits
        cells += [_figure(tally.passed, "g")] * over
        involvement = _involvement(tally, summary)
        table.add_row(str(tally.episode), str(tally.steps), *cells, involvement, tally.outcome)
    return [table]


def _figure(value: float | None, form: str, unit: str = "") -> str:
    return "" if value is None else f"{value:{form}}{unit}"


def _happened(session: SessionHeader) -> Table:
    """Return events and ends of episodes in the order of their steps."""
    table = new_table("", "time", "step", "key", "what", left=("key", "what"))
    rows = [(event.step, 0, event.key, describe_event(event)) for event in session.events]
    rows += [(step, 1, "", _describe_end(step, session)) for step in session.endings | session.outcomes]
    for step, _, key, what in sorted(rows, key=lambda row: row[:2]):
        table.add_row(f"{step * session.info.dt:.2f} s", str(step), _cell(key), _cell(what))
    return table


def _describe_end(step: int, session: SessionHeader) -> str:
    outcome, reason = session.outcomes.get(step), session.endings.get(step)
    if reason is None:
        return f"{outcome}, and the episode goes on"
    said = reason if outcome is None or reason.startswith(outcome) else f"{outcome}: {reason}"
    return f"episode ended: {said}"


def attribute_deviation_table(deviations: Sequence[AttributeDeviation]) -> Table:
    """Return one row per attribute that differs."""
    table = new_table("", "attribute", "first", "mean", "largest", "step", "unit", left=("attribute", "unit"))
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


def session_comparison_table(
    result: SessionComparison,
    headers: tuple[SessionHeader, SessionHeader],
    paths: Sequence[PathDifference] = (),
) -> Any:
    """Return the first value that differs, and how far attributes and paths are apart from there on."""
    parts: list[Any] = [_cell(_compare_line(result))]
    parts += [_cell(line) for line in describe_branches(*headers)]
    if result.difference is not None:
        parts.append(_cell(result.difference.between_sessions()))
    if result.first_event:
        parts.append(_cell(result.first_event))
    if result.deviations:
        parts += ["", attribute_deviation_table(result.deviations)]
    if paths:
        parts += ["", _path_table(paths, headers[0].info.dt)]
    if result.circumstances:
        parts += ["", *(_cell(line, "dim") for line in result.circumstances)]
    return Group(*parts)


def _path_table(paths: Sequence[PathDifference], dt: float) -> Table:
    """Return where both robots were, from above."""
    table = new_table("", "path", "step", "first: x, y", "second: x, y", "apart")
    for row in paths:
        places = (f"{x:.2f}, {y:.2f} m" for x, y in (row.first, row.second))
        table.add_row(f"{(row.step + 1) * dt:.2f} s", str(row.step), *places, f"{row.apart:.2f} m")
    return table


def _compare_line(result: SessionComparison) -> str:
    lengths = result.lengths
    tail = "" if lengths[0] == lengths[1] else f"; they have {lengths[0]} and {lengths[1]} steps"
    if result.first_difference is None:
        return f"identical: {result.steps} steps{tail}"
    return f"differ from step {result.first_difference} of {result.steps} on{tail}"
