"""The tables that the commands print."""

from __future__ import annotations

import math

from rich.console import Group
from rich.table import Table

from pdtui.experiments.bench import LoopBench
from pdtui.experiments.bench_dissect import DissectBench
from pdtui.experiments.bench_record import MemoryBench, RecordBench
from pdtui.experiments.bench_screen import ScreenBench
from pdtui.experiments.commands import CommandFollowing
from pdtui.experiments.evaluate import Evaluation
from pdtui.experiments.forest_results import Forest, Spread
from pdtui.experiments.walking import Walking


def new_table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left")
    for number, column in enumerate(columns):
        table.add_column(column, justify="left" if number == 0 else "right", no_wrap=number == 0)
    return table


def seeds_of(seeds: tuple[int, ...]) -> str:
    return f"{len(seeds)} seeds, {seeds[0]}–{seeds[-1]}"


def behavior_table(result: Evaluation) -> Group:
    """One row a behavior: those that move an attribute, then those that accomplish something."""
    tables = [_aim_table(result)] if result.behaviors else []
    return Group(*tables, *([_task_table(result)] if result.tasks else []))


def _task_table(result: Evaluation) -> Table:
    table = new_table(
        f"{result.robot}, policy {result.policy}, {seeds_of(result.seeds)}",
        *("behavior", "wanted", "done", "by itself", "falls", "measured (by itself)"),
    )
    count = len(result.seeds)
    for row in result.tasks:
        measured = ", ".join(
            f"{name} {value:.2f} ({row.figures_by_itself.get(name, float('nan')):.2f})"
            for name, value in row.figures.items()
        )
        table.add_row(
            row.behavior,
            row.wanted,
            f"{row.done}/{count}",
            f"{row.by_itself}/{count}",
            f"{row.falls}/{count}",
            measured,
        )
    return table


def _aim_table(result: Evaluation) -> Table:
    table = new_table(
        f"{result.robot}, policy {result.policy}, {seeds_of(result.seeds)}",
        *("behavior", "measure", "with it", "default", "effect [95 %]", "right", "falls"),
    )
    count = len(result.seeds)
    for row in result.behaviors:
        table.add_row(
            row.behavior,
            row.measure,
            f"{row.value:.2f}",
            f"{row.default:.2f}",
            f"{row.effect:+.2f} [{row.low:+.2f}, {row.high:+.2f}]",
            f"{row.right_sign}/{count}",
            f"{row.falls}/{count}",
        )
    return table


def walking_table(result: Walking) -> Table:
    """The policy alone."""
    table = new_table(
        f"the policy alone, {seeds_of(result.seeds)}, {result.steps} steps each", "measure", "value"
    )
    for name, speed in (("mean speed (m/s)", result.mean_speed), ("net speed (m/s)", result.net_speed)):
        if speed is not None:
            table.add_row(name, f"{speed:.2f}")
    table.add_row("return", f"{result.mean_return:.0f} ± {result.std_return:.0f}")
    table.add_row("episodes without a fall", f"{result.finished}/{len(result.seeds)}")
    return table


def commands_table(result: CommandFollowing) -> Table:
    """How closely each command is followed."""
    table = new_table(
        f"{result.robot}, policy {result.policy}, {seeds_of(result.seeds)}, {result.steps} steps each",
        *("command", "asked", "mean |error| [95 %]", "without the gait", "falls"),
    )
    count = len(result.seeds)
    for row in result.commands:
        table.add_row(
            f"{row.command} ({row.unit})",
            f"{min(row.asked):+.2f} to {max(row.asked):+.2f}",
            f"{row.error:.3f} [{row.low:.3f}, {row.high:.3f}]",
            f"{row.bias:.3f}",
            f"{count - result.finished}/{count}",
        )
    return table


def forest_table(result: Forest) -> Group:
    """One column a condition, figures per episode; then what was left out."""
    measured = f", {seeds_of(result.seeds)} in {result.repeats} repeats" if result.seeds else ""
    rows = result.conditions
    table = new_table(
        f"{result.robot} in the forest, {result.steps} steps ({result.seconds:g} s) at most{measured}",
        *("per episode", *(row.condition for row in rows)),
    )
    table.add_row("policy", *(row.policy for row in rows))
    table.add_row("reward", *(_spread(row.reward, 0) for row in rows))
    table.add_row("distance along x (m)", *(_spread(row.distance, 2) for row in rows))
    table.add_row("collisions", *(_spread(row.collisions, 2) for row in rows))
    table.add_row("keys", *(_spread(row.presses, 1) for row in rows))
    table.add_row("steps with a key", *(_spread(row.involvement, 1) for row in rows))
    table.add_row("falls", *(f"{row.falls}/{row.episodes}" for row in rows))
    table.add_row("crossed the forest", *(f"{row.crossed}/{row.episodes}" for row in rows))
    said = ["mean ± standard deviation of the repeats; an episode ends at a fall or the forest's far end"]
    if result.sessions:
        said.append("a person's sessions: the first episode of each is a repeat")
    said += [f"left out: {name}: {why}" for name, why in result.left_out.items()]
    return Group(table, *said)


