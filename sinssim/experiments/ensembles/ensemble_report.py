"""The report of an ensemble: a self-contained HTML page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from sinssim.data import Array
from sinssim.experiments.ensembles import ensemble_figure as figures
from sinssim.experiments.ensembles.summary import DEFINITIONS, consistency_sentences
from sinssim.experiments.ensembles.verdicts import requirement_section
from sinssim.formatting import capital, number_text, signed
from sinssim.recording.figures.canvas import to_svg
from sinssim.recording.report.page import page, table, words
from sinssim.scales import duration_words
from sinssim.statistics.order_statistics import runs_for_band

if TYPE_CHECKING:
    from sinssim.experiments.ensembles.result import EnsembleResult

_STYLE = """
.command { font-family: ui-monospace, "Liberation Mono", monospace; font-size: .78rem; white-space: normal;
  overflow-wrap: anywhere; text-align: left; min-width: 24rem; }
"""
_MOST_FAILURES = 50
_NAMES = ("position", "velocity", "attitude φ")


def ensemble_report(
    result: EnsembleResult, numbers: Mapping[str, Any], about: Mapping[str, str], predicted: Array | None = None
) -> str:
    """Return the report of an ensemble.

    Args:
        result: the ensemble.
        numbers: its numbers, from `ensemble_numbers`.
        about: versions and machine, by name.
        predicted: σ by the covariance budget at the epochs, (K, 9), drawn beside that of the runs.

    Returns:
        An HTML page with its figures as SVG.
    """
    scenario = result.plan.scenario
    body = [f"<h1>{words(scenario.name)}: an ensemble of {len(result)} runs</h1>"]
    if scenario.description:
        body.append(f'<p class="lead">{words(scenario.description)}</p>')
    body.append(f'<p class="note">{words(opening(result, numbers))}</p>')
    body += [f"<p><strong>{words(note)}</strong></p>" for note in result.notes]
    body += requirement_section(result)
    body += ["<h2>Errors of the population</h2>", headline(numbers, figures.units_of(result)[0]), _regulation(numbers)]
    body += ["<h3>Growth of the position error</h3>", to_svg(figures.growth(result), "growth")]
    body += ["<h3>Errors at the end</h3>", to_svg(figures.cloud(result), "cloud")]
    body += ["<h3>Rates of the runs</h3>", to_svg(figures.rates(result), "rates")]
    body += [
        "<h2>Errors by component</h2>",
        to_svg(figures.components(result, predicted), "components"),
        _components(numbers, figures.units_of(result)),
    ]
    if result.nees:
        body += _consistency(result, numbers)
    body += ["<h2>Runs to examine</h2>", _runs(result, numbers)]
    if result.failures:
        body += ["<h2>Failed runs</h2>", _failures(result)]
    body += ["<h2>Definitions</h2>", definitions(), "<h2>How it was computed</h2>", _method(result, numbers, about)]
    return page(f"{scenario.name}: ensemble", body, _STYLE)


def opening(result: EnsembleResult, numbers: Mapping[str, Any]) -> str:
    """Return what an ensemble is of, in a few sentences.

    Args:
        result: the ensemble.
        numbers: its numbers.

    Returns:
        Plain text.
    """
    plan = result.plan
    broken_off = {"interrupted": "was interrupted", "failed": "failed"}.get(numbers["status"])
    needed = runs_for_band(0.95)
    few = f" R95 has no upper bound with fewer than {needed} runs." if len(result) < needed else ""
    status = f" The ensemble {broken_off}; the report shows the finished runs." if broken_off else ""
    varied = f" Varied from run to run: {', '.join(plan.keys)}." if plan.keys else ""
    failed = numbers["failed"]
    count = f" {failed} of {len(result)} runs failed; their errors are treated as infinite." if failed else ""
    return (
        f"Solution: {plan.solution}. Seed {plan.scenario.seed}. Each run lasts "
        f"{duration_words(float(plan.epochs[-1]) - plan.start)}; its errors are kept at {len(plan.epochs)} epochs."
        f"{varied}{few}{count}{status}"
    )


def with_band(found: Mapping[str, float], size: float = 1.0) -> str:
    """Return a percentile with its band.

    Args:
        found: `value`, `low` and `high`.
        size: the unit.

    Returns:
        For example "0.712 (0.655 … 0.781)"; "∞" for an infinite end.
    """
    value, low, high = (found[key] / size for key in ("value", "low", "high"))

    def text(number: float) -> str:
        return "∞" if number == math.inf else number_text(number)

    return f"{text(value)} ({text(low)} … {text(high)})"


def headline(numbers: Mapping[str, Any], length: tuple[str, float]) -> str:
    """Return the table of CEP and R95.

    Args:
        numbers: the numbers of an ensemble.
        length: the unit of lengths, and its size in m.

    Returns:
        HTML.
    """
    final, rate = numbers["final_horizontal_m"], numbers["rate_nmi_h"]
    unit, size = length
    circles = numbers["circles_of_covariance_m"]
    lines = [
        *((f"horizontal error at {one['time_s']:g} s, {unit}", *(with_band(one[k], size) for k in ("cep_m", "r95_m")))
          for one in numbers["at"]),
        (f"horizontal error at the end, {unit}", *(with_band(final[key], size) for key in ("cep", "r95"))),
        ("rate, line through the origin Σ t r / Σ t², nmi/h", *(with_band(rate["line"][k]) for k in ("cep", "r95"))),
        ("rate at the end r(T) / T, nmi/h", *(with_band(rate["end"][key]) for key in ("cep", "r95"))),
        (f"circle of a normal distribution with the covariance at the end, {unit}",
         *(number_text(circles[key] / size) for key in ("cep", "r95"))),
    ]  # fmt: skip
    heads = ("", "CEP, 50 % of the runs (95 % band)", "R95, 95 % of the runs (95 % band)")
    return table(heads, [tuple(map(words, line)) for line in lines])


def _regulation(numbers: Mapping[str, Any]) -> str:
    return f"<p>{words(regulation(numbers))}</p>"


def regulation(numbers: Mapping[str, Any]) -> str:
    """Return the comparison with the regulation as sentences.

    Args:
        numbers: the numbers of an ensemble.

    Returns:
        Plain text.
    """
    found = numbers["part_121"]
    verdict = {
        "met": "met, with 95 % confidence",
        "not met": "not met, with 95 % confidence",
        "undecided": "undecided: the limit lies within the confidence interval; more runs narrow it",
        "does not apply": f"it does not apply, because {found.get('reason', '')}",
    }[found["verdict"]]
    shown = "; ".join(f"{name}: {with_band(one)}, limit {one['limit']:g}" for name, one in found["quantities"].items())
    return f"{found['rule']}: {verdict}{'. ' if shown else ''}{capital(shown)}."


def _components(numbers: Mapping[str, Any], units: Sequence[tuple[str, float]]) -> str:
    lines = []
    found = list(numbers["components"].items())
    for number, (_, one) in enumerate(found):
        name, (unit, size) = _NAMES[number // 3], units[number // 3]
        axis = ("north", "east", "down")[number % 3]
        sigma, error = one["final_sigma"] / size, one["final_sigma_standard_error"] / size
        lines.append(
            (
                words(f"{name}, {axis}"),
                unit,
                signed(one["final_mean"] / size),
                _with_error(sigma, error),
                number_text(one["rms"] / size),
            )
        )
    heads = ("", "unit", "mean at the end", "σ at the end ± standard error", "rms over runs and epochs")
    return table(heads, lines, 2)


def _with_error(value: float, error: float) -> str:
    """Write a value with the decimals of its standard error, which has two significant digits."""
    text = number_text(error, 2)
    if not (math.isfinite(value) and math.isfinite(error) and error > 0.0) or "e" in text:
        return f"{number_text(value)} ± {text}"
    return f"{value:.{len(text.partition('.')[2])}f} ± {text}"


def _consistency(result: EnsembleResult, numbers: Mapping[str, Any]) -> list[str]:
    body = [
        "<h2>Consistency of the filter</h2>",
        *(f"<p><strong>{words(sentence)}</strong></p>" for sentence in consistency_sentences(numbers)),
        "<p>Mean over the runs per degree of freedom, with the 95 % band of χ² for this number of runs; a filter with "
        "a correct covariance has 1, and an overconfident filter has more. Neighbouring epochs are correlated: "
        "biases are constant in a run, so the mean of a correct filter can be outside the band for some time.</p>",
    ]
    for key, squares, title in (("nees", result.nees, "NEES / n"), ("nis", result.nis, "NIS / n")):
        lines = [
            (
                words(name),
                number_text(one["mean"]),
                number_text(one["end"]),
                f"{number_text(one['low'])} … {number_text(one['high'])}",
                "–" if math.isnan(one["share_in_band"]) else f"{100.0 * one['share_in_band']:.0f} %",
            )
            for name, one in numbers[key].items()
        ]
        what = "ANEES by block of states" if key == "nees" else "NIS by sensor"
        heads = ("", "mean over all epochs", "at the last epoch", "95 % band there", "epochs within the band")
        body += [f"<h3>{what}</h3>", to_svg(figures.consistency(result, squares, title), key), table(heads, lines)]
    return body


def _runs(result: EnsembleResult, numbers: Mapping[str, Any]) -> str:
    lines = []
    for one in numbers["named_runs"]:
        lines.append(
            (
                words(one["rank"]),
                str(one["run"]),
                "failed" if one["failure"] else number_text(one["rate_nmi_h"]),
                "–" if one["failure"] else number_text(one["final_horizontal_m"]),
                f'<td class="command">{words(result.command(one["run"]))}</td>',
            )
        )
    heads = ("", "run", "rate Σ t r / Σ t², nmi/h", "final, m", "<th class=name>command for the complete run</th>")
    return table(heads, lines)


def _failures(result: EnsembleResult) -> str:
    shown = list(result.failures.items())[:_MOST_FAILURES]
    lines = [
        (str(number), str(result.member(number).seed), f'<td class="text">{words(text)}</td>') for number, text in shown
    ]
    more = len(result.failures) - len(shown)
    rest = (
        f"<p>… and {more} more; runs.parquet of to_parquet and the files of runs have all of them.</p>" if more else ""
    )
    return table(("run", "seed", "<th class=name>reason</th>"), lines) + rest


def definitions() -> str:
    """Return the table of what each number means."""
    lines = [(words(name), f'<td class="text">{words(text)}</td>') for name, text in DEFINITIONS.items()]
    return table(("", "<th class=name>definition</th>"), lines)


def _method(result: EnsembleResult, numbers: Mapping[str, Any], about: Mapping[str, str]) -> str:
    software = ", ".join(f"{name} {version}" for name, version in about.items())
    shared = "All runs share one motion, unless turbulence, vibration or a varied key changes it."
    return (
        f"<p>Run i has the seed S_i, the first 53 bits of SHA-256 over the ensemble’s seed and i. Its errors are those "
        f"of <code>sinssim run</code> with that seed, bit for bit. {shared} {result.computed} runs were computed in "
        f"{result.seconds:.1f} s by this call.</p><p class=note>{words(software)}</p>{own_content(numbers)}"
    )


def own_content(numbers: Mapping[str, Any]) -> str:
    """Return the table of the files outside the package on which the numbers depend, nothing without any.

    Args:
        numbers: of the ensemble.
    """
    lines = [
        tuple(map(words, (own["kind"], own["name"], f"{own['sha256'][:12]}…", own["file"])))
        for own in numbers.get("own_content", ())
    ]
    return table(("own content", "name", "SHA-256", "file"), lines, 4) if lines else ""
