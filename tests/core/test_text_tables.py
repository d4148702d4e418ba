"""Tables: how columns are aligned, and that texts are shown literally."""

from __future__ import annotations

from rich.console import Console

from pdtui.core.console.text_tables import format_seed_range, new_facts_table, new_table


def _shown(table: object) -> list[str]:
    console = Console(width=60, markup=False)
    with console.capture() as capture:
        console.print(table)
    return [line.rstrip() for line in capture.get().splitlines()]


def test_a_table_without_a_title_has_no_lines_around_its_cells() -> None:
    table = new_table("", "name", "value")
    table.add_row("[red]x", "1")
    assert _shown(table) == ["name    value", "[red]x      1"]
    assert len(_shown(new_table("Title", "name", "value"))) > 2


def test_columns_are_aligned_as_asked() -> None:
    table = new_table("", "time", "what", left=("what",))
    table.add_row("1 s", "a")
    assert _shown(table) == ["time  what", " 1 s  a"]
    assert _shown(new_facts_table([("seed", "3"), ("robot", "ant")])) == ["seed   3", "robot  ant"]


def test_one_seed_is_no_range() -> None:
    assert (format_seed_range([7]), format_seed_range(range(100, 120))) == ("seed 7", "20 seeds, 100–119")
