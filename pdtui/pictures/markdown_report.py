"""The tables of a dissection as a Markdown document."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.table import Table

from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.dissection_summary import summarise_dissection
from pdtui.dissection.dissection_tables import dissection_remarks, dissection_tables
from pdtui.sessions.environment_versions import collect_versions


def dissection_markdown(dissection: Dissection) -> str:
    """Return everything that the terminal prints about a dissection, and its origin, as Markdown."""
    summary = summarise_dissection(dissection)
    parts = [f"# Dissection of {summary['policy']} on {summary['robot']}", _origin(dissection, summary)]
    parts += [table_to_markdown(table) for table in dissection_tables(summary)]
    parts += ["## Remarks", "\n".join(f"- {line}" for line in dissection_remarks(summary))]
    return "\n\n".join(parts) + "\n"


def _origin(dissection: Dissection, summary: dict[str, Any]) -> str:
    preset, dt = dissection.preset, dissection.dt
    versions = collect_versions()
    episodes = ", ".join(str(seed) for seed in summary["episodes"])
    rows = [
        ("policy", f"{summary['policy']}, SHA-256 `{summary['sha256']}`"),
        ("hidden layers", " · ".join(f"{width} units" for width in dissection.layers)),
        (
            "seed",
            f"{summary['seed']}; episodes of seeds {episodes}, pictured: {dissection.sample_episode.seed}",
        ),
        (
            "spectrum",
            f"preset `{preset}`: {preset.window.title()} window of {preset.length} steps, hop "
            f"{preset.hop}; {dt:g} s per step",
        ),
        ("probed", f"{summary['rollouts']} roll-outs, {summary['control_steps']} control steps"),
        ("versions", ", ".join(f"{name} {versions[name]}" for name in ("pdtui", "mujoco", "torch", "numpy"))),
    ]
    return _markdown(["", ""], rows)


def table_to_markdown(table: Table) -> str:
    """Return a table that the terminal prints, with its title, as Markdown."""
    headers = [str(column.header) for column in table.columns]
    columns = [[str(cell) for cell in column.cells] for column in table.columns]
    return f"## {table.title}\n\n" + _markdown(headers, list(zip(*columns, strict=True)))


def _markdown(headers: list[str], rows: Sequence[tuple[str, ...]]) -> str:
    if not rows:
        return "None."
    lines = [headers, ["---"] * len(headers), *rows]
    return "\n".join("| " + " | ".join(_escape(cell) for cell in line) + " |" for line in lines)


def _escape(cell: str) -> str:
    return cell.replace("|", "\\|").replace("*", "\\*").replace("\n", " ")
