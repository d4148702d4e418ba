"""The files into which the pictures of a dissection go."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pdtui.core.atomic_file import check_writable
from pdtui.core.errors import PictureError
from pdtui.dissection.dissection_result import Dissection


@dataclass(frozen=True)
class PictureOutputs:
    """Where the pictures of one dissection go.

    Attributes:
        report: File of the report, a recording.
        figures: Folder of the PNG files; None draws none.
        overwrite: Whether existing files are replaced.
    """

    report: Path
    figures: Path | None
    overwrite: bool

    def check(self) -> None:
        """Find out before minutes of work whether the pictures can be written.

        Raises:
            PictureError: A file exists already or cannot be written.
        """
        if self.report.suffix != ".rrd":
            raise PictureError(f"{self.report}: expected a name that ends in .rrd; the viewer opens no other")
        found = [self.report] if self.report.exists() else []
        if self.figures is not None:
            from pdtui.pictures.dissection_figures import existing_figures

            found += existing_figures(self.figures)
        if found and not self.overwrite:
            raise PictureError(f"{found[0]}: exists already; --overwrite replaces it")
        for path in (self.report, *([] if self.figures is None else [self.figures / "figure.png"])):
            check_writable(path, PictureError)

    def draw(self, dissection: Dissection) -> list[Path]:
        """Write the pictures.

        Returns:
            The files.

        Raises:
            PictureError: A file cannot be written.
        """
        from pdtui.pictures.dissection_report import write_dissection_report

        write_dissection_report(self.report, dissection)
        if self.figures is None:
            return [self.report]
        from pdtui.pictures.dissection_figures import draw_dissection_figures

        return [self.report, *draw_dissection_figures(self.figures, dissection)]
