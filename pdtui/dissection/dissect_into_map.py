"""Dissect a policy into a map, as `pdtui dissect` does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from pdtui.core.atomic_file import check_writable, write_file
from pdtui.core.errors import MapError
from pdtui.dissection.dissect import dissect
from pdtui.dissection.dissection_config import DissectionConfig
from pdtui.dissection.dissection_result import Dissection
from pdtui.dissection.dissection_summary import summarize_dissection
from pdtui.dissection.dissection_text import render_dissection
from pdtui.dissection.draft_map import draft_map
from pdtui.stimulation.map_policy_lookup import relative_policy_name
from pdtui.stimulation.map_reader import parse_map
from pdtui.stimulation.map_writer import replace_policy


@dataclass(frozen=True)
class WrittenDissection:
    """A dissection, and the map with these behaviors and the pictures that were written from it."""

    dissection: Dissection
    output: Path
    behaviors: tuple[str, ...]
    pictures: tuple[Path, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the form that ``--json`` prints."""
        written = {"map": str(self.output), "pictures": [str(path) for path in self.pictures]}
        return {**summarize_dissection(self.dissection), **written}

    def table(self) -> RenderableType:
        """Return what the command prints."""
        names = ", ".join(self.behaviors) or "no behaviors, because none reached its goal"
        return Group(render_dissection(self.dissection), Text(f"wrote {self.output}: {names}"))


def dissect_into_map(
    config: DissectionConfig,
    output: Path,
    *,
    overwrite: bool = False,
    draw: Callable[[Dissection], Sequence[Path]] = lambda _: (),
) -> WrittenDissection:
    """Dissect a policy, and write the map that its measurements propose.

    Roll-outs are kept in `journal_path` until the map and the pictures are written, so that the same call
    continues where an interrupted one stopped.

    The journal of `config` is not used. `draw` draws the pictures, and returns their files.

    Raises:
        MapError: The map already exists or cannot be written. Found out before the work starts.
        PdtuiError: As `dissect` and `draw` do.
    """
    if output.exists() and not overwrite:
        raise MapError(f"{output}: already exists; --overwrite replaces it, -o writes elsewhere")
    check_writable(output, MapError)
    journal = journal_path(output)
    dissection = dissect(replace(config, journal=journal))
    named = relative_policy_name(dissection.policy, dissection.import_options, output)
    text = replace_policy(draft_map(dissection), *named, str(output))
    behaviors = tuple(parse_map(text, str(output)).behaviors)
    write_file(output, text, MapError)
    pictures = tuple(draw(dissection))
    journal.unlink(missing_ok=True)
    return WrittenDissection(dissection, output, behaviors, pictures)


def journal_path(output: Path) -> Path:
    """Return the file beside the map that keeps the roll-outs of an unfinished dissection."""
    return output.with_name(f".{output.stem}.rollouts")
