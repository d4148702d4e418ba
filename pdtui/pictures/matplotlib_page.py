"""A page to draw on: matplotlib, where it is installed, with no window and no global state."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pdtui.core.atomic_file import replace_file
from pdtui.core.errors import PictureError
from pdtui.dissection.dissection_result import Dissection

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH = 7.2
"""Of a page, inches: two columns of a paper."""
_DPI = 200
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


def check_matplotlib() -> None:
    """Find out before the work whether figures can be drawn.

    Raises:
        PictureError: matplotlib is not installed.
    """
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError as error:
        raise PictureError(
            "figures need matplotlib, which is not installed: pip install 'pdtui[figures]'"
        ) from error


def check_figure(path: Path, overwrite: bool) -> None:
    """Find out before the work whether one figure can be drawn and may be written.

    Raises:
        PictureError: matplotlib is not installed, or the file exists already.
    """
    check_matplotlib()
    if path.exists() and not overwrite:
        raise PictureError(f"{path}: exists already; --overwrite replaces it, -o writes elsewhere")


@contextmanager
def figure_page(path: Path, height: float, title: str) -> Iterator[Figure]:
    """A figure that is written as a PNG when the block ends without an error.

    Args:
        path: the file; its folder is made, an existing file is replaced once the picture is whole.
        height: inches; the width is `WIDTH`.
        title: above everything.

    Raises:
        PictureError: matplotlib is not installed, or the file cannot be written.
    """
    check_matplotlib()
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    settings: dict[Any, Any] = {**matplotlib.rcParamsDefault, "backend": "agg", **_STYLE}
    with matplotlib.rc_context(settings):
        figure = Figure(figsize=(WIDTH, height), dpi=_DPI)
        FigureCanvasAgg(figure)
        figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
        yield figure
        with replace_file(path, PictureError) as partial:
            figure.savefig(partial, format="png", metadata={"Title": title, "Software": "pdtui"})


def policy_title(dissection: Dissection) -> str:
    """Robot and policy, as titles name them."""
    return f"{dissection.robot}, driven by {Path(dissection.policy).stem}"
