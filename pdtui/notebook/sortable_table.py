"""A table in HTML whose columns are sorted by a click on their headings."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

Cell = str | float | int | bool | None
_STYLE = (
    "<style>.pdtui th{cursor:pointer;text-align:left}.pdtui td{text-align:right}"
    ".pdtui td:first-child,.pdtui td:nth-child(2){text-align:left}</style>"
)
# The value of a cell is in its attribute, so that what is shown may be rounded. Cells without one come last.
_SORT = (
    "var t=this.closest('table'),i=this.cellIndex,d=this.dataset.d=-(this.dataset.d||-1),b=t.tBodies[0];"
    "Array.from(b.rows).sort(function(p,q){var x=p.cells[i].dataset.v,y=q.cells[i].dataset.v;"
    "if(x===''||y==='')return (x==='')-(y==='');var n=x-y;"
    "return d*(isNaN(n)?(x<y?-1:x>y?1:0):n)}).forEach(function(r){b.appendChild(r)})"
)


def render_sortable_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[Cell]]) -> str:
    """Return a table as HTML; texts are escaped, numbers have three digits, and None is a dash."""
    head = "".join(f'<th onclick="{escape(_SORT)}">{escape(column)}</th>' for column in columns)
    body = "".join(f"<tr>{''.join(map(_render_cell, row))}</tr>" for row in rows)
    caption = f"<p>{escape(title)}</p>" if title else ""
    return (
        f"{_STYLE}{caption}<table class='pdtui'><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )


def _render_cell(cell: Cell) -> str:
    if cell is None:
        shown, value = "–", ""
    elif isinstance(cell, bool):
        shown, value = ("yes" if cell else "no"), str(int(cell))
    elif isinstance(cell, float):
        shown, value = f"{cell:.3g}", repr(cell)
    else:
        shown = value = str(cell)
    return f'<td data-v="{escape(value)}">{escape(shown)}</td>'
