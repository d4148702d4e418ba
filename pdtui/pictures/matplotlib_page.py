"""Pages for matplotlib to draw on, without a window and without changing its global settings."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pdtui.core.atomic_file import replace_file
from pdtui.core.errors import PictureError
from pdtui.dissection.dissection_result import Dissection

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH = 7.2
"""Width of a page in inches: two columns of a paper."""
_DPI = 200
"""Pixels per inch, enough for print."""
_METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": "pdtui"},
    # Without a date, the same data give the same file.
    "pdf": {"Creator": "pdtui", "CreationDate": None},
    "svg": {"Creator": "pdtui", "Date": None},
}
FIGURE_SUFFIXES = tuple(f".{kind}" for kind in _METADATA)
"""Endings of the names of figures: each is a format."""
_STYLE: dict[str, Any] = {
    "font.size": 7.5,
    "axes.titlesize": 8,
    "axes.titlelocation": "left",
    "axes.labelsize": 7.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "lines.linewidth": 1.1,
    "figure.titlesize": 9.5,
    "figure.constrained_layout.use": True,
}


@contextmanager
def open_figure_page(target: Path | BytesIO, height: float, title: str) -> Iterator[Figure]:
    """Yield a figure that is written when the block ends without an error, by its name as PNG, PDF or SVG.

    A file's folder is made, and the file is replaced once the picture is whole. The height is in inches.

    Raises:
        PictureError: The file cannot be written.
    """
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    settings: dict[Any, Any] = {**matplotlib.rcParamsDefault, "backend": "agg", **_STYLE}
    with matplotlib.rc_context(settings):
        figure = Figure(figsize=(WIDTH, height), dpi=_DPI)
        FigureCanvasAgg(figure)
        figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
        yield figure
        with (
            nullcontext(target) if isinstance(target, BytesIO) else replace_file(target, PictureError) as file
        ):
            kind = "png" if isinstance(target, BytesIO) else target.suffix.removeprefix(".")
            figure.savefig(file, format=kind, metadata={"Title": title, **_METADATA[kind]})


def check_figure_path(path: Path, overwrite: bool) -> None:
    """Find out before the work whether one figure may be written.

    Raises:
        PictureError: The file already exists, or its name is not that of a figure.
    """
    if path.suffix not in FIGURE_SUFFIXES:
        raise PictureError(f"{path}: expected a name that ends in {', '.join(FIGURE_SUFFIXES)}")
    if path.exists() and not overwrite:
        raise PictureError(f"{path}: already exists; --overwrite replaces it, -o writes elsewhere")


def format_policy_title(dissection: Dissection) -> str:
    """Return robot and policy as titles name them."""
    return f"{dissection.robot}, driven by {Path(dissection.policy).stem}"


def load_pyplot() -> Any:
    """Import matplotlib's global figures, which only a benchmark needs, to be drawn without a window."""
    from matplotlib import pyplot

    pyplot.switch_backend("Agg")
    return pyplot
