"""The tables that `pdtui bench` prints."""

from __future__ import annotations

from rich.console import Group
from rich.table import Table

from pdtui.benchmarks.accelerator.accelerator_benchmark_result import AcceleratorBenchmark
from pdtui.benchmarks.cluster_benchmark import BYTES_PER_SECOND, NODES, ClusterBenchmark
from pdtui.benchmarks.control_loop_benchmark import ControlLoopBenchmark
from pdtui.benchmarks.dissection_benchmark import DissectionBenchmark
from pdtui.benchmarks.recording_benchmark import MemoryBenchmark, RecordingBenchmark
from pdtui.benchmarks.rollout_benchmark import RolloutBenchmark
from pdtui.benchmarks.screen_benchmark import ScreenBenchmark
from pdtui.core.console.text_tables import new_table


def loop_benchmark_table(result: ControlLoopBenchmark) -> Table:
    """Return the steps per second of each part, and its share of the bare simulator."""
    table = new_table("Control loop", "part", "steps/s", "share of bare")
    for name in ("bare", "policy", "stimulated", "recorded"):
        rate = float(getattr(result, name))
        table.add_row(name, f"{rate:.0f}", f"{rate / result.bare:.0%}")
    table.caption = (
        f"Recorded over bare, median of rounds: {result.recorded_share:.0%}. "
        f"Forward pass with 3 units overwritten: {result.forward_us:.0f} µs; with something added to 64: "
        f"{result.added_us:.0f} µs; with an imprint of 64: {result.imprinted_us:.0f} µs."
    )
    return table


def dissection_benchmark_table(result: DissectionBenchmark) -> Group:
    """Return matching compared with the loop, its growth, and memory and probing."""
    speed = new_table(result.recorded, "preset", "matching", "loop", "speedup", "ranking", "ties")
    for one in result.compared:
        speed.add_row(
            one.preset,
            f"{one.ours_ms:.1f} ms",
            f"{one.loop_ms:.0f} ms",
            f"{one.ratio:.1f}",
            "same" if one.same_ranking else "DIFFERENT",
            str(one.ties),
        )
    speed.caption = (
        "Loop: one librosa.stft per series, one numpy.linalg.norm per pair. Largest relative difference of a "
        f"discrepancy: {max(one.largest_difference for one in result.compared):.0e}."
    )
    released = new_table("Procedure of the authors' released code", "what", "ours", "theirs", "speedup")
    theirs = f"{result.released.released_ms / 1e3:.1f} s"
    ours = {
        "matching": (result.released.matching_ms, result.released.matching_ratio),
        "with phases": (result.released.phases_ms, result.released.phases_ratio),
    }
    for name, (ms, ratio) in ours.items():
        released.add_row(name, f"{ms:.1f} ms", theirs, f"{ratio:.0f}")
    released.caption = (
        "Theirs always computes phases, too. Of its five nearest units of each attribute, "
        f"{result.released.overlap:.0%} are among our five nearest."
    )
    growth = new_table("Time of matching", "grows", "size: ms", "fitted line (ms)", "largest deviation")
    for curve in result.curves:
        points = "  ".join(f"{size}: {ms:.1f}" for size, ms in zip(curve.sizes, curve.ms, strict=True))
        line = f"{curve.fixed_ms:.1f} + {curve.each_ms:.3g} · size"
        growth.add_row(curve.grows, points, line, f"{curve.deviation:.0%}")
    rest = new_table("Memory and probing", "measure", "value")
    rest.add_row(
        f"peak memory with {result.memory_units} units ({result.memory_data_gb:.2f} GB of data)",
        f"{result.memory_peak_gb:.2f} GB",
    )
    rest.add_row("time of matching and correlating them", f"{result.memory_seconds:.1f} s")
    rest.add_row("probing, 1 worker", f"{result.probing_one:.0f} steps/s")
    rest.add_row("probing, 2 workers", f"{result.probing_two:.0f} steps/s")
    rest.add_row("2 workers over 1, median of rounds", f"{result.probing_ratio:.2f}")
    return Group(speed, released, growth, rest)


def rollout_benchmark_table(result: RolloutBenchmark) -> Table:
    """Return the steps per second of roll-outs one by one and in lock step, beside the bare simulators."""
    table = new_table(
        f"Roll-outs of {result.robot}, {result.workers} workers", "part", "steps/s", "share of bare"
    )
    parts = {
        "bare simulators": (result.bare, 1.0),
        "roll-outs one by one": (result.one_by_one, result.one_by_one_share),
        "roll-outs in lock step": (result.lockstep, result.lockstep_share),
    }
    for name, (rate, share) in parts.items():
        table.add_row(name, f"{rate:.0f}", f"{share:.0%}")
    table.caption = (
        f"Lock step over one by one, median of rounds: {result.ratio:.2f}. "
        "Largest difference of an attribute's mean, over its spread among roll-outs: "
        f"{result.difference:.1e}. "
        f"Places in the order of the roll-outs by an attribute that are the same: {result.same_order:.0%}."
    )
    return table


