"""Parts of a study's report on laws: heading through turns, power of time, norm and orthogonality."""

from __future__ import annotations

from collections.abc import Sequence

from sinssim.experiments.studies import study_charts as figures
from sinssim.experiments.studies.claims.guarantees import guarantee
from sinssim.experiments.studies.results import DEFECT, ErrorGrowth, Heading, Row, StudyResult
from sinssim.experiments.studies.schema import Part
from sinssim.experiments.studies.study_charts import color_of
from sinssim.formatting import number_text
from sinssim.recording.report.chart import html_of
from sinssim.recording.report.page import swatch, table, words

_BLOCK = "six-accelerometers-"


def at_highest_rate(found: Sequence[Heading]) -> list[Heading]:
    """Return headings of one part, each motion at its highest rate."""
    highest = {motion: max(h.rate_hz for h in found if h.motion == motion) for motion in {h.motion for h in found}}
    return [heading for heading in found if heading.rate_hz == highest[heading.motion]]


def turning(comparison: StudyResult, part: Part) -> list[str]:
    """Return the section on the heading through turns."""
    found = [heading for heading in comparison.headings if heading.part == part.title]
    if not found:
        return []
    lines = [
        (
            words(h.motion),
            words(h.form),
            f"{h.rate_hz:g}",
            f"{h.turns:.2f}",
            _angle(h.max_error_arcsec),
            _angle(h.final_error_arcsec),
            str(h.jumps),
            f"{100.0 * h.wrong:.0f} %",
            number_text(h.least_hz, 2) if h.least_hz else "any",
        )
        for h in found
    ]
    heads = (
        "motion", "form", "rate, Hz", "turns", "error max", "final", "jumps", "wrong by > 0.3′",
        "lowest rate of reading, Hz",
    )  # fmt: skip
    return [
        "<h3>Heading through full turns</h3>",
        "<p class=note>Only the attitude, with the true rate of the local level, compared with the true heading, "
        "which counts turns. The heading of Euler angles is an integral. That of direction cosines is the arctangent "
        "of C₂₁/C₁₁: of "
        "one argument it lies within ±90°, of two within ±180°; unwrapped, it adds a turn if two successive values "
        "differ by more than half a turn.</p>",
        html_of(figures.turning(at_highest_rate(found))),
        table(heads, lines, 2),
    ]


def _angle(arcsec: float) -> str:
    return f"{number_text(arcsec)}″" if abs(arcsec) < 3600.0 else f"{number_text(arcsec / 3600.0)}°"


def gyro_free_blocks(comparison: StudyResult, part: Part) -> dict[str, tuple[ErrorGrowth, float]]:
    """Return growth of the errors and arm, m, of each block without gyros of a part, by name."""
    blocks = {}
    for row in comparison.of_part(part.title):
        growth = comparison.history_or_none(row)
        if row.variant.startswith(_BLOCK) and row.sensors != "ideal" and growth is not None:
            arm = row.variant.removeprefix(_BLOCK)
            several = len(part.motions) > 1
            blocks[f"{row.motion + ', ' if several else ''}{row.sensors}, arms of {arm}"] = (
                growth, float(arm.removesuffix("m"))
            )  # fmt: skip
    return blocks


def power_of_time(comparison: StudyResult, part: Part) -> list[str]:
    """Return the section on the power of time of blocks without gyros."""
    blocks = gyro_free_blocks(comparison, part) if "gyro-free" in part.decides else {}
    if not blocks:
        return []
    return [
        "<h3>Power of time without gyros</h3>",
        "<p class=note>Errors while the tilt is below 5°, from where the biases’ direct effect is below one percent. "
        "Below: the local power of time, d log error / d log t. The closed form for a body at rest, from "
        "R δω̇ (½ t² − (1 − cos ω_s t)/ω_s²), is (θ² − θ sin θ)/(½ θ² − 1 + cos θ) with θ = ω_s t. Grey: 4.0 ± 0.1 "
        "below 1000 s, 2.0 ± 0.2 beyond one Schuler period. The rotation of the Earth causes the slow deviation at "
        "the end.</p>",
        html_of(figures.power_of_time(blocks)),
    ]


def guarantees(comparison: StudyResult, part: Part, rows: Sequence[Row]) -> str:
    """Return the table of what each algorithm keeps of norm and orthogonality."""
    orders = [order for order in comparison.orders if (order.part, order.quantity) == (part.title, DEFECT)]
    motions = list(dict.fromkeys(row.motion for row in rows))
    lines = []
    for algorithm in dict.fromkeys(row.algorithm for row in rows):
        kept, own = guarantee(algorithm), [r for r in rows if r.algorithm == algorithm and r.status == "done"]
        measured = {o.motion: f"{o.order:.2f} ± {o.uncertainty:.2f}" for o in orders if o.algorithm == algorithm}
        worst = max((row.max_defect for row in own), default=0.0)
        lines.append(
            (
                swatch(color_of(algorithm)) + words(algorithm),
                f'<td class="name">{words(kept.condition)}</td>',
                f'<td class="name">{words(kept.words)}</td>',
                f'<td class="name">{words(kept.reason)}</td>',
                *(measured.get(motion, "–") for motion in motions),
                number_text(worst, 2),
            )
        )
    heads = (
        "", "<th class=name>condition</th>", "<th class=name>kept</th>", "<th class=name>why</th>",
        *(words(f"order: {m}") for m in motions), "largest defect",
    )  # fmt: skip
    return (
        "<p class=note>What is kept exactly, to rounding, or to a power of the interval h, by theory; φ is the angle "
        "of a step. Axes of a matrix that is computed from a quaternion remain orthogonal; their length is the "
        "squared norm. Measured order: the slope of the log of the largest defect over log h through the four highest "
        "rates "
        "above rounding (1e-10). No number: fewer than three such rates, or no straight line.</p>"
        + table(heads, lines, 1)
    )
