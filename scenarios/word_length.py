"""Errors of the computer: the word length of increments, attitude, velocity and position, over an hour of cruise.

Run it from anywhere:  python scenarios/word_length.py [-o DIR] [--quick]

Two runs of the same algorithm on the same increments differ in their words only. One rounds its variables after every
step to n bits of their range, cuts them off, or computes in single precision; the other keeps 53 bits. Their difference
is the error of the computer. Closed forms, for a least significant bit δ and f steps per second:

    rounding     independent errors of δ/√12, a random walk of attitude of δ √(k f/12) rad/√s about every axis, with
                 k = 4 for a quaternion, 1/2 for a direction cosine matrix, 1 for Euler angles
    cutting off  errors of −δ/2 on average, a drift of up to 2δf, ¾δf and ½√3δf rad/s
    velocity     a random walk of δ √(f/12) m/s/√s, or an acceleration of −δf/2
    position     a random walk of δ √(f/12), or a velocity of −δf/2, without effect on the Schuler loop: the attitude
                 does not change with the rounded coordinates

A rounded variable is a multiple of δ. Its errors are independent if its change varies by more than δ from step to step,
here by vibration; constant changes are rounded in the same way every time, which is a drift of up to δf/2, and changes
below δ/2 are lost. The position errors follow from `sinssim.sensors.error_propagation`, and those of the sensors from
`sinssim.sensors.error_propagation`. Overflow is not simulated.

It writes word_length.svg and .png, errors.csv, single_precision.csv and words.csv.
"""

from __future__ import annotations

import argparse
import csv
import math
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table
from support.word_errors import (
    ALGORITHMS,
    FACTORS,
    HEIGHT,
    INCREMENTS,
    LATITUDE,
    SCHULER,
    SINGLE,
    SPEED,
    cut_drift,
    grown,
    least_bits,
    lsb_of,
    random_walk,
    single_walk,
)
from support.words import engine

from sinssim import earth, rotation
from sinssim.charts import Axis, Chart, Charts, Dots, Line, Mark, Rule
from sinssim.data import Array, ImuData
from sinssim.earth.gravity import EarthParameters
from sinssim.experiments.studies.position_claims import COMPUTER_SHARE as SHARE
from sinssim.recording import style
from sinssim.recording.figures import figure_of, save
from sinssim.sensors.error_propagation import expect
from sinssim.sensors.imu.grades import GRADES
from sinssim.sensors.imu.imu_section import Imu
from sinssim.strapdown.coning_sculling import weight_table
from sinssim.truth.motions.parked_and_great_circle import GreatCircle
from sinssim.units import ARCSEC, DEG, DEG_H, DEG_SQRT_H, UG, fixed

LOST = 1e6  # m: a solution this far off is no solution


class Cruise(NamedTuple):
    """Increments of a cruise, and its state at the start, as the kernel takes it."""

    imu: ImuData
    start: Array

    def at(self, rate_hz: float) -> Cruise:
        """The same at a lower rate."""
        ratio = round(self.rate_hz / rate_hz)
        sums = (np.add.reduceat(a, np.arange(0, len(a), ratio)) for a in (self.imu.dtheta, self.imu.dvel))
        return Cruise(ImuData(self.imu.time[::ratio], *sums), self.start)

    @property
    def rate_hz(self) -> float:
        """Sampling rate, Hz."""
        return float((len(self.imu.time) - 1) / self.imu.time[-1])


def cruise(duration: float, rate_hz: float) -> Cruise:
    """Return a level great circle at 250 m/s with vibration: white noise of 100″ and 0.05 m/s in angle and velocity."""
    truth = GreatCircle(LATITUDE, 30.0 * DEG, HEIGHT, 60.0 * DEG, SPEED, duration)
    imu, s = truth.increments(rate_hz), truth.state(0.0)
    rng = np.random.default_rng(1)
    shaken = [np.diff(size * rng.standard_normal((len(imu) + 1, 3)), axis=0) for size in (100.0 * ARCSEC, 0.05)]
    start = np.array([s.latitude, s.longitude, s.height, *s.velocity_ned, *s.q_nb])
    return Cruise(ImuData(imu.time, imu.dtheta + shaken[0], imu.dvel + shaken[1]), start)


