"""The paper's experiments behind `pdtui evaluate --experiment`, and their own options."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pdtui.cli.output.command_output import print_result
from pdtui.core.console.progress_bar import progress_bar

if TYPE_CHECKING:
    from pdtui.paper.experiment import Experiment


def find_experiments() -> dict[str, Experiment]:
    """Return the paper's experiments by name; none where `pdtui.paper` is not installed."""
    try:
        from pdtui.paper.experiment import list_experiments
    except ModuleNotFoundError as error:
        if error.name == "pdtui.paper":
            return {}
        raise
    return list_experiments()


EXPERIMENTS = find_experiments()


def experiment_options(command: click.Command) -> click.Command:
    """Add the options of the experiments to a command; an option that it already has serves both."""
    takers: dict[click.Option, list[str]] = {}
    for name, experiment in EXPERIMENTS.items():
        for option in experiment.options:
            takers.setdefault(option, []).append(name)
    present = {option.name for option in command.params}
    for option, names in takers.items():
        if option.name in present:
            continue
        option.help = f"With --experiment {' or '.join(names)}: {option.help}"
        command.params.append(option)
    return command


def check_experiment(
    chosen: str | None, others: Sequence[str], pictures: Sequence[Path], options: Mapping[str, Any]
) -> None:
    """Refuse what the experiment, or a command without one, would otherwise silently ignore.

    Raises:
        UsageError: The experiment takes no such options, or there is none.
    """
    if chosen is None and options:
        raise click.UsageError(f"{_flag(options)} needs --experiment")
    experiment = EXPERIMENTS.get(chosen or "")
    if experiment is None:
        return  # where `pdtui.paper` is not installed, running one will say so
    name, own = experiment.name, [option.name for option in experiment.options]
    if foreign := {option: value for option, value in options.items() if option not in own}:
        raise click.UsageError(f"--experiment {name} has no option {_flag(foreign)}")
    if others and not experiment.takes_several_maps:
        raise click.UsageError(f"--experiment {name} takes one map")
    if pictures and not experiment.draws_pictures:
        raise click.UsageError(f"--experiment {name} draws no pictures; leave -o out")


def _flag(options: Mapping[str, Any]) -> str:
    """The first of these options as it is typed."""
    name = next(iter(options))
    return next(one.opts[0] for e in EXPERIMENTS.values() for one in e.options if one.name == name)


def run_experiment(name: str, as_json: bool, **request: Any) -> None:
    """Run an experiment and print its result."""
    from pdtui.paper.experiment import ExperimentRequest

    experiment = EXPERIMENTS[name]
    with progress_bar(experiment.progress_label, quiet=as_json) as advance:
        report = experiment.run(ExperimentRequest(**request, progress=advance))
    print_result(report.data, as_json, lambda: report.table)
    if report.pictures and not as_json:
        click.echo(f"wrote {', '.join(map(str, report.pictures))}")
