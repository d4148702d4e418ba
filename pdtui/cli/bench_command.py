"""`pdtui bench`: how fast the loop is, and what recording, matching and the screen cost."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import click

from pdtui.cli.shared_options import drive_config, json_option, map_option, progress_bar_or_none, show_result
from pdtui.sessions.session_schema import ACTIVATIONS_KEPT, ActivationsKept


@click.group()
def bench() -> None:
    """Measure speed: ratios of one run, side by side."""


@bench.command("loop")
@click.argument("robot")
@map_option
@click.option(
    "--steps", type=click.IntRange(100), default=5000, show_default=True, help="Control steps a round."
)
@json_option
def bench_loop_command(robot: str, map_name: str | None, steps: int, as_json: bool) -> None:
    """Control steps a second of ROBOT: bare, with policy, stimulated, recorded."""
    from pdtui.benchmarks import benchmark_tables
    from pdtui.benchmarks import loop_benchmark as benchmark

    order = drive_config(robot, map_name, "")
    with progress_bar_or_none("measuring", quiet=as_json) as advance:
        result = benchmark.bench_loop(order, steps=steps, progress=advance)
    show_result(asdict(result), as_json, lambda: benchmark_tables.bench_table(result))


@bench.command("dissect")
@click.argument("robot", default="ant")
@click.option("--policy", default="", help="Weights to record; default: the robot's shipped policy.")
@click.option("--episodes", type=click.IntRange(1, 100), default=5, show_default=True)
@click.option("--steps", type=click.IntRange(64), default=1000, show_default=True)
@click.option("--units", type=click.IntRange(1), default=512, show_default=True)
@click.option("--attributes", type=click.IntRange(1), default=20, show_default=True)
@click.option("--rounds", type=click.IntRange(1), default=7, show_default=True)
@click.option("--memory-units", type=click.IntRange(1), default=100_000, show_default=True)
@click.option("--probes", type=click.IntRange(2), default=240, show_default=True, help="A round.")
@json_option
def bench_dissect_command(robot: str, policy: str, as_json: bool, **sizes: Any) -> None:
    """Matching against a loop over librosa.stft, its growth and memory, and probing on two workers."""
    from pdtui.benchmarks import benchmark_tables, dissection_benchmark

    with progress_bar_or_none("measuring", quiet=as_json) as advance:
        result = dissection_benchmark.bench_dissection(
            robot, policy or robot, dissection_benchmark.BenchmarkSizes(**sizes), advance
        )
    show_result(asdict(result), as_json, lambda: benchmark_tables.dissect_table(result))


@bench.command("record")
@click.argument("robot")
@map_option
@click.option("--steps", type=click.IntRange(100), default=6000, show_default=True)
@json_option
def bench_record_command(robot: str, map_name: str | None, steps: int, as_json: bool) -> None:
    """What recording ROBOT costs at 50 Hz: share of one core, and MB a minute."""
    from pdtui.benchmarks import benchmark_tables, recording_benchmark

    order = drive_config(robot, map_name, "")
    with progress_bar_or_none("measuring", quiet=as_json) as advance:
        result = recording_benchmark.bench_record(order, steps=steps, progress=advance)
    show_result(asdict(result), as_json, lambda: benchmark_tables.record_table(result))


@bench.command("memory")
@click.argument("robot")
@map_option
@click.option(
    "--steps",
    type=click.IntRange(100),
    default=180_000,
    show_default=True,
    help="An hour has 180,000 at 50 Hz.",
)
@click.option("--record-activations", "activations", type=click.Choice(ACTIVATIONS_KEPT), default="all")
@json_option
def bench_memory_command(
    robot: str, map_name: str | None, steps: int, activations: ActivationsKept, as_json: bool
) -> None:
    """Memory while a long drive of ROBOT is recorded and replayed."""
    from pdtui.benchmarks import benchmark_tables, recording_benchmark

    order = drive_config(robot, map_name, "", activations=activations)
    with progress_bar_or_none("driving", quiet=as_json) as advance:
        result = recording_benchmark.bench_memory(order, steps=steps, progress=advance)
    show_result(asdict(result), as_json, lambda: benchmark_tables.memory_table(result))


@bench.command("screen")
@click.argument("robot")
@map_option
@click.option("--seconds", type=click.FloatRange(1.0), default=15.0, show_default=True)
@json_option
def bench_screen_command(robot: str, map_name: str | None, seconds: float, as_json: bool) -> None:
    """Time to the first frame of a drive of ROBOT, and the CPU time of the screen, at 160×48."""
    from pdtui.benchmarks import benchmark_tables, screen_benchmark

    drive_config(robot, map_name, "")
    arguments = [robot, "--no-record", *(["--map", map_name] if map_name else [])]
    result = screen_benchmark.bench_screen(arguments, seconds)
    show_result(asdict(result), as_json, lambda: benchmark_tables.screen_table(result))
