"""What `pdtui dynamics` prints and draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from rich.table import Table

from pdtui.core.console.text_tables import format_mean_with_interval, new_table
from pdtui.pictures.studies.learning_course import CourseCurve, CoursePanel, LearningCourse
from pdtui.study.dynamics.learning_dynamics import CorrelationInterval, LearningDynamics, mean_known


def summarize_dynamics(run: LearningDynamics) -> dict[str, Any]:
    """Return the course of one run as JSON data, with the correlations."""
    return {
        "run": run.name,
        "robot": run.robot,
        "primitives": dict(zip(run.attributes, run.units, strict=True)),
        "correlations": {name: one._asdict() for name, one in _correlations(run).items()},
        "checkpoints": [
            {**asdict(one), "normalized_discrepancies": row.tolist()}
            for one, row in zip(run.checkpoints, run.normalized_discrepancies(), strict=True)
        ],
    }


def _correlations(run: LearningDynamics) -> dict[str, CorrelationInterval]:
    return {
        "discrepancy and return": run.correlate_with_discrepancy(run.returns),
        "discrepancy and success": run.correlate_with_discrepancy(run.success),
        "discrepancy of all units and return": run.correlate_with_mean_discrepancy(run.returns),
        "effect and return": run.correlate_with_effect(run.returns),
    }


def dynamics_table(runs: Sequence[LearningDynamics]) -> Table:
    """Return rank correlations over the checkpoints of each run, with their 95 % intervals."""
    names = list(_correlations(runs[0]))
    title = f"Learning dynamics of {runs[0].robot}: rank correlations over checkpoints"
    table = new_table(title, "run", "checkpoints", *names)
    for run in runs:
        cells = [
            "–" if np.isnan(one.value) else format_mean_with_interval(*one)
            for one in _correlations(run).values()
        ]
        table.add_row(run.name, str(len(run.checkpoints)), *cells)
    return table


def build_learning_course(runs: Sequence[LearningDynamics]) -> LearningCourse:
    """Return what the pictures of some runs of one robot show."""

    def by_attribute(run: LearningDynamics, values: np.ndarray[Any, np.dtype[np.float64]]) -> dict[str, Any]:
        return dict(zip(run.attributes, values.T, strict=True))

    discrepancies, effects, scores = [], [], []
    for run in runs:
        own, all_units = run.normalized_discrepancies(), run.normalized_mean_discrepancies()
        discrepancies.append(
            [
                CourseCurve("final primitives", mean_known(own), by_attribute(run, own)),
                CourseCurve("all units", mean_known(all_units), compared=True),
            ]
        )
        effects.append(
            [
                CourseCurve("final primitives", mean_known(run.effects()), by_attribute(run, run.effects())),
                CourseCurve("random units", mean_known(run.effects(random=True)), compared=True),
            ]
        )
        low, high = run.returns.min(), run.returns.max()
        scores.append(
            [
                CourseCurve("return", (run.returns - low) / (high - low if high > low else 1.0)),
                CourseCurve("success", run.success, compared=True),
            ]
        )
    return LearningCourse(
        f"Learning dynamics of {runs[0].robot}",
        [run.steps for run in runs],
        [
            CoursePanel("discrepancy, 0 to 1", discrepancies),
            CoursePanel("effect (sd)", effects),
            CoursePanel("score, 0 to 1", scores),
        ],
        dynamics_table(runs),
        {"runs": [summarize_dynamics(run) for run in runs]},
    )
