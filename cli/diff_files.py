"""What `sonarlog diff` writes or opens beside stdout: picture, page, JUnit, Rerun."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from cli.watching import WINDOW

if TYPE_CHECKING:
    from sonarlog.diff import Report
    from sonarlog.diff.outcome import Outcome


@dataclass(frozen=True)
class Files:
    """Where each goes (None: nowhere); `viz` is an .rrd file, or the viewer's own window."""

    png: Path | None
    html: Path | None
    viz: str | None
    junit: Path | None
    force: bool

    def check(self, comparisons: int) -> None:
        """Before anything is computed: they are of one comparison, not there yet, and there is a screen for a window.

        Raises UsageError, CannotDraw, CannotWritePage, CannotSave, NoViewer.
        """
        if comparisons > 1 and (self.png or self.html or self.viz):
            raise click.UsageError("--png, --html and --viz show one comparison: leave them, or name one recording")
        if self.png is not None:
            from sonarlog.picture import check_free

            check_free(self.png, force=self.force)
        if self.html is not None:
            from sonarlog.diff_page import check_free as check_page

            check_page(self.html, force=self.force)
        if self.viz == WINDOW:
            from sonarlog.viz.native import require_display

            require_display()

    def write(self, outcomes: "Sequence[Outcome]") -> None:
        """All that was asked for."""
        if self.junit is not None:
            from sonarlog.diff.junit import write_junit

            write_junit(outcomes, self.junit)
        report = outcomes[0].report
        if report is not None:
            self._show(report)

    def _show(self, report: "Report") -> None:
        if self.png is not None:
            from sonarlog.diff_page import draw_difference

            draw_difference(report, self.png, force=self.force)
        if self.html is not None:
            from sonarlog.diff_page import write_page

            write_page(report, self.html, force=self.force)
        if self.viz is not None:
            from sonarlog.viz.comparison import compare_live, compare_to_file

            if self.viz == WINDOW:
                compare_live(report)
            else:
                compare_to_file(report, self.viz, force=self.force)
