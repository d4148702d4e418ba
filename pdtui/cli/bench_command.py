"""`pdtui bench`: the speed of the loop, and the cost of recording, matching and the screen."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import click

from pdtui.cli.completion.completed_names import complete_robots
from pdtui.cli.options.robot_option_flag import parse_robot_options, robot_option_flag
from pdtui.cli.options.shared_options import (
    build_drive_config,
    integer_option,
    json_option,
    map_option,
    own_policy_option,
    record_activations_option,
)
from pdtui.cli.options.worker_options import cluster_option
from pdtui.cli.output.command_output import print_result
from pdtui.core.cluster.ray_cluster import RayCluster
from pdtui.core.console.progress_bar import progress_bar
from pdtui.core.errors import PdtuiError
from pdtui.sessions.session_schema import ActivationsKept


@click.group()
def bench_command() -> None:
    """Measure speed and memory.

    The variants are measured in turn within one run: compare ratios, not figures from different runs.
    """


@bench_command.command("loop")
@click.argument("robot", shell_complete=complete_robots)
@robot_option_flag
@map_option
@integer_option("--steps", least=100, default=5000, help="Number of control steps per round.")
@json_option
def bench_loop_command(
    robot: str, robot_options: tuple[str, ...], map_name: str | None, steps: int, as_json: bool
) -> None:
    """Measure control steps per second: bare, with policy, stimulated, recorded."""
    from pdtui.benchmarks.benchmark_tables import loop_benchmark_table
    from pdtui.benchmarks.control_loop_benchmark import bench_loop

    config = build_drive_config(robot, map_name, "", robot_options=robot_options)
    with progress_bar("measuring", quiet=as_json) as advance:
        result = bench_loop(config, steps=steps, progress=advance)
    print_result(asdict(result), as_json, lambda: loop_benchmark_table(result))


@bench_command.command("dissect")
@click.argument("robot", default="ant", shell_complete=complete_robots)
@robot_option_flag
@own_policy_option
@integer_option("--episodes", most=100, default=5, help="Number of episodes to record.")
@integer_option("--steps", least=64, default=1000, help="Number of control steps per episode.")
@integer_option("--units", default=512, help="Number of units to match.")
@integer_option("--attributes", default=16, help="Number of attributes to match.")
@integer_option("--rounds", default=7, help="Number of rounds to measure.")
@integer_option(
    "--memory-units", default=100_000, help="Number of units of the episode whose memory is measured."
)
@integer_option("--probes", least=2, default=240, help="Number of roll-outs per round.")
@json_option
def bench_dissect_command(
    robot: str, robot_options: tuple[str, ...], policy: str, as_json: bool, **sizes: Any
) -> None:
    """Measure matching against loops over librosa and the authors' released procedure, and probing."""
    from pdtui.benchmarks.benchmark_tables import dissection_benchmark_table
    from pdtui.benchmarks.dissection_benchmark import DissectionBenchmarkSettings, bench_dissection
    from pdtui.robots import RobotSpec

    world = RobotSpec(robot, parse_robot_options(robot, robot_options))
    with progress_bar("measuring", quiet=as_json) as advance:
        result = bench_dissection(world, policy or robot, DissectionBenchmarkSettings(**sizes), advance)
    print_result(asdict(result), as_json, lambda: dissection_benchmark_table(result))


@bench_command.command("rollouts")
@click.argument("robot", default="anymal")
@robot_option_flag
@own_policy_option
@integer_option("--rollouts", least=8, default=192, help="Number of roll-outs per round.")
@integer_option("--steps", least=10, default=60, help="Number of control steps per roll-out.")
@integer_option("--rounds", default=5, help="Number of rounds to measure.")
@integer_option("--workers", default=2, help="Number of worker processes.")
@json_option
def bench_rollouts_command(
    robot: str, robot_options: tuple[str, ...], policy: str, as_json: bool, **sizes: int
) -> None:
    """Measure stimulated roll-outs one by one and in lock step against bare simulators."""
    from pdtui.benchmarks.benchmark_tables import rollout_benchmark_table
    from pdtui.benchmarks.rollout_benchmark import bench_rollouts
    from pdtui.robots import RobotSpec

    world = RobotSpec(robot, parse_robot_options(robot, robot_options))
    with progress_bar("measuring", quiet=as_json) as advance:
        result = bench_rollouts(world, policy or robot, progress=advance, **sizes)
    print_result(asdict(result), as_json, lambda: rollout_benchmark_table(result))


@bench_command.command("cluster")
@click.argument("robot", default="ant", shell_complete=complete_robots)
@robot_option_flag
@own_policy_option
@cluster_option
@integer_option("--rollouts", least=40, default=480, help="Number of roll-outs per round.")
@integer_option("--steps", least=10, default=60, help="Number of control steps per roll-out.")
@integer_option("--rounds", default=3, help="Number of rounds to measure.")
@integer_option("--cores-per-node", default=16, help="Number of cores of each simulated node.")
@json_option
def bench_cluster_command(
    robot: str,
    robot_options: tuple[str, ...],
    policy: str,
    cluster: RayCluster | None,
    as_json: bool,
    **sizes: int,
) -> None:
    """Measure what roll-outs cost on a cluster (by default this machine's), and simulate larger ones."""
    from pdtui.benchmarks.benchmark_tables import cluster_benchmark_tables
    from pdtui.benchmarks.cluster_benchmark import bench_cluster
    from pdtui.robots import RobotSpec

    world = RobotSpec(robot, parse_robot_options(robot, robot_options))
    with cluster or RayCluster() as joined, progress_bar("measuring", quiet=as_json) as advance:
        result = bench_cluster(world, policy or robot, joined, progress=advance, **sizes)
    print_result(asdict(result), as_json, lambda: cluster_benchmark_tables(result))


