"""What `pdtui dissect` runs: dissect, then write the map."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from pdtui.core.atomic_file import check_writable, write_file
from pdtui.core.errors import MapError
from pdtui.dissection.dissect import dissect
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.dissection_settings import DissectionSettings
from pdtui.dissection.dissection_summary import summarise_dissection
from pdtui.dissection.dissection_tables import render_dissection
from pdtui.dissection.draft_map import draft_map
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions
from pdtui.stimulation.map_library import find_map
from pdtui.stimulation.map_reader import load_map, parse_map


@dataclass(frozen=True)
class WrittenDissection:
    """A dissection and the map that was written from it."""

    dissection: Dissection
    output: Path
    behaviors: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """The form that ``--json`` prints."""
        return {**summarise_dissection(self.dissection), "map": str(self.output)}

    def table(self) -> RenderableType:
        """What the command prints."""
        names = ", ".join(self.behaviors) or "no behavior: none reached what was asked of it"
        return Group(render_dissection(self.dissection), Text(f"wrote {self.output}: {names}"))


def dissect_into_map(
    robot: str,
    policy: str,
    output: Path,
    *,
    import_options: ImportOptions = NO_OPTIONS,
    overwrite: bool,
    preset: str,
    settings: Sequence[str] = (),
    episodes: int,
    seed: int,
    workers: int,
    budget_minutes: float | None,
    start_from: str | None = None,
    effort: DissectionSettings | None = None,
    progress: Callable[..., None] | None = None,
) -> WrittenDissection:
    """Dissect a policy and write the map that its measurements propose.

    Killed on the way, the same call goes on where it was: its roll-outs are in `journal_path` the map.

    Raises:
        MapError: the map exists already or cannot be written; seen before the work starts.
        PdtuiError: as `dissect`.
    """
    if output.exists() and not overwrite:
        raise MapError(f"{output}: exists already; --overwrite replaces it, -o writes elsewhere")
    check_writable(output, MapError)

    def advance(stage: str, done: int, total: int) -> None:
        if progress is not None:
            progress(done, total, stage)

    dissection = dissect(
        robot,
        policy,
        import_options=import_options,
        preset=preset,
        settings=settings,
        episodes=episodes,
        seed=seed,
        workers=workers,
        budget_minutes=budget_minutes,
        effort=effort,
        progress=advance,
        journal=journal_path(output),
        start_from=None if start_from is None else load_map(find_map(start_from)),
    )
    text = draft_map(dissection)
    stimulation_map = parse_map(text, str(output))
    write_file(output, text, MapError)
    return WrittenDissection(dissection, output, tuple(stimulation_map.behaviors))


def journal_path(output: Path) -> Path:
    """Where the roll-outs of an unfinished dissection are kept: beside the map."""
    return output.with_name(f".{output.stem}.rollouts")