def run(c: Cruise, algorithm: str, lsb: tuple[float, float, float], cut: bool = False, whole: bool = False) -> Array:
    """Return latitude, longitude, velocity north and east and attitude every second, (M, 8).

    Args:
        c: the cruise.
        algorithm: one of `ALGORITHMS`.
        lsb: δ of attitude, velocity and position; 0 for 53 bits, `SINGLE` for single precision.
        cut: whether words are cut off instead of rounded.
        whole: whether all arithmetic is in single precision.

    Returns:
        The states.
    """
    every, p = round(c.rate_hz), earth.parameters(earth.ellipsoid_by_name("wgs84"))
    given = [c.imu.dtheta, c.imu.dvel, weight_table(c.imu.time, True), 1.0 / c.rate_hz, p, c.start]
    if whole:
        p = EarthParameters(*(np.float64(np.float32(value)) for value in p))
        given = [*(np.float64(np.float32(value)) for value in given[:4]), p, np.float64(np.float32(c.start))]
    states = np.empty((len(c.imu) // every + 1, 8))
    states[0] = np.delete(c.start, (2, 5))
    engine(algorithm, whole)(*given, np.array(lsb), cut, every, states)
    return states


class Difference(NamedTuple):
    """Error of the computer every second.

    Attributes:
        turn: turns in inertial space, in north-east-down axes of their second, (M-1, 3) rad.
        velocity: errors of velocity north and east, (M, 2) m/s.
        angles: errors of latitude and longitude, (M, 2) rad.
        position: horizontal position error, (M,) m.
    """

    turn: Array
    velocity: Array
    angles: Array
    position: Array


def difference(found: Array, reference: Array) -> Difference:
    """Return what words of finite length changed."""
    time = np.arange(len(found), dtype=float)
    q_in, in_i = [], []
    for s in (found, reference):
        q_in.append(earth.q_en(s[:, 0], s[:, 1] + earth.OMEGA_IE * time))
        in_i.append(rotation.multiply(q_in[-1], s[:, 4:]))
    turned = rotation.rotation_vector_from_quaternion(
        rotation.normalize(rotation.multiply(in_i[0], rotation.conjugate(in_i[1])))
    )
    turn = rotation.rotate(rotation.conjugate(q_in[1][:-1]), np.diff(turned, axis=0))
    angles = found[:, :2] - reference[:, :2]
    r1, r2 = earth.radii(reference[:, 0])
    scale = np.stack([r1 + HEIGHT, (r2 + HEIGHT) * np.cos(reference[:, 0])], axis=1)
    return Difference(turn, found[:, 2:4] - reference[:, 2:4], angles, np.linalg.norm(angles * scale, axis=1))


# --- the study


UNITS = {
    "velocity": ("m/s/√h", 1.0 / 60.0, "µg", UG),
    "position": ("m/√h", 1.0 / 60.0 / SCHULER.radius, "m/s", 1.0 / SCHULER.radius),
}
OF_TURNS = ("deg/√h", DEG_SQRT_H, "deg/h", DEG_H)


def measured(variable: str, d: Difference) -> tuple[float, Array, float]:
    """Return random walk and drift of a difference, SI units, and the position error at its end, m."""
    steps = d.turn if variable not in UNITS else np.diff(d.velocity if variable == "velocity" else d.angles, axis=0)
    return float(np.sqrt(steps.var(axis=0).mean())), steps[:60].mean(axis=0), float(d.position[-1])


def with_words(c: Cruise, variable: str, lsb: float, cut: bool, carried: bool = False) -> Array:
    """Return the states of a run in which one kind of variable has short words."""
    algorithm = variable if variable in ALGORITHMS else "quaternion"
    if variable == INCREMENTS:
        whole = np.cumsum(c.imu.dtheta, axis=0) if carried else c.imu.dtheta
        words = np.floor(whole / lsb + (0.0 if cut else 0.5)) * lsb
        imu = ImuData(c.imu.time, np.diff(words, axis=0, prepend=0.0) if carried else words, c.imu.dvel)
        return run(Cruise(imu, c.start), algorithm, (0.0, 0.0, 0.0))
    place = ("velocity", "position").index(variable) + 1 if variable in UNITS else 0
    return run(c, algorithm, tuple(lsb * (i == place) for i in range(3)), cut)  # type: ignore[arg-type]


def study_words(c: Cruise, bits: list[int]) -> list[dict[str, Any]]:
    """Run every kind of variable with every word length, rounded and cut off."""
    f, time, rows = c.rate_hz, float(c.imu.time[-1]), []
    references = {name: run(c, name, (0.0, 0.0, 0.0)) for name in ALGORITHMS}
    for variable in FACTORS | dict.fromkeys(UNITS):
        reference = references.get(variable, references["quaternion"])
        walk_unit, walk, drift_unit, drift = UNITS.get(variable, OF_TURNS)
        for n in bits:
            lsb = lsb_of(variable, n, f)
            rounded = measured(variable, difference(with_words(c, variable, lsb, False), reference))
            cut = measured(variable, difference(with_words(c, variable, lsb, True), reference))
            rows.append({
                "variable": variable, "bits": n, "rate_hz": f, "time_s": time, "walk_unit": walk_unit,
                "walk": rounded[0] / walk, "walk_theory": random_walk(variable, lsb, f) / walk,
                "position_m": rounded[2], "position_sigma_m": grown(variable, lsb, f, time, False),
                "drift_unit": drift_unit, "drift": float(np.linalg.norm(cut[1])) / drift,
                "drift_theory": float(np.linalg.norm(cut_drift(variable, lsb, f, reference))) / drift,
                "drift_apart": float(np.linalg.norm(cut[1] - cut_drift(variable, lsb, f, reference))) / drift,
                "cut_position_m": cut[2], "cut_position_at_most_m": grown(variable, lsb, f, time, True),
            })  # fmt: skip
    return rows


def study_single(c: Cruise) -> list[dict[str, Any]]:
    """Run every algorithm with words in single precision, and in single precision throughout."""
    rows, f = [], c.rate_hz
    for name, label in ALGORITHMS.items():
        reference = run(c, name, (0.0, 0.0, 0.0))
        for what, lsb, whole in (
            ("attitude words", (SINGLE, 0.0, 0.0), False),
            ("all words", (SINGLE, SINGLE, SINGLE), False),
            ("throughout", (0.0, 0.0, 0.0), True),
        ):
            d = difference(run(c, name, lsb, whole=whole), reference)
            total = np.cumsum(d.turn, axis=0)[-1] / float(c.imu.time[-1])
            rows.append({
                "algorithm": label, "single_precision": what, "rate_hz": f, "time_s": float(c.imu.time[-1]),
                "walk_deg_sqrt_h": measured(name, d)[0] / DEG_SQRT_H,
                "walk_theory_deg_sqrt_h": single_walk(name, reference, f) / DEG_SQRT_H if what[:3] == "att" else "",
                "drift_deg_h": float(np.linalg.norm(total)) / DEG_H,
                "velocity_m_s": float(np.linalg.norm(d.velocity[-1])),
                "position_m": float(d.position[-1]),
            })  # fmt: skip
    return rows


def needed(rates: list[float]) -> list[dict[str, Any]]:
    """Return the shortest words by grade and rate, for errors of at most 1 % of those of the sensors after an hour."""
    rows = []
    for grade in GRADES:
        total = expect(Imu(grade=grade), LATITUDE).total
        if total == 0.0:  # perfect sensors
            continue
        for f in rates:
            for cut in (False, True):
                # even changes of the position are rounded as badly as cut off
                bits = {v: least_bits(v, f, SHARE * total, cut or v == "position") for v in (*FACTORS, *UNITS)}
                rows.append(
                    {"grade": grade, "sensors_m": total, "rate_hz": f, "words": "cut" if cut else "rounded", **bits}
                )
    return rows


# --- the output


def show(
    rows: list[dict[str, Any]], singles: list[dict[str, Any]], words: list[dict[str, Any]], console: Console
) -> None:
    """Print the tables."""
    time = f"{rows[0]['time_s'] / 60.0:g} min"

    def table(title: str, heads: list[str], cells: list[list[str]]) -> None:
        t = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
        for i, head in enumerate(heads):
            t.add_column(head, justify="left" if i == 0 else "right", no_wrap=True)
        for row in cells:
            t.add_row(*row)
        console.print(t)

    def far(value: float) -> str:
        return f"{value:.3g}" if value < LOST else "lost"

    for kind, title in (
        ("", "Rounding: random walk, and position error"),
        ("cut", "Cutting off: drift, and position error"),
    ):
        keys = (
            ("drift", "cut_position_m", "cut_position_at_most_m")
            if kind
            else ("walk", "position_m", "position_sigma_m")
        )
        table(
            f"{title} after {time} at {rows[0]['rate_hz']:g} Hz",
            ["variable", "bits", "measured", "theory", "unit", "position, m", "at most, m" if kind else "1σ, m"],
            [
                [
                    ALGORITHMS.get(r["variable"], r["variable"]), str(r["bits"]), f"{r[keys[0]]:.3g}",
                    f"{r[keys[0] + '_theory']:.3g}", r[keys[0] + "_unit"], far(r[keys[1]]), far(r[keys[2]]),
                ]
                for r in rows
            ],
        )  # fmt: skip
    table(
        f"Single precision at {rows[0]['rate_hz']:g} Hz, errors after {time}",
        ["algorithm", "single precision", "walk, deg/√h", "theory", "drift, deg/h", "velocity, m/s", "position, m"],
        [
            [str(v) if isinstance(v, str) else f"{v:.3g}" for k, v in r.items() if k not in ("rate_hz", "time_s")]
            for r in singles
        ],
    )
    used = [*FACTORS, *UNITS]
    table(
        f"Bits at {words[0]['rate_hz']:g} Hz for a position error of {100.0 * SHARE:g} % of the sensors' after an hour "
        "(rounded/cut)",
        ["grade", "sensors, m", *(ALGORITHMS.get(v, v) for v in used)],
        [
            [a["grade"], f"{a['sensors_m']:.4g}", *(f"{a[v]}/{b[v]}" for v in used)]
            for a, b in zip(words[::2], words[1::2], strict=True)
            if a["rate_hz"] == words[0]["rate_hz"]
        ],
    )


def charts_of(rows: list[dict[str, Any]], sensors: dict[str, float]) -> Charts:
    """Return the position error over the word length, runs over closed forms, beside 1 % of that of the sensors."""
    time, f = rows[0]["time_s"], rows[0]["rate_hz"]
    names = dict.fromkeys(r["variable"] for r in rows)
    paint = style.colors([f"{name} words" for name in names])
    limits = [Rule(at=SHARE * total, text=f"{100.0 * SHARE:g} % of {grade}", dash=":")
              for grade, total in sensors.items()]  # fmt: skip
    y = Axis(label=f"position error after {time / 60.0:g} min at {f:g} Hz", units=fixed("m"), log=True, low=1e-4,
             high=LOST)  # fmt: skip

    def chart(key: str, title: str, cut: bool, legend: Literal["inside", "none"]) -> Chart:
        marks = list[Mark](limits)
        for name, color, marker in zip(names, paint, "osD^vP", strict=False):
            runs = [r for r in rows if r["variable"] == name]
            bits = np.array([float(r["bits"]) for r in runs])
            fine = np.linspace(bits[0], bits[-1], 50)
            closed = np.array([grown(name, lsb_of(name, 0, f) * 2.0**-n, f, time, cut) for n in fine])
            marks += [Line(x=fine, y=closed, color=color, weight="thin"),
                      Dots(label=ALGORITHMS.get(name, name), x=bits, y=np.array([r[key] for r in runs]), color=color,
                           marker=marker, size=5.0)]  # fmt: skip
        x = Axis(label="word length", units=fixed("bits"), low=bits[0] - 1.0, high=bits[-1] + 12.0, ticks=tuple(bits))
        return Chart(key=key, title=title, x=x, y=y, marks=tuple(marks), legend=legend)

    rounded = chart("position_m", "rounded (lines: 1σ)", False, "none")
    cut = chart("cut_position_m", "cut off (lines: at most)", True, "inside")
    return Charts("word_length", ((rounded, cut),), (11.0, 6.0), share="y")


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--out", type=Path, default=Path("runs/word_length"), help="folder to write")
    parser.add_argument("--quick", action="store_true", help="ten minutes instead of an hour")
    options = parser.parse_args()
    folder: Path = options.out
    folder.mkdir(parents=True, exist_ok=True)
    c = cruise(600.0 if options.quick else 3600.0, 100.0 if options.quick else 200.0)
    rows = study_words(c.at(100.0), [24, 32] if options.quick else [16, 20, 24, 28, 32, 36, 40])
    for rate in () if options.quick else (25.0, 50.0, 200.0):
        rows += study_words(c.at(rate), [24, 32])
    singles, words = study_single(c.at(100.0)), needed([100.0, 50.0, 200.0, 400.0])
    at_100 = [r for r in rows if r["rate_hz"] == 100.0]
    console = Console(width=120)
    show(at_100, singles, words, console)
    for variable in ("quaternion", "poisson", "euler") if not options.quick else ():
        own = [(r["rate_hz"], r["walk"], r["drift"]) for r in rows if r["variable"] == variable and r["bits"] == 24]
        text = ", ".join(f"{f:g} Hz {w:.2g} deg/√h and {d:.2g} deg/h" for f, w, d in sorted(own))
        console.print(f"{ALGORITHMS[variable]} of 24 bits, rounded and cut off: {text}.", soft_wrap=True)
    console.print(
        "Rounding of the position below 36 bits: the changes from step to step are too even for independent errors, so "
        "that the errors are between the random walk and those of cutting off.",
        soft_wrap=True,
    )
    lsb = lsb_of(INCREMENTS, 16, 100.0)
    slow = c.at(100.0)
    d = difference(with_words(slow, INCREMENTS, lsb, False, carried=True), run(slow, "quaternion", (0.0, 0.0, 0.0)))
    console.print(
        f"Increments of 16 bits whose remainder is carried to the next step: attitude error "
        f"{float(np.cumsum(d.turn, axis=0).std()) / ARCSEC:.3g} arcsec rms at any time, δ/√12 is "
        f"{lsb / math.sqrt(12.0) / ARCSEC:.3g}.",
        soft_wrap=True,
    )
    for name, table in (("errors", rows), ("single_precision", singles), ("words", words)):
        with (folder / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(table[0]))
            writer.writeheader()
            writer.writerows(table)
    figure = figure_of(charts_of(at_100, {w["grade"]: w["sensors_m"] for w in words}))
    for suffix in ("svg", "png"):
        save(figure, folder / f"word_length.{suffix}")
    console.print(f"Figure and tables (CSV) are in {folder}.", soft_wrap=True)


if __name__ == "__main__":
    main()