@bench_command.command("accelerator")
@own_policy_option
@integer_option("--units", least=0, default=0, help="Number of units to screen, evenly spaced; 0 for all.")
@integer_option("--starts", least=2, default=6, help="Number of starts, the same for every unit.")
@integer_option("--steps", least=10, default=60, help="Number of control steps per roll-out.")
@integer_option("--workers", default=2, help="Number of worker processes on the CPU.")
@json_option
def bench_accelerator_command(policy: str, as_json: bool, **sizes: Any) -> None:
    """Screen the Ant's units with MJX, on a GPU if there is one, and with MuJoCo on the CPU.

    Needs pdtui[mjx]; nothing else does.
    """
    from pdtui.benchmarks.benchmark_tables import accelerator_benchmark_tables
    from pdtui.robots import RobotSpec

    try:
        from pdtui.benchmarks.accelerator.accelerator_benchmark import bench_accelerator
    except ImportError as error:
        raise PdtuiError(f"{error.name} is not installed; pip install 'pdtui[mjx]' brings it") from error
    with progress_bar("measuring", quiet=as_json) as advance:
        result = bench_accelerator(RobotSpec("ant"), policy or "ant", progress=advance, **sizes)
    print_result(asdict(result), as_json, lambda: accelerator_benchmark_tables(result))


@bench_command.command("record")
@click.argument("robot", shell_complete=complete_robots)
@robot_option_flag
@map_option
@integer_option("--steps", least=100, default=6000, help="Number of control steps per drive.")
@json_option
def bench_record_command(
    robot: str, robot_options: tuple[str, ...], map_name: str | None, steps: int, as_json: bool
) -> None:
    """Measure the CPU time and disk space of recording at 50 Hz."""
    from pdtui.benchmarks.benchmark_tables import recording_benchmark_table
    from pdtui.benchmarks.recording_benchmark import bench_record

    config = build_drive_config(robot, map_name, "", robot_options=robot_options)
    with progress_bar("measuring", quiet=as_json) as advance:
        result = bench_record(config, steps=steps, progress=advance)
    print_result(asdict(result), as_json, lambda: recording_benchmark_table(result))


@bench_command.command("memory")
@click.argument("robot", shell_complete=complete_robots)
@robot_option_flag
@map_option
@integer_option(
    "--steps",
    least=100,
    default=180_000,
    help="Number of control steps to drive; an hour at 50 Hz has 180,000.",
)
@record_activations_option
@json_option
def bench_memory_command(
    robot: str,
    robot_options: tuple[str, ...],
    map_name: str | None,
    steps: int,
    activations: ActivationsKept,
    as_json: bool,
) -> None:
    """Measure memory while a long drive is recorded and replayed."""
    from pdtui.benchmarks.benchmark_tables import memory_benchmark_table
    from pdtui.benchmarks.recording_benchmark import bench_memory

    config = build_drive_config(robot, map_name, "", robot_options=robot_options, activations=activations)
    with progress_bar("driving", quiet=as_json) as advance:
        result = bench_memory(config, steps=steps, progress=advance)
    print_result(asdict(result), as_json, lambda: memory_benchmark_table(result))


@bench_command.command("screen")
@click.argument("robot", shell_complete=complete_robots)
@robot_option_flag
@map_option
@click.option(
    "--seconds",
    type=click.FloatRange(1.0),
    default=15.0,
    show_default=True,
    metavar="SECONDS",
    help="How long to measure each of three: the loop without a screen, the screen, the screen with a ghost.",
)
@json_option
def bench_screen_command(
    robot: str, robot_options: tuple[str, ...], map_name: str | None, seconds: float, as_json: bool
) -> None:
    """Measure the time to the first frame, the screen's CPU time, the time from a key to its echo, and by how
    much control steps are late, compared with the loop without a screen."""
    from pdtui.benchmarks.benchmark_tables import screen_benchmark_table
    from pdtui.benchmarks.screen_benchmark import bench_screen

    # An error shows before the screen starts.
    config = build_drive_config(robot, map_name, "", robot_options=robot_options)
    drive_map = config.stimulation_map
    arguments = [robot, "--no-record", *(["--map", map_name] if map_name else [])]
    arguments += [part for text in robot_options for part in ("--robot-option", text)]
    behaviors = drive_map.behaviors.values()
    lasting = [one.key for one in behaviors if one.period is None and one.onset is None]
    sent = [" " if key == "space" else key for key in (*lasting[:1], drive_map.default_key)]
    typed = len(sent) == 2 and all(len(key) == 1 for key in sent)
    result = bench_screen(config, arguments, seconds, sent if typed else ())
    print_result(asdict(result), as_json, lambda: screen_benchmark_table(result))
