"""The ground study: accuracy of alignment of a parked laser-gyro SINS, checked by random draws and emulated sessions.

Run it from anywhere:  python scenarios/ground_study.py [-o DIR] [--draws N] [--runs N]

It writes figures (SVG and PNG), summary.json, summary.md and recording.rrd:
  1. draws of all twelve instrument errors through eq. (1) against the first-order theory, eqs. (7)-(26);
  2. the range of validity of the theory: large errors, near the poles, near a vertical attitude;
  3. end to end: parked truth, emulated sensors, session, determination, against the same theory;
  4. the disturbed base: gravity's cone in inertial space, compared with eq. (1) on the same data;
  5. session lengths and best orientations.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from support import ground_figures as figures
from support.ground_recording import record_ground_study
from support.second_order import second_order
from support.swaying import Sway, Swaying

from sinssim import rotation
from sinssim.alignment import (
    AVERAGED,
    SOURCES,
    Angles,
    Attitude,
    Determination,
    InstrumentErrors,
    align_disturbed,
    best_headings,
    bias_takes_over,
    determine,
    error_budget,
    error_statistics,
    errors,
    expected_errors,
    ideal_readings,
    mean_readings,
    total,
)
from sinssim.alignment.determination import solve
from sinssim.data import ImuData
from sinssim.recording.figures import save
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.truth.motions.parked_and_great_circle import Parked
from sinssim.units import ARCMIN, DEG, DEG_H, UG

Array = NDArray[np.float64]

LATITUDE = 50.0 * DEG
DURATION = 300.0
GRADES = ("laser-navigation", "laser-standard", "tactical")
CASES = {  # heading, roll, pitch, latitude in degrees
    "level, 50°": (40.0, 0.0, 0.0, 50.0),
    "tilted, 35° south": (217.0, 12.0, -8.0, -35.0),
    "on a slope, 68°": (75.0, -20.0, 30.0, 68.0),
    "on the equator": (120.0, 2.0, 1.0, 0.0),
    "far north, 85°": (10.0, 1.0, -1.0, 85.0),
    "near the pole, 89.9°": (10.0, 1.0, -1.0, 89.9),
    "steep, pitch 89.9°": (40.0, 10.0, 89.9, 50.0),
}


def wrapped(angle: Array) -> Array:
    """Return angles in [-π, π)."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def drawn_errors(
    attitude: Attitude, latitude: float, sigmas: InstrumentErrors, draws: int, rng: np.random.Generator
) -> Array:
    """Return errors of eq. (1) for draws of all twelve instrument errors, (4, draws) rad."""
    drawn = InstrumentErrors(*(np.asarray(sigma) * rng.standard_normal((draws, 3)) for sigma in vars(sigmas).values()))
    found, _, _ = solve(*drawn.apply(*ideal_readings(*attitude, latitude)))
    truth = (*attitude, latitude)
    return np.stack([wrapped(value - np.asarray(true)) for value, true in zip(found, truth, strict=True)])


def monte_carlo(draws: int, rng: np.random.Generator) -> list[dict[str, Any]]:
    """Compare means and standard deviations of draws with the theory, in standard errors of the draws."""
    rows = []
    for grade in GRADES:
        sigmas = expected_errors(Imu(grade=grade)).instrument_sigmas
        for name, degrees in CASES.items():
            heading, roll, pitch, latitude = np.radians(degrees)
            attitude = Attitude(heading, roll, pitch)
            deltas = drawn_errors(attitude, latitude, sigmas, draws, rng)
            sigma = np.array(error_statistics(attitude, latitude, None, sigmas).sigma)
            mean_score = deltas.mean(axis=1) / (sigma / np.sqrt(draws))
            sigma_score = (deltas.std(axis=1) / sigma - 1.0) * np.sqrt(2.0 * draws)
            rows.append(
                {
                    "grade": grade,
                    "case": name,
                    "linear": bool(second_order(attitude, latitude, sigmas).linear(draws)),
                    "sigma_arcmin": dict(zip(Angles._fields, (sigma / ARCMIN).tolist(), strict=True)),
                    "largest_score": float(max(np.abs(mean_score).max(), np.abs(sigma_score).max())),
                    "mean_scores": mean_score.tolist(),
                    "sigma_scores": sigma_score.tolist(),
                }
            )
    return rows


