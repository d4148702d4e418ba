"""The progress of long work, on standard error."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress_bar(label: str, quiet: bool = False) -> Iterator[Callable[..., None] | None]:
    """Show a progress bar on standard error and yield ``advance(done, total, note="")``; None if `quiet`."""
    if quiet:
        yield None
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    text, bar, _, remaining = Progress.get_default_columns()
    columns = (text, bar, MofNCompleteColumn(), TimeElapsedColumn(), remaining)
    with Progress(*columns, TextColumn("{task.fields[note]}"), console=Console(stderr=True)) as progress:
        task = progress.add_task(label, total=None, note="")

        def advance(done: int, total: int, note: str = "") -> None:
            fields = {"note": escape(note)} if note else {}
            progress.update(task, completed=done, total=total, **fields)  # type: ignore[arg-type]

        yield advance