def cluster_benchmark_tables(result: ClusterBenchmark) -> Group:
    """Return the measured cost of roll-outs on a cluster, and the simulated times on larger ones."""
    title = f"Roll-outs of {result.robot}, {result.steps} control steps each, on {result.cores} cores"
    measured = new_table(f"{title}: measured", "measure", "value")
    for name, seconds in (
        ("core time of a roll-out in this process", result.alone),
        ("in worker processes", result.processes),
        ("on the cluster", result.cluster),
    ):
        measured.add_row(name, f"{1000 * seconds:.2f} ms")
    for size, cost in ((1, result.single), (result.per_chunk, result.usual)):
        measured.add_row(f"time for a chunk of {size} that takes no time", f"{1000 * cost.latency:.2f} ms")
        measured.add_row(
            f"processor time of this process for a chunk of {size}", f"{1000 * cost.driver:.2f} ms"
        )
        measured.add_row(f"bytes of a chunk of {size}, sent and answered", f"{cost.bytes:,}")
    measured.add_row(
        f"overhead per roll-out, {result.per_chunk} in a chunk",
        f"{1000 * result.overhead_per_rollout:.2f} ms",
    )
    measured.add_row("bytes per roll-out, sent and answered", f"{result.bytes_per_rollout:.0f}")
    measured.add_row("bytes of the policy, once per node", f"{result.file_bytes:,}")
    batches = [f"{one.batch}: {one.rollouts} roll-outs" for one in result.simulated]
    simulated = new_table("Larger clusters: simulated, not measured", "nodes", "cores", *batches)
    for index, nodes in enumerate(NODES):
        cells = (
            f"{1000 * one.seconds[index]:.0f} ms, × {one.speedup(index):.1f}" for one in result.simulated
        )
        simulated.add_row(str(nodes), str(nodes * result.cores_per_node), *cells)
    simulated.caption = (
        "From what was measured, with one driver, equal nodes that have built their robots, a network of "
        f"{8 * BYTES_PER_SECOND / 1e9:g} Gbit/s and no failure."
    )
    return Group(measured, simulated)


def recording_benchmark_table(result: RecordingBenchmark) -> Table:
    """Return the cost of each way to record at 50 Hz."""
    table = new_table(
        f"Recording at 50 Hz, {result.units} units", "activations", "drive", "share of one core", "MB/min"
    )
    for one in result.costs:
        table.add_row(one.activations, one.driven, f"{one.cpu_share:.1%}", f"{one.mb_a_minute:.2f}")
    return table


def memory_benchmark_table(result: MemoryBenchmark) -> Table:
    """Return the resident memory after each tenth of a long drive."""
    table = new_table(f"Resident memory, {result.steps} steps", "part", "done", "MB")
    for part, sizes in result.resident.items():
        for number, size in enumerate(sizes, start=1):
            table.add_row(part, f"{number * 10} %", f"{size / 1e6:.0f}")
    took = ", ".join(f"{part} {seconds:.0f} s" for part, seconds in result.seconds.items())
    state = "whole" if result.whole else "NOT WHOLE"
    table.caption = f"{result.file_bytes / 1e6:.0f} MB, {state}; {result.verdict}; {took}"
    return table


_LATENESS = {"bare": "no screen", "screen": "screen", "ghost": "screen with a ghost"}


def screen_benchmark_table(result: ScreenBenchmark) -> Table:
    """Return how soon the screen appears and what it costs."""
    table = new_table("Screen of 160×48 cells", "measure", "value")
    table.add_row("first frame", f"{result.first_frame:.2f} s")
    table.add_row("first state of the robot", f"{result.first_state:.2f} s")
    table.add_row(
        f"CPU time of the screen's process over {result.seconds:g} s", f"{result.cpu_share:.0%} of one core"
    )
    if result.ghost_cpu_share is not None:
        table.add_row("the same with a ghost", f"{result.ghost_cpu_share:.0%} of one core")
    for name, late in result.lateness.items():
        table.add_row(
            f"lateness of {late.steps} control steps, {_LATENESS[name]}: median, 99th percentile",
            f"{1000 * late.median:.1f} ms, {1000 * late.p99:.1f} ms",
        )
    for name, times in (("key to its echo", result.echo), ("key to the drive's answer", result.confirmation)):
        if times:
            table.add_row(
                f"{name}, of {len(times)}: median, largest",
                f"{1000 * times[len(times) // 2]:.0f} ms, {1000 * times[-1]:.0f} ms",
            )
    return table


def accelerator_benchmark_tables(result: AcceleratorBenchmark) -> Group:
    """Return the speed of screening on accelerator and CPU, and how far they agree on each attribute."""
    speed = new_table(
        f"Screening the Ant's units: {result.rollouts} roll-outs of {result.steps} control steps",
        "by",
        "seconds",
        "roll-outs/s",
        "falls",
    )
    runs = (
        (f"MJX on {result.device}", result.accelerator_seconds, result.falls[0]),
        (f"MuJoCo, {result.workers} workers", result.cpu_seconds, result.falls[1]),
    )
    for name, seconds, falls in runs:
        speed.add_row(name, f"{seconds:.1f}", f"{result.rollouts / seconds:.0f}", f"{falls:.1%}")
    speed.caption = (
        f"Compiling took another {result.compile_seconds:.0f} s. Both fall, or neither does, in "
        f"{result.same_falls:.1%} of the roll-outs."
    )
    agreement = new_table(
        "Effects of units on attributes",
        "attribute",
        "rank correlation",
        "of halves in MuJoCo",
        "strongest tenth shared",
        "MJX's strongest, on the CPU",
    )
    for one in result.attributes:
        agreement.add_row(
            one.name,
            f"{one.correlation:.2f}",
            f"{one.cpu_correlation:.2f}",
            f"{one.shared:.0%}",
            f"{one.confirmed:.2f}",
        )
    agreement.caption = (
        "Rank correlations are of MJX's effects with MuJoCo's from the same starts, and of MuJoCo's from one "
        "half of the starts with those from the other. The last column is the effect in MuJoCo of what moves "
        "the attribute most in MJX, as a share of the largest."
    )
    return Group(speed, agreement)
