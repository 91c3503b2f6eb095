"""`sinssim score`: compares solutions of other programs with those of a run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sinssim.cli.options import Debug, Json, Quiet, RunFolder, start_option
from sinssim.cli.terminal import console, print_json

if TYPE_CHECKING:
    from sinssim.logs.solution_score import Judge, Score

Solutions = Annotated[
    list[Path], typer.Argument(metavar="SOLUTION", help="Files of solutions; formats: `sinssim list formats`.")
]
Names = Annotated[
    list[str] | None,
    typer.Option("--name", metavar="NAME", help="Name of each solution, in order.", show_default="the file's name"),
]
Seconds = Annotated[
    list[float] | None, typer.Option("--time-s", metavar="S", help="Computing time of each solution, s.")
]
Format = Annotated[
    str | None,
    typer.Option("--format", metavar="FORMAT", help="Format of the files.", show_default="found from the file"),
]
Antenna = Annotated[
    str | None,
    typer.Option(
        "--antenna",
        metavar="NAME",
        help="GNSS receiver, such as gnss, to whose antenna the positions refer.",
        show_default="the sensor block",
    ),
]


def command(
    run: RunFolder,
    solutions: Solutions,
    names: Names = None,
    seconds: Seconds = None,
    format_name: Format = None,
    antenna: Antenna = None,
    start: Annotated[str | None, start_option("Date of the run's time 0 in the export, UTC.")] = None,
    quiet: Quiet = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Score solutions that other navigation programs computed from the exported data of a run.

    Each solution is treated as a further algorithm of the run: its errors in position, velocity and attitude are
    computed, and a table, plots and a ranking compare it with the algorithms of the run. Quantities that a solution
    lacks are not scored. The results are in RUN/scores; other files of the run do not change.

    Examples:

        sinssim export runs/mems_uav --to csv -o readings
        sinssim score runs/mems_uav mine.csv --name mine --time-s 3.2
        sinssim score runs/mems_uav KF_GINS_Navresult.nav rtk.pos
    """
    from sinssim.errors import InputError
    from sinssim.experiments.run.run_scores import check_names
    from sinssim.logs.formats.run_export import date_of_run
    from sinssim.logs.solution_score import Judge
    from sinssim.logs.stored_run import RecordedRun

    for option, given in (("--name", names), ("--time-s", seconds)):
        if given and len(given) != len(solutions):
            raise InputError(f"{option} is given {len(given)} times for {len(solutions)} solutions; give one for each.")
    if any(not 0.0 < value < 1e9 for value in seconds or ()):
        raise InputError("--time-s: the time must be positive, in seconds.")
    recorded = RecordedRun(run)
    judge = Judge(recorded, date_of_run(recorded, start))
    called = names or [path.stem for path in solutions]
    check_names(judge, called)
    times: list[float | None] = [*seconds] if seconds else [None] * len(solutions)
    scores = [
        judge.score(path, name=name, format_name=format_name, antenna=antenna, seconds=time)
        for path, name, time in zip(solutions, called, times, strict=True)
    ]
    _write(judge, scores, quiet=quiet, as_json=as_json)


def _write(judge: Judge, scores: list[Score], *, quiet: bool, as_json: bool) -> None:
    """Write the scores beside the run, and print them."""
    from sinssim.experiments.run.run_scores import Scored, score_exhibits, to_json, write_scores
    from sinssim.logs.solution_score import common_span

    span = common_span(scores)
    errors = {**judge.run_errors(span), **{score.name: score.error for score in scores}}
    scored = Scored(judge, scores, errors, span)
    place = write_scores(scored)
    if as_json:
        numbers = {name: scored.numbers[name] for name in errors}
        print_json({"errors": numbers, "scores": [to_json(score, span) for score in scores], "report": str(place)})
    elif not quiet:
        from sinssim.recording.console import show

        show(score_exhibits(scored), console(least_width=110))
        print(f"Report: {place}\nCurves and map: sinssim view {place.parent}")