Case = tuple[Attitude, ArrayLike, InstrumentErrors]


def departures(attitude: Attitude, latitude: ArrayLike, sigmas: InstrumentErrors, white: list[Array]) -> Array:
    """Return the relative difference between σ of eq. (1) and σ of the first order for the same draws, (4,)."""
    drawn = InstrumentErrors(
        *(np.asarray(sigma) * rows for sigma, rows in zip(vars(sigmas).values(), white, strict=True))
    )
    found, _, _ = solve(*drawn.apply(*ideal_readings(*attitude, latitude)))
    truth = (*attitude, latitude)
    full = [wrapped(value - np.asarray(true)).std() for value, true in zip(found, truth, strict=True)]
    first = [value.std() for value in errors(attitude, latitude, drawn)]
    return np.asarray(np.array(full) / np.array(first) - 1.0)


def validity(draws: int, rng: np.random.Generator, folder: Path) -> dict[str, Any]:
    """Map the deviation of draws from the theory over gyro bias and latitude, and over accelerometer bias and pitch."""
    white = [rng.standard_normal((draws, 3)) for _ in range(4)]
    away = np.geomspace(0.1, 90.0, 31)  # from the pole, or from the vertical attitude, degrees
    gyro_bias, accel_bias = np.geomspace(1e-3, 10.0, 33), np.geomspace(10.0, 1e5, 33)  # deg/h, µg
    result: dict[str, Any] = {"threshold": 0.02, "draws": draws}
    for name, biases, columns, label, axis in (
        ("latitude", gyro_bias, ("heading", "latitude"), "gyro bias σ [°/h]", "distance from the pole [°]"),
        (
            "pitch",
            accel_bias,
            ("roll", "pitch"),
            "accelerometer bias σ [µg]",
            "distance from the vertical attitude [°]",
        ),
    ):
        near = (90.0 - away) * DEG

        def case(theta: ArrayLike, bias: ArrayLike, of_latitude: bool = name == "latitude") -> Case:
            """Return attitude, latitude and standard deviations of one point, or of the whole map."""
            if of_latitude:
                return Attitude(0.7, 0.0, 0.0), theta, InstrumentErrors(np.asarray(bias) * DEG_H, 0.0, 50 * UG)
            return Attitude(0.7, 0.2, theta), LATITUDE, InstrumentErrors(0.01 * DEG_H, 0.0, np.asarray(bias) * UG)

        maps = {column: np.empty((len(away), len(biases))) for column in columns}
        for i, j in np.ndindex(len(away), len(biases)):
            by_angle = departures(*case(near[i], biases[j]), white)
            for column in columns:
                maps[column][i, j] = by_angle[Angles._fields.index(column)]
        linear = second_order(*case(near[:, None], biases[:, None].repeat(3, axis=1))).linear(1_000_000)
        figure = figures.validity_map(biases, away, maps, linear, result["threshold"], label, axis)
        write(figure, folder / f"validity_{name}")
        standard = int(np.argmin(np.abs(np.log(biases / (0.01 if name == "latitude" else 50.0)))))
        for column, values in maps.items():
            holds = away[np.abs(values[:, standard]) < result["threshold"]]
            result[f"{column}_within_2_percent_from_deg"] = float(holds.min())
        holds = away[linear[:, standard]]
        result[f"{name}_linear_to_a_million_draws_from_deg"] = float(holds.min()) if len(holds) else None
    return result


def determined(ideal: ImuData, section: Imu, runs: int) -> Determination:
    """Return the determinations of many emulated sessions, each with its own sensors."""
    readings = [mean_readings(emulate(ideal, section, seed)) for seed in range(runs)]
    return determine(np.array([gyro for gyro, _ in readings]), np.array([accel for _, accel in readings]))


