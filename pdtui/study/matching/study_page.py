"""The page of the guide and the figures that the matching study writes from its data."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from pdtui.core.atomic_file import check_writable, write_file
from pdtui.core.console.text_tables import format_mean_with_interval, format_p_value
from pdtui.core.errors import StudyError
from pdtui.pictures.rerun_report_file import rows_to_markdown
from pdtui.pictures.studies.compared_means import ComparedMean, ComparisonPanel, draw_compared_means
from pdtui.study.matching.steerability_scores import (
    SCORE_SENTENCE,
    describe_best_and_shipped,
    score_headers,
    score_rows,
    score_steerability,
)
from pdtui.study.matching.study_data import MatchingStudyData, PolicyFacts
from pdtui.study.matching.study_statistics import MEASURES, PolicyMeans, StudyAnswer, StudyResult, TestedMean

PAGE = "matching-study.md"
_TEMPLATE = Path(__file__).with_name("study_page_template.md")
HITS_FIGURE, AGREEMENT_FIGURE = "matching-study-hits.png", "matching-study-agreement.png"


def answer_in_one_sentence(data: MatchingStudyData, result: StudyResult) -> str:
    """Return the answer to the title of the page."""
    count = len(result.figures)
    if result.answer is StudyAnswer.UNKNOWN:
        walking = "one policy that walks is" if count == 1 else f"{count} policies that walk are"
        return f"Unknown: {walking} too few for the test to pass, whatever they show."
    first = result.variants[data.plan.primary][MEASURES.index("first")]
    means = (
        f"on {count} policies, the first match is among the strongest tenth of units for {first.mean:.0%} of "
        f"the attributes, and a random unit for {result.random.mean:.0%} (p {_equals(first.p)})"
    )
    words = {
        StudyAnswer.YES: "Yes, matching finds what steers",
        StudyAnswer.SELDOM: "Better than chance, but seldom",
        StudyAnswer.NO: "No evidence that matching finds what steers",
    }
    return f"{words[result.answer]}: {means}."


def variant_rows(result: StudyResult) -> list[tuple[str, ...]]:
    """Return the rows of the main table: one for each variant, then what they are compared with."""

    def cell(one: TestedMean) -> str:
        shown = format_mean_with_interval(one.mean, one.low, one.high)
        return shown if np.isnan(one.corrected) else f"{shown}, p {_equals(one.corrected)}"

    none = "–"
    return [
        *((name, *map(cell, means)) for name, means in result.variants.items()),
        ("random units", cell(result.random), cell(result.random), none, none),
        ("best of the random units by probing", cell(result.probing), none, none, none),
        ("ranks by probing", none, none, cell(result.probing_correlation), none),
    ]


def variant_headers(best: int) -> list[str]:
    """Return the headings of these rows."""
    return ["matching", "first match hits", f"best {best} hit", "rank correlation", "sign agrees"]


def _equals(p: float) -> str:
    text = format_p_value(p)
    return text if text.startswith("<") else f"= {text}"


def page_files(guide: Path) -> list[Path]:
    """Return the files that `write_study_page` writes: the page, and its figures."""
    return [guide / PAGE, guide / "images" / HITS_FIGURE, guide / "images" / AGREEMENT_FIGURE]


def check_page_files(guide: Path, overwrite: bool) -> None:
    """Find out before long work whether the page and its figures can be written; else a `StudyError`."""
    for path in page_files(guide):
        if path.exists() and not overwrite:
            raise StudyError(f"{path}: already exists; --overwrite replaces it")
        check_writable(path, StudyError)


def write_study_page(data: MatchingStudyData, result: StudyResult, guide: Path) -> list[Path]:
    """Write the page and its figures into the folder of a guide, and return their paths.

    Raises:
        PdtuiError: A file cannot be written.
    """
    page, hits, agreement = page_files(guide)
    draw_study_figures(data, result, hits, agreement)
    write_file(page, compose_study_page(data, result), StudyError)
    return [page, hits, agreement]


def compose_study_page(data: MatchingStudyData, result: StudyResult) -> str:
    """Return the page as Markdown."""
    plan, count = data.plan, len(result.figures)
    left_out = [one for one in data.policies if not one.walks]
    one = len(left_out) == 1
    more = "One more was trained, but does" if one else f"{len(left_out)} more were trained, but do"
    dropped = f" {more} not walk by the rule of the plan." if left_out else ""
    scores = score_steerability(data)
    best, settings = plan.settings.best, plan.settings
    listed = ["policy", "net speed", "return", "episodes failed", "units", "roll-outs", "in the study"]
    return _TEMPLATE.read_text().format(
        answer=answer_in_one_sentence(data, result),
        count=count,
        wanted=len(plan.policies),
        dropped=dropped,
        hits_figure=HITS_FIGURE,
        agreement_figure=AGREEMENT_FIGURE,
        best=best,
        variants=rows_to_markdown(variant_headers(best), variant_rows(result)),
        reference_units=settings.reference_units,
        drawn_units=settings.reference_units + settings.random_units,
        ceiling=format_mean_with_interval(*_ends(result.ceiling)),
        tests=len(plan.variants) * len(MEASURES),
        kinds=_group_table(data, result, lambda one: one.kind),
        settings=_group_table(data, result, lambda one: one.setting),
        policies=rows_to_markdown(listed, [_policy_row(one) for one in data.policies]),
        score_sentence=SCORE_SENTENCE,
        best_policies=describe_best_and_shipped(scores) or "No robot has several policies.",
        scores=rows_to_markdown(score_headers(), score_rows(scores)),
        value=f"{max(settings.values):g}",
        choosing=settings.choosing_seed,
        walks=len(plan.walking.seeds),
        walking=f"{plan.walking.seeds[0]}–{plan.walking.seeds[-1]}",
        commands="\n".join(one.command("FOLDER") for one in plan.policies if not one.shipped),
        plan=plan.text.strip(),
        monitored=f"{settings.monitored[0]}–{settings.monitored[-1]}",
        held_out=settings.held_out_seed,
    )


def _group_table(data: MatchingStudyData, result: StudyResult, group: Callable[[PolicyFacts], str]) -> str:
    """Return the figures of the primary variant by groups of policies, as Markdown."""
    place = list(data.plan.variants).index(data.plan.primary)
    rows, groups = [], defaultdict[str, list[str]](list)
    for one in data.policies:
        groups[group(one)].append(one.name)
    for name, members in groups.items():
        figures = [one for one in result.figures if one.policy in members]
        if not figures:
            continue

        def mean(read: Callable[[PolicyMeans], float], some: Sequence[PolicyMeans] = figures) -> str:
            values = np.array([read(one) for one in some])
            known = values[np.isfinite(values)]
            return f"{known.mean():.2f}" if len(known) else "–"

        cells = [
            mean(lambda one, number=number: float(one.variants[place, number]))  # type: ignore[misc]
            for number in range(len(MEASURES))
        ]
        others = [mean(lambda one: one.random), mean(lambda one: one.probing), mean(lambda one: one.ceiling)]
        rows.append((name, str(len(figures)), *cells, *others))
    headers = [
        *("policies", "number", "first match", f"best {data.plan.settings.best}", "rank correlation", "sign"),
        *("random units", "best by probing", "noise ceiling"),
    ]
    return f"Means by `{data.plan.primary}`.\n\n" + rows_to_markdown(headers, rows)


def _policy_row(one: PolicyFacts) -> tuple[str, ...]:
    return (
        f"`{one.name}`",
        f"{one.net_speed:.2f} m/s",
        f"{one.mean_return:.0f}",
        f"{one.failures:.0%}",
        *((str(one.units), str(one.rollouts), "yes") if one.walks else ("–", "–", "no")),
    )


def draw_study_figures(data: MatchingStudyData, result: StudyResult, hits: Path, agreement: Path) -> None:
    """Draw hit rates into one file, and correlations and signs into another.

    Raises:
        PictureError: A file cannot be written.
    """

    def rows(measure: int) -> list[ComparedMean]:
        return [
            ComparedMean(
                name,
                np.array([one.variants[number, measure] for one in result.figures]),
                *_ends(means[measure]),
            )
            for number, (name, means) in enumerate(result.variants.items())
        ]

    def reference(name: str, field: str) -> ComparedMean:
        values = np.array([getattr(one, field) for one in result.figures])
        return ComparedMean(name, values, *_ends(getattr(result, field)), reference=True)

    chance, best = 1 - data.plan.quantile, data.plan.settings.best
    random, probing = reference("random units", "random"), reference("best by probing", "probing")
    count = f"{len(result.figures)} policies"
    draw_compared_means(
        hits,
        f"Hits of matching, {count}",
        [
            ComparisonPanel(
                "First match", "share of attributes", [*rows(0), random, probing], chance, (-0.02, 1.02)
            ),
            ComparisonPanel(
                f"Best {best} matches", "share of units", [*rows(1), random], chance, (-0.02, 1.02)
            ),
        ],
    )
    correlation = reference("probing", "probing_correlation")
    draw_compared_means(
        agreement,
        f"Ranks and signs of matching, {count}",
        [
            ComparisonPanel(
                "Ranks", "rank correlation with strength", [*rows(2), correlation], 0.0, (-0.6, 1.02)
            ),
            ComparisonPanel("Sign of phase", "share that agrees", rows(3), 0.5, (-0.02, 1.02)),
        ],
    )


def _ends(one: TestedMean) -> tuple[float, float, float]:
    return one.mean, one.low, one.high
