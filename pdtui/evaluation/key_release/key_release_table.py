"""The table of `pdtui evaluate --let-go`."""

from __future__ import annotations

from rich.table import Table

from pdtui.core.console.text_tables import format_seed_range, new_table
from pdtui.evaluation.key_release.key_release_evaluation import WALKS_ON, KeyReleaseEvaluation


def key_release_table(result: KeyReleaseEvaluation) -> Table:
    """Return one row per behavior."""
    table = new_table(
        f"Letting go: {result.robot}, policy {result.policy}, {format_seed_range(result.seeds)}",
        *("behavior", "held (steps)", "failed while held", "failed after [95 %]", "by itself", "walks on"),
    )
    for row in result.behaviors:
        share = f" [{row.low:.0%}, {row.high:.0%}]" if row.let_go else ""
        table.add_row(
            row.behavior,
            f"{row.held}",
            f"{row.failed_while_held}/{row.failed_while_held + row.let_go}",
            f"{row.failed}/{row.let_go}{share}",
            f"{row.failed_by_itself}/{row.by_itself}",
            "–" if row.walks_on is None else f"{row.walks_on}/{row.let_go}",
        )
    table.caption = (
        f"Failed after: within {result.followed} control steps of the release, of the runs that had not "
        "failed before; by itself: in the same steps of the same seeds without a press. Walks on: at least "
        f"{WALKS_ON:.0%} of the speed without a press in the last 2 s. Behaviors that hold a target are left "
        "out."
    )
    return table