def end_to_end(runs: int) -> list[dict[str, Any]]:
    """Parked truth, emulated sensors, session, determination: spread of the errors against the theory."""
    rows = []
    for grade, heading, roll, pitch in (
        ("laser-standard", 0.0, 0.0, 0.0),
        ("laser-standard", 1.2, 0.05, -0.1),
        ("laser-navigation", 1.2, 0.05, -0.1),
    ):
        truth = Parked(LATITUDE, 0.5, 0.0, rotation.quaternion_from_euler(roll, pitch, heading), DURATION)
        ideal, section = truth.increments(2.0), Imu(grade=grade)
        d = determined(ideal, section, runs)
        deltas = [wrapped(d.heading - heading), d.roll - roll, d.pitch - pitch, d.latitude - LATITUDE]
        budget = error_budget(Attitude(heading, roll, pitch), LATITUDE, expected_errors(section).sigma, DURATION)
        # The part that no session averages: the same draws without noise.
        silent = section.model_copy(update={"gyro_arw_deg_sqrt_h": 0.0, "accel_vrw_ug_sqrt_hz": 0.0})
        from_bias = wrapped(determined(ideal, silent, runs).heading - heading).std()
        steady = total(budget, tuple(source for source in SOURCES if source not in AVERAGED)).heading
        rows.append(
            {
                "grade": grade,
                "runs": runs,
                "sigma_found_arcmin": {n: float(e.std() / ARCMIN) for n, e in zip(Angles._fields, deltas, strict=True)},
                "sigma_theory_arcmin": {
                    n: float(s / ARCMIN) for n, s in zip(Angles._fields, total(budget), strict=True)
                },
                "heading_from_bias_found_arcmin": float(from_bias / ARCMIN),
                "heading_from_bias_theory_arcmin": float(steady / ARCMIN),
            }
        )
    return rows


def sways(rng: np.random.Generator) -> list[Sway]:
    """Draw a sway of ±0.5° about every axis and a heave of ±2 cm, four sinusoids each, at 0.1-1 Hz."""
    return [
        Sway(name, size / 4.0, float(frequency), float(phase))
        for name, size in (("roll", 0.5 * DEG), ("pitch", 0.5 * DEG), ("heading", 0.5 * DEG), ("down", 0.02))
        for frequency, phase in zip(np.exp(rng.uniform(np.log(0.1), 0.0, 4)), rng.uniform(0.0, 6.28, 4), strict=True)
    ]


