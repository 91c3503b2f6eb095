"""The table of scored solutions beside a run's own algorithms, ranked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from rich import box
from rich.table import Table

from sinssim.experiments.run.store.score_files import ranking
from sinssim.experiments.run.tables.run_table import error_text
from sinssim.logs.scoring.score import Score

if TYPE_CHECKING:
    from rich.console import Console

_HEADINGS = (
    "horizontal\nfinal, m", "\nrms, m", "\nmax, m", "height\nmax, m", "velocity\nmax, m/s", "attitude\nmax, arcmin",
)  # fmt: skip


def show(
    title: str,
    against: str,
    numbers: Mapping[str, Mapping[str, float | None]],
    scores: Sequence[Score],
    span: tuple[float, float],
    console: Console,
) -> None:
    """Print the errors of all solutions, ranked, and what is known of the scored ones.

    Args:
        numbers: results of `known_numbers` by algorithm.
        span: time over which they are compared, s.
    """
    table = Table(
        title=f"{title}: errors against {against}, {span[0]:g} s to {span[1]:g} s, by the rms horizontal error",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    table.add_column("", justify="right", no_wrap=True)
    table.add_column("algorithm", no_wrap=True)
    for heading in _HEADINGS:
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("time, s", justify="right", no_wrap=True)
    theirs = {score.name: score for score in scores}
    for place, name in enumerate(ranking(numbers), start=1):
        n = numbers[name]
        angle = n["max_attitude_error_arcsec"]
        seconds = theirs[name].seconds if name in theirs else None
        table.add_row(
            str(place),
            f"{name} *" if name in theirs else name,
            *(error_text(n[f"{kind}_horizontal_error_m"]) for kind in ("final", "rms", "max")),
            error_text(n["max_height_error_m"]),
            error_text(n["max_velocity_error_mps"]),
            error_text(None if angle is None else angle / 60.0),
            "" if seconds is None else error_text(seconds),
        )
    console.print(table)
    for score in scores:
        console.print(f"* {score.name} ({score.path}): {' '.join(score.sentences)}", markup=False)
