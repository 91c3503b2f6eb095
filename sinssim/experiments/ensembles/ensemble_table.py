"""The tables of an ensemble on the console, and the performance sheet of its unit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rich import box
from rich.table import Table

from sinssim import units
from sinssim.experiments.ensembles.ensemble_report import opening, regulation, with_band
from sinssim.experiments.ensembles.summary import DEFINITIONS, consistency_sentences
from sinssim.experiments.ensembles.verdicts import requirement_lines
from sinssim.formatting import number_text
from sinssim.sensors.imu.grades import grade_name

if TYPE_CHECKING:
    from rich.console import Console

    from sinssim.experiments.ensembles.result import EnsembleResult


def show(result: EnsembleResult, numbers: Mapping[str, Any], console: Console, program: str = "sinssim") -> None:
    """Print CEP and R95, consistency, failures, and the commands of the runs to look at.

    Args:
        result: the ensemble.
        numbers: its numbers, from `ensemble_numbers`.
        console: the console to print on.
        program: how sinssim is called.
    """
    console.print(f"{result.plan.scenario.name}: {len(result)} runs", markup=False, style="bold")
    console.print(opening(result, numbers), markup=False)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("", overflow="fold")
    table.add_column("CEP (95 % band)", justify="right", no_wrap=True)
    table.add_column("R95 (95 % band)", justify="right", no_wrap=True)
    final, rate = numbers["final_horizontal_m"], numbers["rate_nmi_h"]
    for one in numbers["at"]:
        name = f"horizontal error at {one['time_s']:g} s, m"
        table.add_row(name, with_band(one["cep_m"]), with_band(one["r95_m"]))
    table.add_row("horizontal error at the end, m", with_band(final["cep"]), with_band(final["r95"]))
    table.add_row(
        "rate by the line Σ t r / Σ t², nmi/h", with_band(rate["line"]["cep"]), with_band(rate["line"]["r95"])
    )
    table.add_row("rate at the end r(T)/T, nmi/h", with_band(rate["end"]["cep"]), with_band(rate["end"]["r95"]))
    console.print(table)
    console.print(regulation(numbers), markup=False)
    for line in requirement_lines(result):
        console.print(line, markup=False)
    if result.nees:
        _show_consistency(numbers, console)
    _show_failures(result, console)
    for one in numbers["named_runs"]:
        if one["rank"] in ("worst", "median", "best"):
            console.print(f"{one['rank']:<7}{result.command(one['run'], program)}", markup=False, soft_wrap=True)


def _show_consistency(numbers: Mapping[str, Any], console: Console) -> None:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, title="Consistency, 1 is expected", title_justify="left")
    table.add_column("", no_wrap=True)
    for heading in ("mean", "at the end", "95 % band there", "epochs in band"):
        table.add_column(heading, justify="right", no_wrap=True)
    for key, title in (("nees", "ANEES"), ("nis", "NIS")):
        for name, one in numbers[key].items():
            inside = one["share_in_band"]
            table.add_row(
                f"{title}, {name}", number_text(one["mean"]), number_text(one["end"]),
                f"{number_text(one['low'])} … {number_text(one['high'])}",
                "–" if math.isnan(inside) else f"{100.0 * inside:.0f} %",
            )  # fmt: skip
    console.print(table)
    console.print(
        "Biases are constant in a run: in few runs a block can be outside its band at all epochs by chance.",
        markup=False,
    )
    for sentence in consistency_sentences(numbers):
        console.print(sentence, markup=False)


def _show_failures(result: EnsembleResult, console: Console) -> None:
    reasons: dict[str, list[int]] = {}
    for number, text in result.failures.items():
        reasons.setdefault(text, []).append(number)
    for text, runs in list(reasons.items())[:5]:
        named = ", ".join(map(str, runs[:5])) + (f" and {len(runs) - 5} more" if len(runs) > 5 else "")
        console.print(f"FAILED, {'run' if len(runs) == 1 else 'runs'} {named}: {text}", markup=False)
    if len(reasons) > 5:
        console.print(f"… and {len(reasons) - 5} other reasons; see the report.", markup=False)


def show_sheet(result: EnsembleResult, numbers: Mapping[str, Any], console: Console) -> None:
    """Print the performance of the unit in the words of a data sheet, with their definitions.

    Args:
        result: the ensemble.
        numbers: its numbers, from `ensemble_numbers`.
        console: the console to print on.
    """
    rate, found = numbers["rate_nmi_h"], numbers["components"]

    def rms(*names: str, size: float = 1.0) -> str:
        return number_text(math.sqrt(sum(found[name]["rms"] ** 2 for name in names) / len(names)) / size)

    plan = result.plan
    table = Table(
        box=box.SIMPLE_HEAD, pad_edge=False, title_justify="left",
        title=f"Performance of {grade_name(plan.scenario.imu.grade)} in {plan.scenario.name}, {len(result)} runs",
    )  # fmt: skip
    table.add_column("quantity", overflow="fold")
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("definition", overflow="fold")
    for key, name in (("line", "Σ t r / Σ t²"), ("end", "r(T) / T")):
        table.add_row("position rate, CEP", f"{with_band(rate[key]['cep'])} nmi/h", f"{name}, 50 % of the runs")
        table.add_row("position rate, R95", f"{with_band(rate[key]['r95'])} nmi/h", f"{name}, 95 % of the runs")
    for label, value, unit, definition in (
        ("velocity, north and east", rms("velocity_n_mps", "velocity_e_mps"), "m/s", "per axis, rms"),
        ("velocity, vertical", rms("velocity_d_mps"), "m/s", "rms"),
        ("roll and pitch", rms("attitude_n_rad", "attitude_e_rad", size=units.DEG), "°", "tilt per axis, rms"),
        ("heading", rms("attitude_d_rad", size=units.DEG), "°", "rms"),
    ):  # fmt: skip
        table.add_row(label, f"{value} {unit}", definition)
    console.print(table)
    console.print(regulation(numbers), markup=False)
    for line in requirement_lines(result):
        console.print(line, markup=False)
    console.print(
        "Common terms: navigation grade 0.5 to 1 nmi/h CEP, tactical grade 10 to 20 nmi/h. Definitions:", markup=False
    )
    for name, text in DEFINITIONS.items():
        console.print(f"  {name}: {text}.", markup=False)
