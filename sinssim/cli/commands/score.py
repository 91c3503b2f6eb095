"""`sinssim score`: compares solutions of other programs with those of a run."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from sinssim.cli.options import Debug, Json, Quiet
from sinssim.cli.terminal import console, print_json
from sinssim.logs.formats.registry import DEFAULT_START


# Long: every option is a parameter, and the docstring is the help.
def command(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run directory.", show_default=False)],
    solutions: Annotated[
        list[Path],
        typer.Argument(
            metavar="SOLUTION", help="Files of solutions; formats: `sinssim list formats`.", show_default=False
        ),
    ],
    names: Annotated[
        list[str] | None,
        typer.Option("--name", metavar="NAME", help="Name of each solution, in order.", show_default="the file's name"),
    ] = None,
    seconds: Annotated[
        list[float] | None,
        typer.Option("--time-s", metavar="S", help="Computing time of each solution, s.", show_default=False),
    ] = None,
    format_name: Annotated[
        str | None,
        typer.Option("--format", metavar="FORMAT", help="Format of the files.", show_default="found from the file"),
    ] = None,
    antenna: Annotated[
        str | None,
        typer.Option(
            "--antenna",
            metavar="NAME",
            help="GNSS receiver, such as gnss, to whose antenna the positions refer.",
            show_default="the sensor block",
        ),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            "--start",
            metavar="DATE",
            help="Date of the run's time 0 in the export, UTC.",
            show_default=f"{DEFAULT_START}, or the date of a recorded log",
        ),
    ] = None,
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
    from sinssim.experiments.run.error_exhibits import Compared
    from sinssim.experiments.run.run_scores import check_names, known_numbers, score_report, to_json, write_scores
    from sinssim.experiments.run.run_scores import record_scores as record
    from sinssim.logs.formats.run_export import date_of_run
    from sinssim.logs.solution_score import Judge, common_span
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
    span = common_span(scores)
    errors = {**judge.run_errors(span), **{score.name: score.error for score in scores}}
    numbers = {name: known_numbers(error, span) for name, error in errors.items()}
    import numpy as np

    compared = Compared(np.array(span), errors, judge.axes)
    report = score_report(judge, scores, compared, numbers)
    place = write_scores(judge, scores, span, report, partial(record, judge, scores, compared, numbers))
    if as_json:
        print_json({"errors": numbers, "scores": [to_json(score, span) for score in scores], "report": str(place)})
    elif not quiet:
        from sinssim.experiments.run.run_scores import show_scores as show

        show(judge.run.name, judge.against, numbers, scores, span, console(least_width=110))
        print(f"Report: {place}\nCurves and map: sinssim view {place.parent}")
