"""The report of scored solutions: ranked table, plots on the axes and in the colours of a run's report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from sinssim.data import NavState
from sinssim.experiments.run.report.errors import Compared, error_plots, error_tables
from sinssim.experiments.run.report.run_report import STYLE, schuler_period
from sinssim.experiments.run.store.score_files import ranking
from sinssim.experiments.run.tables.run_table import error_text
from sinssim.logs.scoring.score import Judge, Score
from sinssim.recording.report import page, plot
from sinssim.recording.report.page import table, words

_FAR = 10.0
"""Factor of the largest rms of a scored solution beyond which an algorithm of the run is not drawn."""


def score_report(
    judge: Judge,
    scores: Sequence[Score],
    compared: Compared,
    numbers: Mapping[str, Mapping[str, float | None]],
) -> str:
    """Return the report.

    Args:
        compared: errors of the run's algorithms and of the scored solutions.
    """
    run = judge.run
    span = float(compared.time[0]), float(compared.time[-1])
    order = ranking(numbers)
    theirs = {score.name for score in scores}
    body = [f"<h1>{words(run.name)}: scored solutions</h1>", "".join(_in_short(numbers, order, theirs, span))]
    ranked = {name: numbers[name] for name in order}
    body += [
        "<h2>Ranking</h2>",
        _ranks(ranked, theirs),
        "<h2>Errors</h2>",
        *error_tables(ranked, "NAME/score.json; all samples: NAME/error_NAME.parquet"),
    ]
    samples = run.solution(run.motion)
    assert samples.velocity_ned is not None
    assert samples.q_nb is not None
    truth = NavState(samples.latitude, samples.longitude, samples.height, samples.velocity_ned, samples.q_nb)
    in_order = Compared(compared.time, {name: compared.errors[name] for name in order}, compared.axes)  # same colours
    drawn, far = near_the_scored(in_order, numbers, theirs)
    body.append("<h2>Errors over time</h2>")
    if far:
        body.append(
            f"<p>Not plotted, because the errors are much larger: {words(', '.join(far))}. The report of the "
            f"run shows them.</p>"
        )
    body += error_plots(drawn, schuler_period(truth, judge.ellipsoid), apart=False)
    body.append("<h2>What was scored</h2>")
    for score in scores:
        body.append(f"<h3>{words(score.name)}</h3><p class='note'>{words(str(score.path))}</p><ul>")
        body += [f"<li>{words(sentence)}</li>" for sentence in score.sentences]
        body.append("</ul>")
    return page.page(f"{run.name}: scores", body, STYLE + plot.STYLE)


def near_the_scored(
    compared: Compared, numbers: Mapping[str, Mapping[str, float | None]], theirs: set[str]
) -> tuple[Compared, list[str]]:
    """Return what is drawn, and the names of the run's algorithms whose errors would hide those of the scored ones.

    Returns:
        The errors to draw; the names of those left out.
    """
    most = max((numbers[name]["rms_horizontal_error_m"] or 0.0 for name in theirs), default=0.0)
    far = [
        name for name, n in numbers.items() if name not in theirs and (n["rms_horizontal_error_m"] or 0.0) > _FAR * most
    ]
    kept = {name: error for name, error in compared.errors.items() if name not in far}
    return Compared(compared.time, kept, compared.axes), far


def _in_short(
    numbers: Mapping[str, Mapping[str, float | None]], order: Sequence[str], theirs: set[str], span: tuple[float, float]
) -> Iterator[str]:
    yield f"<p>Compared from {span[0]:g} s to {span[1]:g} s, which every scored solution covers. "
    best = order[0]
    rms = error_text(numbers[best]["rms_horizontal_error_m"])
    whose = "scored" if best in theirs else "the run’s own"
    yield f"{words(best)} ({whose}) has the smallest rms horizontal error: {rms} m.</p>"


def _ranks(ranked: Mapping[str, Mapping[str, float | None]], theirs: set[str]) -> str:
    """Return the rank of each algorithm by each quantity."""
    kinds = ("horizontal_error_m", "height_error_m", "velocity_error_mps", "attitude_error_arcsec")
    places: dict[str, dict[str, str]] = {name: {} for name in ranked}
    for kind in kinds:
        known = [(value, name) for name, n in ranked.items() if (value := n[f"rms_{kind}"]) is not None]
        for place, (_, name) in enumerate(sorted(known), start=1):
            places[name][kind] = str(place)
    lines = [
        (words(name), "scored" if name in theirs else "run", *(places[name].get(kind, "–") for kind in kinds))
        for name in ranked
    ]
    return table(("algorithm", "from", "horizontal", "height", "velocity", "attitude"), lines, 2) + (
        '<p class="note">Rank by the rms error; 1 is the smallest. – : the solution lacks the quantity.</p>'
    )
