"""Names and colours of the errors of a one-component run, in its report, its recording and its table."""

from __future__ import annotations

from sinssim.recording.style import COLORS, Rgb

SIMULATION_COLOR: Rgb = COLORS["measured-attitude"]
"""Colour of the simulation, as in figure 8.4."""

EQUATION_NAMES = {
    "equation_8_10": "equation (8.10)",
    "equation_8_11": "equation (8.11)",
    "equation_8_12": "first order (8.12)",
    "closed_form": "closed form at rest",
}
"""Names of the error equations by their names in summary and streams."""

EQUATION_COLORS: dict[str, Rgb] = {
    "equation_8_10": COLORS["rotation-vector"],
    "equation_8_11": COLORS["two-quaternions"],
    "equation_8_12": COLORS["euler"],
    "closed_form": COLORS["poisson"],
}
"""Their colours."""

ROW_NAMES = {"simulation": "simulation", "perfect_sensors": "perfect sensors", **EQUATION_NAMES}
"""Names of the rows of the table of errors."""
