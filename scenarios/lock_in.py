"""The lock-in study: the response of a laser gyro with coupled beams to slow rotations, without and with dither.

Run it from anywhere:  python scenarios/lock_in.py [-o DIR] [--quick]

It integrates the lock-in equation of a triangular ring (sides of 14 cm, 1.6 arcsec a pulse, lock-in at 0.1 deg/s,
dither of 100 deg/s at 400 Hz) and writes figures (SVG, PNG), summary.json, summary.md, report.html and recording.rrd:
  1. the dead zone without dither against sign(Ω)√(Ω² − Ω_L²), and the dithered gyro's straight line;
  2. the remaining dead zone if all turning points, every other one, or none is random, against closed forms;
  3. the growth of the angle error in each case: proportional to time, or as a random walk;
  4. the random walk against N = Ω_L/√(K Ω_D) over a decade of dither rates, and at other frequencies.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray
from support.lock_in_equation import Randomised, angle_error, turnarounds

from sinssim.charts import Axis, Band, Chart, Charts, Dots, Line, Mark, Rule
from sinssim.exhibits import Column, Exhibits, Section, Sentence, Table
from sinssim.recording import style
from sinssim.recording.figures import figure_of, save
from sinssim.recording.page import page_of
from sinssim.recording.rerun_exhibits import markdown, record
from sinssim.sensors.imu.laser_gyro import LaserGyro
from sinssim.system.files import write_text
from sinssim.units import ARCSEC, DEG, DEG_SQRT_H, fixed

Array = NDArray[np.float64]

KINDS: tuple[Randomised, ...] = get_args(Randomised)
LABELS = {"both": "all turning points random", "one": "every other one random", "none": "none random (regular dither)"}
LINES = ("both", "none", "one", "undithered")
COLORS = dict(zip(LINES, map(style.css, style.colors(LINES)), strict=True))
BLOCK = 4  # swings between the errors whose differences give the random walk


def gyro(dither_deg_s: float = 100.0, frequency: float = 400.0) -> LaserGyro:
    """Return the ring of the study with a dither of a given largest rate."""
    side = 0.14
    return LaserGyro(
        perimeter=3.0 * side,
        area=np.sqrt(3.0) / 4.0 * side**2,
        wavelength=632.8e-9,
        lock_in=0.1 * DEG,
        dither_amplitude=dither_deg_s * DEG / (2.0 * np.pi * frequency),
        dither_frequency=frequency,
    )


def given_rate(g: LaserGyro, rate: float, angles: Array) -> float:
    """Return the mean measured rate after the initial transient, rad/s."""
    error = angle_error(g, rate, angles)
    half = len(error) // 2
    return float(rate + (error[-1] - error[half]) / (len(error) - 1 - half) * 2.0 * g.dither_frequency)


def transfer(points: int, swings: int, rng: np.random.Generator) -> dict[str, Array]:
    """Step through rates on both sides of the dead zone, without and with dither."""
    g = gyro()
    rate = np.linspace(-2.5, 2.5, points) * g.lock_in
    undithered = np.array([given_rate(g, r, np.zeros(4 * swings + 1)) for r in rate])
    dithered = np.array([given_rate(g, r, turnarounds(g, swings, rng)) for r in rate])
    return {"rate": rate, "undithered": undithered, "dithered": dithered, "theory": g.undithered_rate(rate)}


def zones(points: int, swings: int, rng: np.random.Generator) -> dict[str, Array]:
    """Step through small rates with each kind of dither."""
    g = gyro()
    rate = np.linspace(-0.1, 0.1, points) * g.lock_in
    return {
        "rate": rate,
        **{kind: np.array([given_rate(g, r, turnarounds(g, swings, rng, kind)) for r in rate]) for kind in KINDS},
    }


def widths(g: LaserGyro) -> dict[str, float]:
    """Return the half-width of the dead zone by theory, rad/s."""
    return {"both": 0.0, "one": g.half_random_dead_zone, "none": g.regular_dead_zone}


def growth(seeds: int, swings: int) -> dict[str, Array]:
    """Return root mean squares over seeds of the angle error at a rate inside all remaining dead zones."""
    g = gyro()
    rate = 0.5 * g.half_random_dead_zone
    result = {"time": (np.arange(swings) + 0.5) * 0.5 / g.dither_frequency, "rate": np.array(rate)}
    for kind in KINDS:
        square = np.zeros(swings)
        for seed in range(seeds):
            rng = np.random.default_rng([seed, KINDS.index(kind)])
            phase = float(rng.uniform(0.0, 2.0 * np.pi))
            square += angle_error(g, rate, turnarounds(g, swings, rng, kind), phase) ** 2
        result[kind] = np.sqrt(square / seeds)
    return result


def random_walk(dithers: Array, frequency: float, swings: int, rng: np.random.Generator) -> list[dict[str, float]]:
    """Measure the random walk of dithered gyros and compare it with the formula."""
    rows = []
    for dither in dithers:
        g = gyro(float(dither), frequency)
        error = angle_error(g, 1e-4, turnarounds(g, swings, rng), float(rng.uniform(0.0, 2.0 * np.pi)))
        grown = np.diff(error[::BLOCK])
        measured = float(np.sqrt(np.mean(grown**2) / (BLOCK * 0.5 / frequency)))
        rows.append(
            {
                "dither_deg_s": float(dither),
                "frequency_hz": frequency,
                "measured_deg_sqrt_h": measured / DEG_SQRT_H,
                "formula_deg_sqrt_h": g.random_walk / DEG_SQRT_H,
                "ratio": measured / g.random_walk,
                "standard_error": 1.0 / np.sqrt(2.0 * len(grown)),
            }
        )
    return rows


def response(swept: dict[str, Array], left: dict[str, Array]) -> Charts:
    """Return both responses: over the dead zone without dither, and over the dead zones that remain with dithers."""
    g = gyro()
    fine = np.linspace(-2.5, 2.5, 2001) * g.lock_in
    whole = (
        Line(label="sign(Ω)√(Ω² − Ω_L²)", x=fine, y=g.undithered_rate(fine), color="soft", weight="thin"),
        Dots(label="without dither, integrated", x=swept["rate"], y=swept["undithered"], color=COLORS["undithered"]),
        Dots(label="random dither, integrated", x=swept["rate"], y=swept["dithered"], color=COLORS["both"], marker="P"),
    )
    fine = 0.04 * fine
    near: list[Mark] = []
    for kind, zone in widths(g).items():
        near.append(Line(x=fine, y=remaining(fine, zone), color=COLORS[kind], weight="thin"))
        near.append(Dots(label=LABELS[kind], x=left["rate"], y=left[kind], color=COLORS[kind]))

    def chart(title: str, unit: str, size: float, marks: Sequence[Mark]) -> Chart:
        true, measured = (Axis(label=f"{name} rate", units=fixed(unit, size)) for name in ("true", "measured"))
        return Chart(key=unit, title=title, x=true, y=measured, marks=tuple(marks))

    return Charts("response", (
        (chart("Dead zone without and with random dither", "deg/s", DEG, whole),
         chart("Remaining dead zone (lines: closed forms)", "arcsec/s", ARCSEC, near)),
    ), (10.5, 4.6))  # fmt: skip


def remaining(rate: Array, zone: float) -> Array:
    """Return the rates that are measured beside a dead zone, closed form."""
    return np.sign(rate) * np.sqrt(np.maximum(rate**2 - zone**2, 0.0))


def growth_of_errors(grown: dict[str, Array]) -> Charts:
    """Return the growth of the error in each case."""
    time = grown["time"]
    lines = [Line(label=LABELS[kind], x=time, y=grown[kind], color=COLORS[kind]) for kind in KINDS]
    walk, turned = gyro().random_walk * np.sqrt(time), grown["rate"] * time
    lines.append(Line(label="N√t", x=time, y=walk, color="soft", weight="thin", dash="--"))
    lines.append(Line(label="Ωt: no response to the rotation", x=time, y=turned, color="soft", weight="thin", dash=":"))
    return Charts("growth", ((Chart(
        key="growth", title=f"A rotation of {float(grown['rate']) / ARCSEC:.2f} arcsec/s with three dithers",
        x=Axis(label="time", units=fixed("s"), log=True),
        y=Axis(label="angle error, rms over seeds", units=fixed("arcsec", ARCSEC), log=True), marks=tuple(lines),
    ),),), (7.0, 4.6))  # fmt: skip


def walk_over_dither(rows: list[dict[str, float]]) -> Charts:
    """Return the random walk over the dither rate, integrated beside the formula, and over it."""
    decade = [row for row in rows if row["frequency_hz"] == rows[0]["frequency_hz"]]
    dither, formula, error = (
        np.array([row[key] for row in decade]) for key in ("dither_deg_s", "formula_deg_sqrt_h", "standard_error")
    )
    upper: list[Mark] = [
        Line(label="N = Ω_L/√(K Ω_D), K in rad/rad", x=dither, y=formula, color="soft", weight="thin"),
    ]
    lower: list[Mark] = [
        Rule(at=0.0), Band(label="2σ", x=dither, low=-200.0 * error, high=200.0 * error, color="bound"),
    ]  # fmt: skip
    for frequency, color, marker in ((400.0, "both", "o"), (200.0, "one", "s"), (800.0, "none", "^")):
        own = [row for row in rows if row["frequency_hz"] == frequency]
        x, walk, ratio = (np.array([r[key] for r in own]) for key in ("dither_deg_s", "measured_deg_sqrt_h", "ratio"))
        look: dict[str, Any] = {"x": x, "color": COLORS[color], "marker": marker, "size": 5.0}
        upper.append(Dots(label=f"integrated, {frequency:g} Hz", y=walk, **look))
        lower.append(Dots(y=100.0 * (ratio - 1.0), **look))
    largest = Axis(label="largest dither rate Ω_D", units=fixed("deg/s"), log=True)
    walks, excess = Axis(label="angle random walk", units=fixed("deg/√h"), log=True), Axis(label="excess over formula",
                    units=fixed("%"), low=-12.0, high=12.0)  # fmt: skip
    title = "Random walk of a dithered gyro with a lock-in of 0.1 deg/s"
    return Charts("random_walk", (
        (Chart(key="walk", title=title, x=largest, y=walks, marks=tuple(upper)),),
        (Chart(key="excess", x=largest, y=excess, marks=tuple(lower)),),
    ), (7.0, 5.6), share="x", heights=(2.0, 1.0))  # fmt: skip


def exhibits_of(
    summary: dict[str, Any], swept: dict[str, Array], left: dict[str, Array], grown: dict[str, Array]
) -> Exhibits:
    """Return what the study has to show."""

    def table(heads: tuple[str, ...], rows: Sequence[Sequence[str]]) -> Table:
        return Table((Column(heads[0], words=True), *map(Column, heads[1:])), rows)

    found = {key: f"{value:.1e}" for key, value in summary["transfer"].items()}
    score, growth = f"{summary['transfer']['dithered_score']:.1f}", summary["growth"]
    zones = [(LABELS[kind], *(f"{row[key]:.3f}" for key in ("half_width_arcsec_s", "departure_arcsec_s")))
             for kind, row in summary["dead_zones"].items()]  # fmt: skip
    walks = [
        (f"{row['dither_deg_s']:.1f}", f"{row['frequency_hz']:g}", f"{row['measured_deg_sqrt_h']:.5f}",
         f"{row['formula_deg_sqrt_h']:.5f}", f"{row['ratio']:.3f}", f"{row['standard_error']:.3f}")
        for row in summary["random_walk"]
    ]  # fmt: skip
    return Exhibits("Lock-in study", [
        table(("ring", ""), [(key.replace("_", " "), f"{value:.6g}") for key, value in summary["gyro"].items()]),
        Section("Response", [
            response(swept, left),
            table(("quantity", ""), [
                ("largest deviation from the closed form without dither, in Ω_L", found["undithered_departure"]),
                ("largest deviation of the dithered gyro from the true rate, in Ω_L", found["dithered_departure"]),
                ("the same in standard deviations of its random walk", score),
                ("slope of the dithered response minus one", found["dithered_slope_error"]),
            ]),
            table(("remaining dead zone", "half-width, arcsec/s", "largest deviation from theory, arcsec/s"), zones),
        ]),
        Section("Growth of the angle error", [
            Sentence(f"At {growth['rate_arcsec_s']:.2f} arcsec/s, root mean square after {growth['time_s']:.2f} s."),
            growth_of_errors(grown),
            table(("dither", "arcsec"), [
                *((LABELS[kind], f"{growth[f'{kind}_arcsec']:.3f}") for kind in KINDS),
                ("N√t", f"{growth['random_walk_arcsec']:.3f}"), ("Ωt", f"{growth['locked_arcsec']:.3f}"),
            ]),
        ]),
        Section("Random walk, deg/√h", [
            walk_over_dither(summary["random_walk"]),
            table(("Ω_D, deg/s", "f, Hz", "integrated", "Ω_L/√(K Ω_D)", "ratio", "standard error"), walks),
            Sentence("K is in radians of phase per radian, 8πA/(λL). With K in pulses per radian the same formula is "
                     "Ω_L/√(2πK Ω_D).", "note"),
        ]),
    ], name="lock_in", root="lock_in", pictures=("response", "growth", "random_walk"))  # fmt: skip


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("-o", "--out", type=Path, default=Path("runs/lock_in"), help="folder to write")
    parser.add_argument(
        "--quick", action="store_true", help="fewer points and shorter runs: seconds instead of a minute"
    )
    options = parser.parse_args()
    folder: Path = options.out
    part = 8 if options.quick else 1
    rng = np.random.default_rng(2026)
    g = gyro()

    swept = transfer(7 if options.quick else 41, 1600 // part, rng)
    left = zones(5 if options.quick else 31, 1600 // part, rng)
    grown = growth(24 // part, 1600 // part)
    swings = 1200 if options.quick else 15000
    decade = random_walk(np.geomspace(20.0, 200.0, 3 if options.quick else 8), 400.0, swings, rng)
    others = [random_walk(np.array([100.0]), f, swings, rng)[0] for f in (200.0, 800.0)]

    # A mean over the second half of the swings: the random walk's standard deviation over that time.
    noise = g.random_walk * np.sqrt(2.0 * g.dither_frequency / (1600 // part // 2))
    off = swept["dithered"] - swept["rate"]
    closed = {kind: remaining(left["rate"], zone) for kind, zone in widths(g).items()}
    end = float(grown["time"][-1])
    summary: dict[str, Any] = {
        "gyro": {
            "perimeter_m": g.perimeter,
            "area_m2": g.area,
            "wavelength_m": g.wavelength,
            "lock_in_deg_s": g.lock_in / DEG,
            "pulse_weight_arcsec": g.pulse_weight / ARCSEC,
            "scale_rad_per_rad": g.scale,
            "dither_rate_deg_s": g.dither_rate / DEG,
            "dither_frequency_hz": g.dither_frequency,
        },
        "transfer": {
            "undithered_departure": float(np.abs(swept["undithered"] - swept["theory"]).max() / g.lock_in),
            "dithered_departure": float(np.abs(off).max() / g.lock_in),
            "dithered_score": float(np.abs(off).max() / noise),
            "dithered_slope_error": float(np.polyfit(swept["rate"], off, 1)[0]),
        },
        "dead_zones": {
            kind: {
                "half_width_arcsec_s": zone / ARCSEC,
                "departure_arcsec_s": float(np.abs(left[kind] - closed[kind]).max() / ARCSEC),
            }
            for kind, zone in widths(g).items()
        },
        "growth": {
            "rate_arcsec_s": float(grown["rate"]) / ARCSEC,
            "time_s": end,
            **{f"{kind}_arcsec": float(grown[kind][-1]) / ARCSEC for kind in KINDS},
            "random_walk_arcsec": g.random_walk * np.sqrt(end) / ARCSEC,
            "locked_arcsec": float(grown["rate"]) * end / ARCSEC,
        },
        "random_walk": decade + others,
    }
    exhibits = exhibits_of(summary, swept, left, grown)
    for charts in exhibits.charts():
        for suffix in (".svg", ".png"):
            save(figure_of(charts), folder / f"{charts.key}{suffix}")
    text = markdown(exhibits)
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "summary.json", json.dumps(summary, indent=2))
    write_text(folder / "summary.md", text)
    write_text(folder / "report.html", page_of(exhibits))
    record(exhibits, folder / "recording.rrd")
    print(text)
    print(f"Report, figures and recording are in {folder}. View: sinssim view {folder}")


if __name__ == "__main__":
    main()
