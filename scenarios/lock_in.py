"""The lock-in study: the response of a laser gyro with coupled beams to slow rotations, without and with dither.

Run it from anywhere:  python scenarios/lock_in.py [-o DIR] [--quick]

It integrates the lock-in equation of a triangular ring (sides of 14 cm, 1.6 arcsec a pulse, lock-in at 0.1 deg/s,
dither of 100 deg/s at 400 Hz) and writes figures (SVG and PNG), summary.json, summary.md and recording.rrd:
  1. the dead zone without dither against sign(Ω)√(Ω² − Ω_L²), and the dithered gyro's straight line;
  2. the remaining dead zone if all turning points, every other one, or none is random, against closed forms;
  3. the growth of the angle error in each case: proportional to time, or as a random walk;
  4. the random walk against N = Ω_L/√(K Ω_D) over a decade of dither rates, and at other frequencies.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path
from typing import Any, get_args

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from support.lock_in_recording import record_lock_in_study

from sinssim.recording import style
from sinssim.recording.figures import new_figure, save, styled
from sinssim.sensors.imu.laser_gyro import LaserGyro
from sinssim.sensors.imu.lock_in import Randomised, angle_error, turnarounds
from sinssim.units import ARCSEC, DEG, DEG_SQRT_H

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


@styled
def draw_transfer(swept: dict[str, Array], left: dict[str, Array]) -> Figure:
    """Draw both responses: over the dead zone without dither, and over the dead zones that remain with dithers."""
    g = gyro()
    figure = new_figure(10.5, 4.6)
    whole, near = figure.subplots(1, 2)
    fine = np.linspace(-2.5, 2.5, 2001) * g.lock_in
    whole.plot(
        fine / DEG, g.undithered_rate(fine) / DEG, color=style.SOFT, lw=style.THIN, label="sign(Ω)√(Ω² − Ω$_L$²)"
    )
    whole.plot(
        swept["rate"] / DEG,
        swept["undithered"] / DEG,
        ".",
        color=COLORS["undithered"],
        label="without dither, integrated",
    )
    whole.plot(
        swept["rate"] / DEG, swept["dithered"] / DEG, "+", color=COLORS["both"], label="random dither, integrated"
    )
    whole.set_title("Dead zone without and with random dither")
    fine = np.linspace(-0.1, 0.1, 2001) * g.lock_in
    for kind, zone in widths(g).items():
        theory = np.sign(fine) * np.sqrt(np.maximum(fine**2 - zone**2, 0.0))
        near.plot(fine / ARCSEC, theory / ARCSEC, color=COLORS[kind], lw=style.THIN)
        near.plot(left["rate"] / ARCSEC, left[kind] / ARCSEC, ".", color=COLORS[kind], label=LABELS[kind])
    near.set_title("Remaining dead zone (lines: closed forms)")
    for axes, unit in ((whole, "deg/s"), (near, "arcsec/s")):
        axes.set_xlabel(f"true rate [{unit}]")
        axes.set_ylabel(f"measured rate [{unit}]")
        axes.legend()
    return figure


@styled
def draw_growth(grown: dict[str, Array]) -> Figure:
    """Draw the growth of the error in each case."""
    g = gyro()
    figure = new_figure(7.0, 4.6)
    axes = figure.subplots()
    time = grown["time"]
    for kind in KINDS:
        axes.loglog(time, grown[kind] / ARCSEC, color=COLORS[kind], label=LABELS[kind])
    axes.loglog(time, g.random_walk * np.sqrt(time) / ARCSEC, "--", color=style.SOFT, lw=style.THIN, label="N√t")
    turned = grown["rate"] * time / ARCSEC
    axes.loglog(time, turned, ":", color=style.SOFT, lw=style.THIN, label="Ωt: no response to the rotation")
    axes.set_xlabel("time [s]")
    axes.set_ylabel("angle error, rms over seeds [arcsec]")
    axes.set_title(f"A rotation of {float(grown['rate']) / ARCSEC:.2f} arcsec/s with three dithers")
    axes.legend()
    return figure


@styled
def draw_random_walk(decade: list[dict[str, float]], others: list[dict[str, float]]) -> Figure:
    """Draw the random walk over the dither rate, simulated over formula."""
    figure = new_figure(7.0, 5.6)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    dither = np.array([row["dither_deg_s"] for row in decade])
    upper.loglog(
        dither,
        [row["formula_deg_sqrt_h"] for row in decade],
        color=style.SOFT,
        lw=style.THIN,
        label="N = Ω$_L$/√(K Ω$_D$), K in rad/rad",
    )
    for rows, marker, color, label in (
        (decade, "o", COLORS["both"], "integrated, 400 Hz"),
        (others, "s", COLORS["one"], "integrated, " + ", ".join(f"{row['frequency_hz']:g}" for row in others) + " Hz"),
    ):
        x = [row["dither_deg_s"] for row in rows]
        upper.loglog(x, [row["measured_deg_sqrt_h"] for row in rows], marker, color=color, ms=5, label=label)
        band = [200.0 * row["standard_error"] for row in rows]
        off = [100.0 * (row["ratio"] - 1.0) for row in rows]
        lower.errorbar(x, off, band, fmt=marker, color=color, ms=4, capsize=3, lw=style.THIN)
    lower.axhline(0.0, color=style.SOFT, lw=style.THIN)
    lower.set_ylim(-12.0, 12.0)
    lower.set_xlabel("largest dither rate Ω$_D$ [deg/s]")
    lower.set_ylabel("excess over formula [%]\n(bars: 2σ)")
    upper.set_ylabel("angle random walk [deg/√h]")
    upper.set_title("Random walk of a dithered gyro with a lock-in of 0.1 deg/s")
    ticks = [20, 30, 50, 70, 100, 140, 200]
    lower.set_xticks(ticks, [str(tick) for tick in ticks])
    walks = [0.004, 0.005, 0.007, 0.01]
    upper.set_yticks(walks, [str(walk) for walk in walks])
    upper.minorticks_off()
    lower.minorticks_off()
    upper.legend()
    return figure


def tables(summary: dict[str, Any]) -> str:
    """Return the summary as Markdown."""
    ring, response = summary["gyro"], summary["transfer"]
    lines = ["# Lock-in study", "", "| ring | |", "|---|---|"]
    lines += [f"| {key.replace('_', ' ')} | {value:.6g} |" for key, value in ring.items()]
    lines += ["", "## Response", "", "| quantity | |", "|---|---|"]
    lines += [
        f"| largest deviation from the closed form without dither, in Ω_L | {response['undithered_departure']:.1e} |",
        f"| largest deviation of the dithered gyro from the true rate, in Ω_L | {response['dithered_departure']:.1e} |",
        f"| the same in standard deviations of its random walk | {response['dithered_score']:.1f} |",
        f"| slope of the dithered response minus one | {response['dithered_slope_error']:.1e} |",
    ]
    lines += ["", "## Remaining dead zone", ""]
    lines += [
        "| dither | half-width, arcsec/s | largest deviation from theory, arcsec/s |",
        "|---|---|---|",
    ]
    for kind in KINDS:
        row = summary["dead_zones"][kind]
        lines.append(f"| {LABELS[kind]} | {row['half_width_arcsec_s']:.3f} | {row['departure_arcsec_s']:.3f} |")
    lines += ["", "## Growth of the angle error", ""]
    lines += [f"At {summary['growth']['rate_arcsec_s']:.2f} arcsec/s, root mean square after "
              f"{summary['growth']['time_s']:.2f} s:", ""]  # fmt: skip
    lines += ["| dither | arcsec |", "|---|---|"]
    lines += [f"| {LABELS[kind]} | {summary['growth'][kind + '_arcsec']:.3f} |" for kind in KINDS]
    lines += [f"| N√t | {summary['growth']['random_walk_arcsec']:.3f} |"]
    lines += [f"| Ωt | {summary['growth']['locked_arcsec']:.3f} |"]
    lines += ["", "## Random walk, deg/√h", ""]
    lines += [
        "| Ω_D, deg/s | f, Hz | integrated | Ω_L/√(K Ω_D) | ratio | standard error |",
        "|---|---|---|---|---|---|",
    ]
    for row in summary["random_walk"]:
        lines.append(
            f"| {row['dither_deg_s']:.1f} | {row['frequency_hz']:g} | {row['measured_deg_sqrt_h']:.5f} | "
            f"{row['formula_deg_sqrt_h']:.5f} | {row['ratio']:.3f} | {row['standard_error']:.3f} |"
        )
    lines += ["", "K is in radians of phase per radian, 8πA/(λL). With K in pulses per radian the same formula is "
              "Ω_L/√(2πK Ω_D).", ""]  # fmt: skip
    return "\n".join(lines)


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

    swept = transfer(11 if options.quick else 41, 1600 // part, rng)
    left = zones(9 if options.quick else 31, 1600 // part, rng)
    grown = growth(24 // part, 1600 // part)
    swings = 3000 if options.quick else 15000
    decade = random_walk(np.geomspace(20.0, 200.0, 3 if options.quick else 8), 400.0, swings, rng)
    others = [random_walk(np.array([100.0]), f, swings, rng)[0] for f in (200.0, 800.0)]

    # A mean over the second half of the swings: the random walk's standard deviation over that time.
    noise = g.random_walk * np.sqrt(2.0 * g.dither_frequency / (1600 // part // 2))
    off = swept["dithered"] - swept["rate"]
    closed = {
        kind: np.sign(left["rate"]) * np.sqrt(np.maximum(left["rate"] ** 2 - zone**2, 0.0))
        for kind, zone in widths(g).items()
    }
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
    for name, figure in (
        ("response", draw_transfer(swept, left)),
        ("growth", draw_growth(grown)),
        ("random_walk", draw_random_walk(decade, others)),
    ):
        for suffix in (".svg", ".png"):
            save(figure, folder / f"{name}{suffix}")
    text = tables(summary)
    for name, content in (("summary.json", json.dumps(summary, indent=2)), ("summary.md", text)):
        draft = folder / f".{name}.part"
        draft.write_text(content, encoding="utf-8")
        os.replace(draft, folder / name)
    record_lock_in_study(folder / "recording.rrd", swept=swept, left=left, grown=grown, summary=text)
    print(text)
    print(f"Figures, summary and recording are in {folder}. View: sinssim view {folder}")


if __name__ == "__main__":
    main()
