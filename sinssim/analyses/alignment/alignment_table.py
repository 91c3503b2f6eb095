"""The tables of an alignment: determined angles and latitude, and the expected error by source."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from rich.table import Table

from sinssim.alignment.axes import Angles
from sinssim.alignment.budget import total
from sinssim.analyses.alignment.report import AlignmentResult
from sinssim.data import Array
from sinssim.units import ARCMIN, DEG, DEG_H

if TYPE_CHECKING:
    from rich.console import Console


def show(report: AlignmentResult, console: Console) -> None:
    """Print the angles and the latitude, and the expected error by source.

    Args:
        report: the alignment.
        console: the console to print on.
    """
    d = report.determination
    how = "eq. (1) on a quiet base" if report.method == "quiet" else "gravity's cone in inertial space"
    console.print(f"{report.source}: {report.duration:g} s, {report.samples} samples, {how}", markup=False)
    table = Table()
    table.add_column("")
    table.add_column("determined, °", justify="right")
    if report.budget is not None:
        table.add_column("σ, ′", justify="right")
        table.add_column("bias dominates\nfrom, s", justify="right")
    if report.truth is not None:
        table.add_column("true, °", justify="right")
        table.add_column("error, ′", justify="right")
    if report.mean_angles is not None:
        table.add_column("eq. (1) on the\nsame data, °", justify="right")
    sigma, error = None if report.budget is None else total(report.budget), report.error
    for name in Angles._fields:
        row = [name, _angle(getattr(d, name))]
        if sigma is not None and report.crossing is not None:
            row += [_minutes(float(getattr(sigma, name))), f"{float(getattr(report.crossing, name)):.3g}"]
        if report.truth is not None and error is not None:
            off = float(getattr(error, name)) / ARCMIN
            row += [_angle(getattr(report.truth, name)), "–" if math.isnan(off) else f"{off:.3f}"]
        if report.mean_angles is not None:
            row.append(_angle(getattr(report.mean_angles, name)))
        table.add_row(*row)
    console.print(table)
    console.print(f"Measured: Earth rate {float(d.earth_rate) / DEG_H:.4f} deg/h, gravity {float(d.gravity):.5f} m/s².")
    if report.residual is not None:
        console.print(
            f"Residual velocity after the fit of the cone (heave, sway, noise): {report.residual:.3g} m/s rms."
        )
    for warning in d.warnings:
        console.print(warning[0].upper() + warning[1:], markup=False)
    if report.budget is None:
        return
    sources = Table(title="Expected error by source, σ in ′", title_justify="left")
    sources.add_column("source")
    for name in Angles._fields:
        sources.add_column(name, justify="right")
    for source in report.budget:
        if any(float(value) > 0.0 for value in report.budget[source]):
            sources.add_row(source, *(_minutes(float(value)) for value in report.budget[source]))
    sources.add_section()
    sources.add_row("total", *(_minutes(float(value)) for value in total(report.budget)))
    if report.mean is not None and any(float(value) != 0.0 for value in report.mean):
        sources.add_row("known mean error", *(_minutes(float(value)) for value in report.mean))
    console.print(sources)


def _angle(value: Array) -> str:
    return "not determined" if np.isnan(value) else f"{round(float(value) / DEG, 5) + 0.0:.5f}"  # no negative zero


def _minutes(value: float) -> str:
    return "–" if value == 0.0 else f"{value / ARCMIN:.3f}" if abs(value) >= 5e-4 * ARCMIN else "<0.001"