def _spread(figure: Spread, digits: int) -> str:
    spread = "" if math.isnan(figure.std) else f" ± {figure.std:.{digits}f}"
    return f"{figure.mean:.{digits}f}{spread}"


def bench_table(result: LoopBench) -> Table:
    """Steps a second, and each share of the bare simulator."""
    table = new_table("control loop", "part", "steps/s", "of bare")
    for name in ("bare", "policy", "stimulated", "recorded"):
        rate = float(getattr(result, name))
        table.add_row(name, f"{rate:.0f}", f"{rate / result.bare:.0%}")
    table.caption = (
        f"recorded / bare, median of rounds: {result.recorded_share:.0%}; "
        f"forward pass with 3 stimulated units: {result.forward_us:.0f} µs"
    )
    return table


def dissect_table(result: DissectBench) -> Group:
    """Matching against the loop, its growth, its memory, and probing on two workers."""
    speed = new_table(result.recorded, "preset", "matching", "loop", "times as fast", "ranking", "ties")
    for one in result.compared:
        speed.add_row(
            one.preset,
            f"{one.ours_ms:.1f} ms",
            f"{one.loop_ms:.0f} ms",
            f"{one.ratio:.1f}",
            "the same" if one.same_ranking else "DIFFERENT",
            str(one.ties),
        )
    speed.caption = (
        "loop: librosa.stft for each series, numpy.linalg.norm for each pair; largest difference of a "
        f"discrepancy {max(one.largest_difference for one in result.compared):.0e} of the largest"
    )
    growth = new_table("time of matching", "grows", "size: ms", "ms = fixed + each · size", "off by at most")
    for curve in result.curves:
        points = "  ".join(f"{size}: {ms:.1f}" for size, ms in zip(curve.sizes, curve.ms, strict=True))
        line = f"{curve.fixed_ms:.1f} + {curve.each_ms:.3g} · size"
        growth.add_row(curve.grows, points, line, f"{curve.deviation:.0%}")
    rest = new_table("memory and probing", "measure", "value")
    rest.add_row(
        f"{result.memory_units} units: peak memory, {result.memory_data_gb:.2f} GB of it data",
        f"{result.memory_peak_gb:.2f} GB",
    )
    rest.add_row("their matching and correlating", f"{result.memory_seconds:.1f} s")
    rest.add_row("probing, 1 worker", f"{result.probing_one:.0f} steps/s")
    rest.add_row("probing, 2 workers", f"{result.probing_two:.0f} steps/s")
    rest.add_row("2 workers / 1, median of rounds", f"{result.probing_ratio:.2f}")
    return Group(speed, growth, rest)


def record_table(result: RecordBench) -> Table:
    """What each way to record costs at 50 Hz."""
    table = new_table(
        f"recording, 50 Hz, {result.units} units", "activations", "drive", "of one core", "MB/min"
    )
    for one in result.costs:
        table.add_row(one.activations, one.driven, f"{one.cpu_share:.1%}", f"{one.mb_a_minute:.2f}")
    return table


def memory_table(result: MemoryBench) -> Table:
    """Resident memory over a long drive, in tenths of it."""
    table = new_table(f"memory, {result.steps} steps", "part", "done", "MB")
    for part, sizes in result.resident.items():
        for number, size in enumerate(sizes, start=1):
            table.add_row(part, f"{number * 10} %", f"{size / 1e6:.0f}")
    took = ", ".join(f"{part} {seconds:.0f} s" for part, seconds in result.seconds.items())
    state = "whole" if result.whole else "NOT WHOLE"
    table.caption = f"{result.file_bytes / 1e6:.0f} MB, {state}; {result.verdict}; {took}"
    return table


def screen_table(result: ScreenBench) -> Table:
    """What the screen costs."""
    table = new_table("screen, 160×48", "measure", "value")
    table.add_row("first frame", f"{result.first_frame:.2f} s")
    table.add_row("first state of the robot", f"{result.first_state:.2f} s")
    table.add_row(
        f"CPU of the screen's process, over {result.seconds:g} s", f"{result.cpu_share:.0%} of one core"
    )
    return table
