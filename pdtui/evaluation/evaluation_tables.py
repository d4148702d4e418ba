"""The tables of targets, of a policy alone and of `pdtui tune`."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group
from rich.table import Table

from pdtui.core.confidence_intervals import PairedRatio
from pdtui.core.console.text_tables import format_mean_with_interval, format_seed_range, new_table
from pdtui.core.outcome import Outcome, count_failures, describe_outcomes, failure_noun
from pdtui.evaluation.policy_evaluation import PolicyEvaluation
from pdtui.search.gains.gain_tuning import TunedGains
from pdtui.search.gains.step_response import StepResponseSummary
from pdtui.search.gains.tracking_summary import TrackingSummary


def policy_evaluation_table(result: PolicyEvaluation) -> Table:
    """Return the performance of the policy alone."""
    table = new_table(
        f"Policy alone, {format_seed_range(result.seeds)}, {result.steps} steps each", "measure", "value"
    )
    for name, speed in (("mean speed (m/s)", result.mean_speed), ("net speed (m/s)", result.net_speed)):
        if speed is not None:
            table.add_row(name, f"{speed:.2f}")
    table.add_row("return", f"{result.mean_return:.0f} ± {result.std_return:.0f}")
    others = result.outcomes.keys() - {Outcome.FELL, Outcome.OUT_OF_TIME}
    if Outcome.ARRIVED in others or any(result.outcomes[one] for one in others):
        table.add_row("outcomes", describe_outcomes(result.outcomes, len(result.seeds)))
    else:
        upright = len(result.seeds) - count_failures(result.outcomes)
        table.add_row("episodes without a fall", f"{upright}/{len(result.seeds)}")
    return table


def tracking_table(result: TrackingSummary) -> Table:
    """Return one row per target, and the mean."""
    unit = result.unit
    table = new_table(
        f"{result.behavior}: {result.attribute} ({unit}), {format_seed_range(result.seeds)}, "
        f"{describe_outcomes(result.outcomes, len(result.seeds))}",
        *(f"target ({unit})", "mean |error|", "last 25 steps", "without the gait"),
    )
    for row in result.targets:
        table.add_row(f"{row.target:+.2f}", f"{row.error:.3f}", f"{row.settled:.3f}", f"{row.bias:.3f}")
    table.add_section()
    table.add_row("mean", _with_interval(result), f"{result.settled:.3f}", f"{result.bias:.3f}")
    by_itself = ""
    if result.default_error is not None:
        table.add_row("without control", f"{result.default_error:.3f}", "", "")
        by_itself = f" Without control: {describe_outcomes(result.default_outcomes, len(result.seeds))}."
    responses = result.responses
    table.caption = (
        f"Rise time {_rise(responses)} s; {responses.unrisen} of {responses.steps} steps not risen; "
        f"overshoot {_overshoot(responses)}. Without the gait: |mean error| of the last 25 steps.{by_itself}"
    )
    return table


def tuning_table(results: list[TunedGains]) -> Group:
    """Return the gains and figures of each behavior: those of the map, and what tuning found."""
    return Group(*(part for result in results for part in (_gains_table(result), result.verdict)))


def _gains_table(result: TunedGains) -> Table:
    trials = result.trials.values()
    tracking = [trial.tracking for trial in trials]
    title = f"{result.behavior}: {tracking[0].attribute}, {format_seed_range(tracking[0].seeds)}"
    names = {"map": "in the map", "proportional": "best P alone", "found": "best found"}
    table = new_table(title, "", *(names[name] for name in result.trials))
    for gain in ("kp", "ki", "kd", "limit"):
        table.add_row(gain, *(f"{getattr(trial.pid, gain):.3g}" for trial in trials))
    table.add_section()
    add_tracking_figures(table, tracking)
    ratios = [trial.ratio for trial in trials]
    table.add_row(f"|error| / that of {names[result.kept]}", *map(format_ratio, ratios))
    table.caption = "Falls count as errors in the last row; its intervals are 95 %, paired by seed."
    return table


def format_ratio(ratio: PairedRatio | None) -> str:
    """Return a ratio and its interval as text; nothing where there is none."""
    return "" if ratio is None else format_mean_with_interval(ratio.value, ratio.low, ratio.high)


def add_tracking_figures(table: Table, columns: Sequence[TrackingSummary]) -> None:
    unit, responses = columns[0].unit, [one.responses for one in columns]
    table.add_row(f"mean |error| ({unit})", *(_with_interval(one) for one in columns))
    table.add_row("over the last 25 steps", *(f"{one.settled:.3f}" for one in columns))
    table.add_row("their mean: without the gait", *(f"{one.bias:.3f}" for one in columns))
    table.add_row("rise time (s)", *map(_rise, responses))
    table.add_row("steps not risen", *(f"{one.unrisen} of {one.steps}" for one in responses))
    table.add_row("overshoot", *map(_overshoot, responses))
    failures = (describe_outcomes(one.outcomes, len(one.seeds)).removeprefix("falls ") for one in columns)
    table.add_row(failure_noun(columns[0].outcomes), *failures)


def _with_interval(figures: TrackingSummary) -> str:
    return format_mean_with_interval(figures.error, figures.low, figures.high, ".3f")


def _rise(responses: StepResponseSummary) -> str:
    return "–" if responses.rise is None else f"{responses.rise:.2f}"


def _overshoot(responses: StepResponseSummary) -> str:
    return "–" if responses.overshoot is None else f"{responses.overshoot:.0%}"
