"""What `pdtui study matching` prints."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from rich.console import Group
from rich.table import Table

from pdtui.core.console.text_tables import new_table
from pdtui.study.matching.matching_study_plan import StudiedPolicy
from pdtui.study.matching.steerability_scores import (
    SCORE_SENTENCE,
    describe_best_and_shipped,
    score_headers,
    score_rows,
    score_steerability,
)
from pdtui.study.matching.study_data import MatchingStudyData
from pdtui.study.matching.study_page import answer_in_one_sentence, variant_headers, variant_rows
from pdtui.study.matching.study_statistics import MEASURES, StudyResult


@dataclass(frozen=True)
class StudySummary:
    """The result as a table and as JSON."""

    data: MatchingStudyData
    result: StudyResult

    @property
    def answer(self) -> str:
        """One sentence."""
        return answer_in_one_sentence(self.data, self.result)

    def tables(self) -> Group:
        """Return the table of the variants, and that of the scores where a robot has several policies."""
        scores = score_steerability(self.data)
        if not scores:
            return Group(self._variant_table())
        # The page has the attributes, too, for which a terminal has no room.
        headers = score_headers()
        shown = [headers.index(name) for name in ("policy", "walking", "steering (halves)", "score")]
        table = new_table("Walking and steering", *(headers[column] for column in shown))
        for row in score_rows(scores):
            table.add_row(*(row[column] for column in shown))
        table.caption = f"{SCORE_SENTENCE} {describe_best_and_shipped(scores).replace('`', '')}"
        return Group(self._variant_table(), table)

    def _variant_table(self) -> Table:
        plan = self.data.plan
        count = f"{len(self.result.figures)} of the {len(plan.policies)} policies wanted"
        table = new_table(f"Matching and steering: {count}", *variant_headers(plan.settings.best))
        for row in variant_rows(self.result):
            table.add_row(*row)
        return table

    def as_dict(self) -> dict[str, Any]:
        """Return everything as JSON data."""
        result = self.result
        references = ("random", "probing", "probing_correlation", "ceiling")
        return {
            "answer": str(result.answer),
            "sentence": self.answer,
            "wanted": len(self.data.plan.policies),
            "policies": [asdict(one) for one in self.data.policies],
            "variants": {
                name: {measure: asdict(one) for measure, one in zip(MEASURES, means, strict=True)}
                for name, means in result.variants.items()
            },
            **{name: asdict(getattr(result, name)) for name in references},
            "scores": [
                {**asdict(one), "policy": one.policy.name, "robot": one.policy.robot, "score": one.score}
                for one in score_steerability(self.data)
            ],
            "figures": [
                {**asdict(one), "variants": dict(zip(result.variants, one.variants.tolist(), strict=True))}
                for one in result.figures
            ],
        }


@dataclass(frozen=True)
class ListedPolicies:
    """The policies of a plan: whether each is trained, and the command that trains it."""

    rows: Sequence[tuple[str, bool, str]]

    def table(self) -> Table:
        """Return them as a table."""
        table = new_table("", "policy", "trained", "command", left=("policy", "trained", "command"))
        for name, trained, command in self.rows:
            table.add_row(name, "yes" if trained else "no", command or "it comes with pdtui")
        return table

    def as_list(self) -> list[dict[str, Any]]:
        """Return them as JSON data."""
        return [{"policy": name, "trained": trained, "command": one} for name, trained, one in self.rows]


def list_policies(
    found: Iterable[StudiedPolicy], missing: Iterable[StudiedPolicy], folder: str
) -> ListedPolicies:
    """Return the policies that are trained, and then the others."""
    return ListedPolicies(
        [
            *((one.name, True, one.command(folder)) for one in found),
            *((one.name, False, one.command(folder)) for one in missing),
        ]
    )