def disturbed_base(runs: int, rng: np.random.Generator, folder: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Align on swaying bases, each with its own sways and sensors; return results and streams to record."""
    section = Imu(grade="laser-standard")
    sigma = expected_errors(section).sigma
    cone, means, latitudes = np.empty(runs), np.empty(runs), np.empty(runs)
    bases = max(1, runs // 10)
    alignment = None
    for base in range(bases):
        heading = float(rng.uniform(0.0, 2.0 * np.pi))
        truth = Swaying(LATITUDE, 0.5, 0.0, 0.02, 0.03, heading, DURATION, sways(rng))
        ideal = truth.increments(50.0)
        at_end = rotation.euler_from_quaternion(truth.state(DURATION).q_nb)[2]
        for run in range(base * runs // bases, (base + 1) * runs // bases):
            imu = emulate(ideal, section, run)
            alignment = align_disturbed(imu)
            d = alignment.determination
            cone[run], latitudes[run] = wrapped(d.heading - at_end), d.latitude - LATITUDE
            means[run] = wrapped(solve(*mean_readings(imu))[0].heading - heading)
    attitude = Attitude(0.0, 0.02, 0.03)
    quiet = total(error_budget(attitude, LATITUDE, sigma, DURATION))
    theory = total(error_budget(attitude, LATITUDE, sigma, DURATION, method="disturbed"))
    figure = figures.disturbed_comparison(
        float(quiet.heading), float(theory.heading), cone, means,
        f"laser-standard, 300 s, ±0.5° sway at 0.1-1 Hz, ±2 cm heave, {runs} runs",
    )  # fmt: skip
    write(figure, folder / "disturbed_base")
    assert alignment is not None
    rms = float(np.sqrt(np.mean(cone**2)))
    result = {
        "runs": runs,
        "heading_rms_arcmin": rms / ARCMIN,
        "heading_theory_arcmin": float(theory.heading) / ARCMIN,
        "quiet_base_theory_arcmin": float(quiet.heading) / ARCMIN,
        "ratio_to_quiet_base": rms / float(quiet.heading),
        "latitude_rms_arcmin": float(np.sqrt(np.mean(latitudes**2))) / ARCMIN,
        "latitude_theory_arcmin": float(theory.latitude) / ARCMIN,
        "eq_1_on_the_same_data_rms_deg": float(np.sqrt(np.mean(means**2))) / DEG,
    }
    streams = {
        "swaying_time": alignment.time,
        "swaying_velocity": alignment.residual_velocity,
        "heading_errors": {"cone": cone, "eq_1": means},
    }
    return result, streams


def orientations() -> list[dict[str, Any]]:
    """Tabulate best headings, and the two- and four-heading sets, for a total of ten minutes."""
    rows = []
    for grade in GRADES:
        sigma = expected_errors(Imu(grade=grade)).sigma
        for count in (1, 2, 4):
            for angle in ("heading", "latitude"):
                best = best_headings(count, LATITUDE, sigma, 600.0, angle=angle)
                rows.append(
                    {
                        "grade": grade,
                        "count": count,
                        "for": angle,
                        "headings_deg": (best.headings / DEG).round(1).tolist(),
                        "sigma_heading_arcmin": float(best.sigma.heading) / ARCMIN,
                        "sigma_latitude_arcmin": float(best.sigma.latitude) / ARCMIN,
                        "worst_arcmin": best.worst / ARCMIN,
                    }
                )
    return rows


def write(figure: Any, stem: Path) -> None:
    """Write a figure as SVG and PNG."""
    for suffix in (".svg", ".png"):
        save(figure, stem.with_suffix(suffix))


def general_figures(folder: Path) -> dict[str, Any]:
    """Draw the heading map, the budget and the session curves; return the data for the recording."""
    sigmas = {grade: expected_errors(Imu(grade=grade)).sigma for grade in GRADES}
    instruments = expected_errors(Imu(grade="laser-standard")).instrument_sigmas
    heading, latitude = np.linspace(0.0, 2.0 * np.pi, 361), np.radians(np.linspace(-85.0, 85.0, 171))
    sigma_map = error_statistics(Attitude(heading, 0.0, 0.0), latitude[:, None], None, instruments).sigma.heading
    write(
        figures.heading_map(heading, latitude, sigma_map, "laser-standard, level vehicle: biases and scale factors"),
        folder / "heading_map",
    )  # fmt: skip
    scale_only = InstrumentErrors(
        gyro_bias=np.array([0.002, 0.02, 0.01]) * DEG_H, gyro_scale=300e-6, accel_bias=50 * UG
    )
    uneven = error_statistics(Attitude(heading, 0.0, 0.0), latitude[:, None], None, scale_only).sigma.heading
    write(
        figures.heading_map(
            heading,
            latitude,
            uneven,
            "unequal gyros (0.002, 0.02 and 0.01 °/h, 300 ppm): σ of the heading",
        ),
        folder / "heading_map_unequal",
    )
    attitude = Attitude(40.0 * DEG, 0.02, 0.03)
    budget = error_budget(attitude, LATITUDE, sigmas["laser-standard"], DURATION)
    write(figures.budget_bars(budget, "laser-standard, latitude 50°, session of 300 s"), folder / "budget")
    write(
        figures.session_curves(attitude, LATITUDE, sigmas, "level vehicle, latitude 50°"),
        folder / "session_length",
    )
    time = np.geomspace(1.0, 3600.0, 400)
    curves = {grade: total(error_budget(attitude, LATITUDE, sigma, time)) for grade, sigma in sigmas.items()}
    return {"heading_map": sigma_map, "session_time": time, "session_sigma": curves, "budget": budget}


def tables(summary: dict[str, Any]) -> str:
    """Return the summary as Markdown."""
    lines = ["# Ground study", "", "## Draws through eq. (1) against the first-order theory", ""]
    lines += ["| grade | case | linear | σ heading, ′ | largest score |", "|---|---|---|---|---|"]
    for row in summary["monte_carlo"]:
        lines.append(
            f"| {row['grade']} | {row['case']} | {'yes' if row['linear'] else 'no'} | "
            f"{row['sigma_arcmin']['heading']:.3f} | {row['largest_score']:.1f} |"
        )
    lines += ["", "A score is the deviation of mean or σ in standard errors of the draws.", ""]
    lines += ["## End to end", "", "| grade | angle | observed σ, ′ | theoretical σ, ′ |", "|---|---|---|---|"]
    for row in summary["end_to_end"]:
        for name in Angles._fields:
            lines.append(
                f"| {row['grade']} | {name} | {row['sigma_found_arcmin'][name]:.3f} | "
                f"{row['sigma_theory_arcmin'][name]:.3f} |"
            )
        lines.append(
            f"| {row['grade']} | heading, without noise | {row['heading_from_bias_found_arcmin']:.3f} | "
            f"{row['heading_from_bias_theory_arcmin']:.3f} |"
        )
    lines += ["", "## Disturbed base", "", "| quantity | |", "|---|---|"]
    lines += [f"| {key.replace('_', ' ')} | {value:.4g} |" for key, value in summary["disturbed_base"].items()]
    lines += ["", "## Bias dominates from", "", "| grade | heading, s | latitude, s |", "|---|---|---|"]
    lines += [f"| {g} | {t['heading']:.0f} | {t['latitude']:.0f} |" for g, t in summary["bias_takes_over_s"].items()]
    lines += ["", "## Best orientations, ten minutes in total", ""]
    lines += [
        "| grade | positions | best for | first heading, ° | σ heading, ′ | σ latitude, ′ | largest σ, ′ |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in summary["orientations"]:
        lines.append(
            f"| {row['grade']} | {row['count']} | {row['for']} | {row['headings_deg'][0]:.1f} | "
            f"{row['sigma_heading_arcmin']:.3f} | {row['sigma_latitude_arcmin']:.3f} | {row['worst_arcmin']:.3f} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("-o", "--out", type=Path, default=Path("runs/ground_study"), help="folder to write")
    parser.add_argument("--draws", type=int, default=1_000_000, help="draws of the twelve errors per case")
    parser.add_argument("--runs", type=int, default=3000, help="emulated sessions per case")
    parser.add_argument("--swaying", type=int, default=200, help="emulated sessions on a disturbed base")
    options = parser.parse_args()
    folder: Path = options.out
    rng = np.random.default_rng(2024)
    streams = general_figures(folder)
    summary: dict[str, Any] = {
        "monte_carlo": monte_carlo(options.draws, rng),
        "validity": validity(max(500, options.draws // 100), rng, folder),
        "end_to_end": end_to_end(options.runs),
        "orientations": orientations(),
        "bias_takes_over_s": {
            grade: {
                name: float(value)
                for name, value in zip(
                    Angles._fields,
                    bias_takes_over(Attitude(0.7, 0.0, 0.0), LATITUDE, expected_errors(Imu(grade=grade)).sigma),
                    strict=True,
                )
            }
            for grade in GRADES
        },
    }
    summary["disturbed_base"], swaying = disturbed_base(options.swaying, rng, folder)
    text = tables(summary)
    for name, content in (("summary.json", json.dumps(summary, indent=2)), ("summary.md", text)):
        draft = folder / f".{name}.part"
        draft.write_text(content, encoding="utf-8")
        os.replace(draft, folder / name)
    record_ground_study(folder / "recording.rrd", **streams, **swaying, summary=text)
    print(text)
    print(f"Figures, summary and recording are in {folder}. View: sinssim view {folder}")


if __name__ == "__main__":
    main()
