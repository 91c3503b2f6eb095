"""The report of a calibration: a self-contained HTML page."""

from __future__ import annotations

from sinssim.analyses.calibration.calibration_figure import observability_figure, parameters_figure, residual_figure
from sinssim.analyses.calibration.calibration_table import cells, heads, sentences
from sinssim.analyses.calibration.compensation_file import compensation_text
from sinssim.analyses.calibration.result import CalibrationResult
from sinssim.recording.figures.canvas import to_svg
from sinssim.recording.report.page import page, table, verbatim, words
from sinssim.truth.turntable.sequences import SEQUENCES

_STYLE = """
pre { font-size: .8rem; overflow-x: auto; background: var(--head); padding: .6rem; }
"""
_METHOD = {
    "separate": "Means in known positions and integrals over known turns; the errors of the table are nuisance "
    "parameters with the stated accuracy.",
    "systematic": "Navigation errors during the sequence: in each dwell the true velocity is zero, and the computed "
    "velocity shows the effect of gyro and accelerometer errors. The angles of the table are not used, except for the "
    "nominal attitude of the first position.",
}


def calibration_report(result: CalibrationResult) -> str:
    """Return the report.

    Args:
        result: the calibration.

    Returns:
        An HTML page with its figures as SVG.
    """
    scenario = result.scenario
    body = [
        f"<h1>{words(scenario.name)}: calibration</h1>",
        f'<p class="lead">{words(scenario.description)}</p>',
        f"<p>{words(_METHOD[result.method])}</p>",
        f"<p>{words(_sequence(result))}</p>",
        "<h2>Parameters</h2>",
        table(
            heads(result), [[*map(words, row[:-1]), f"<td class=name>{words(row[-1])}</td>"] for row in cells(result)]
        ),
        *(f"<p>{words(sentence)}</p>" for sentence in sentences(result)),
        to_svg(parameters_figure(result), "parameters"),
        "<h2>Observability of the sequence</h2>",
        "<p>A direction in the space of the parameters, each in units of its 1σ before the calibration, is observable "
        "if the sequence determines it better than this 1σ.</p>",
        to_svg(observability_figure(result), "observability"),
        "<h2>Residuals</h2>",
        to_svg(residual_figure(result), "residuals"),
        "<h2>Compensation</h2>",
        f"<details><summary>compensation.toml</summary><pre>{verbatim(compensation_text(result))}</pre></details>",
    ]
    return page(f"{scenario.name}: calibration", body, _STYLE)


def _sequence(result: CalibrationResult) -> str:
    own = result.scenario.turntable
    assert own is not None  # a calibration has one
    last = result.dwells[-1, 1] - result.dwells[0, 0]
    what = f"Sequence: {len(result.dwells)} positions in {last:.0f} s"
    ready = own.ready
    if ready is None:
        return f"{what}, given by [[turntable.turns]]."
    (name,) = (name for name, one in SEQUENCES.items() if one is ready)
    return f"{what}, “{name}”: {ready.about} ({ready.source})."
