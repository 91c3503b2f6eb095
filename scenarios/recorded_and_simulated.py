"""A recorded drive and its simulated twin: the same motion, filter and outages, and a unit of the same noise.

Run it from anywhere:  python scenarios/recorded_and_simulated.py [LOG.toml] [-o DIR] [--imu FILE] [--runs N]

  1. The noise of the unit in motion, by `sinssim.tune`. With --imu FILE the table [imu] of that file is taken, for
     example one that `sinssim allan LOG.toml --from … --to … --imu` printed, and only σ of the fixes are tuned.
  2. The smoothed solution of the log becomes the true motion ([track]) of a simulated run, with this noise, with fixes
     of the same σ and rate, and with the same initial errors.
  3. Both are run without satellites for 15 s every 45 s, in three phases; the simulated one with N seeds.

It writes recorded.toml, simulated.toml (to run, view and change), their runs, summary.json, summary.md, and a picture:
outages, innovations, and the Allan deviations of the readings' errors.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from support.twin_figure import twin_charts

import sinssim
from sinssim import rotation
from sinssim.analyses.allan_deviation import AllanDeviation, allan_deviation
from sinssim.data import ImuData
from sinssim.recording.figures import figure_of, save
from sinssim.scenario import Scenario
from sinssim.simulation.recorded_filter_run import Prepared, prepare
from sinssim.toml_mistakes import read_toml
from sinssim.units import ARCMIN, DEG_H, UG

Array = NDArray[np.float64]
Outages = list[list[float]]

LOG = Path(__file__).resolve().parent.parent / "tests" / "data" / "drive" / "drive.toml"
FACTORS = {"gnss-position": "log.gnss.sigma_factor", "gnss-velocity": "log.gnss.velocity_sigma_factor"}
"""Keys of the fixes' σ by the kind of the readings."""
BLOCK_KEYS = ("mounting_deg", "lever_arm_m", "rate_hz")
"""Keys of [imu] that describe the installation: they are the log's, also beside another table."""


@dataclass
class Side:
    """What is compared of the recorded or of the simulated side.

    Attributes:
        growth: for every outage the time since its beginning, s, and the horizontal error, m.
        sigma: 1σ of the horizontal position at the ends, m.
        innovations: by sensor, of the run without outages, divided by their 1σ, (M, 3).
        innovation_rms: by sensor, north, east, down, in m or m/s.
        deviations: Allan deviations of the readings' errors: three gyros, then three accelerometers.
    """

    growth: list[tuple[Array, Array]] = field(default_factory=list)
    sigma: list[float] = field(default_factory=list)
    innovations: dict[str, Array] = field(default_factory=dict)
    innovation_rms: dict[str, list[float]] = field(default_factory=dict)
    deviations: list[AllanDeviation] = field(default_factory=list)

    @property
    def at_end(self) -> Array:
        """Horizontal errors at the ends of the outages, m."""
        return np.array([errors[-1] for _, errors in self.growth])

    def add_outages(self, run: Any, outages: Outages) -> None:
        """Add the outages of a run."""
        error, estimate = run.aided.error, run.aided.estimate
        for begin, end in outages:
            rows = (error.time >= begin - 1e-6) & (error.time <= end + 1e-6) & np.isfinite(error.horizontal)
            self.growth.append((error.time[rows] - begin, error.horizontal[rows]))
            last = int(np.searchsorted(estimate.time, end + 1e-6)) - 1
            self.sigma.append(float(np.hypot(*estimate.sigma[last, :2])))

    def add_innovations(self, run: Any, settled: float) -> None:
        """Add the accepted innovations of a run."""
        for one in run.aided.estimate.innovations:
            rows = np.flatnonzero(one.accepted & (one.time > settled))
            self.innovations[one.sensor] = one.value[rows] / one.sigma_at(rows)
            self.innovation_rms[one.sensor] = np.sqrt(np.mean(one.value[rows] ** 2, axis=0)).tolist()

    def numbers(self) -> dict[str, Any]:
        """Return the numbers that are compared."""
        return {
            "outages": len(self.growth),
            "median_m": float(np.median(self.at_end)),
            "p90_m": float(np.percentile(self.at_end, 90.0)),
            "sigma_rms_m": float(np.sqrt(np.mean(np.square(self.sigma)))),
            "innovation_rms": self.innovation_rms,
            "innovation_over_sigma": {name: float(np.sqrt(np.mean(v**2))) for name, v in self.innovations.items()},
        }


def regular_outages(start: float, end: float, length: float, every: float, first: float) -> list[Outages]:
    """Return the outages of three phases, a third of a period apart."""
    phases = []
    for k in range(3):
        begins = np.arange(first + k * every / 3.0, end - length, every)
        phases.append([[round(float(b), 3), round(float(b) + length, 3)] for b in begins if b > start])
    return phases


def with_tables(scenario: Scenario, **tables: Any) -> Scenario:
    """Return a scenario with some tables replaced."""
    contents = scenario.contents()
    contents.update(tables)
    return Scenario.model_validate(contents)


def block_of(file: Path, scenario: Scenario) -> Scenario:
    """Return a scenario with the table [imu] of a file."""
    table = read_toml(file)[1]["imu"]
    own = scenario.imu.model_dump(exclude_none=True, exclude_unset=True)
    installed = {key: own[key] for key in BLOCK_KEYS if key in own}
    table.pop("rate_hz", None)
    return with_tables(scenario, imu={**table, **installed})


def simulated_scenario(recorded: Any, folder: Path, seed: int) -> Scenario:
    """Return the simulated twin of a recorded run, whose streams are in a folder."""
    prepared: Prepared = recorded.truth.prepared
    contents = prepared.scenario.contents(without=("log", "aiding", "seed"))
    truth = recorded.aided.estimate.smoothed.solution
    gnss = prepared.scenario.log.gnss
    sigma = {one.measurements.kind: one.measurements.sigma for one in prepared.log.sensed}
    level = {kind: np.sqrt(np.mean(value**2, axis=0)) for kind, value in sigma.items()}
    at = {one.measurements.kind: one.time for one in prepared.log.sensed}["gnss-position"]
    receiver: dict[str, Any] = {
        "rate_hz": float(f"{1.0 / np.median(np.diff(at)):.4g}"),
        "position_sigma_m": float(f"{np.sqrt(np.mean(level['gnss-position'][:2] ** 2)):.4g}"),
        "height_sigma_m": float(f"{level['gnss-position'][2]:.4g}"),
        "lever_arm_m": list(gnss.lever_arm_m),
        "velocity": "gnss-velocity" in level,
    }
    if "gnss-velocity" in level:
        receiver["velocity_sigma_mps"] = float(f"{np.sqrt(np.mean(level['gnss-velocity'] ** 2)):.4g}")
    contents.update(
        name=f"{prepared.scenario.name}_simulated",
        description=f"Simulated twin of the recorded drive {prepared.scenario.name}",
        seed=seed,
        track={"file": str(folder / "streams" / "nav_smoothed.parquet")},
        aiding={"gnss": receiver},
    )
    contents["imu"]["rate_hz"] = float(round(prepared.scenario.imu.rate_hz))
    for key in ("mounting_deg", "lever_arm_m"):
        contents["imu"].pop(key, None)  # the smoothed solution is that of the block itself
    contents["navigation"]["initial_error"] = initial_error(prepared, truth)
    contents["filter"].pop("vibration_noise", None)  # the emulated unit does not shake
    return Scenario.model_validate(contents)


def initial_error(prepared: Prepared, truth: Any) -> dict[str, float]:
    """Return the error that navigation on the log starts with: its start minus the smoothed solution."""
    start = prepared.start.state
    found = np.array(rotation.euler_from_quaternion(start.q_nb))
    true = np.array(rotation.euler_from_quaternion(truth.q_nb[0]))
    turn = (found - true + np.pi) % (2.0 * np.pi) - np.pi
    velocity = start.velocity_ned - truth.velocity_ned[0]
    keys = ("roll_arcmin", "pitch_arcmin", "heading_arcmin")
    error = {key: float(value / ARCMIN) for key, value in zip(keys, turn, strict=True)}
    for axis, value in zip(("north", "east", "down"), velocity, strict=True):
        error[f"velocity_{axis}_mps"] = float(value)
    error["height_m"] = float(start.height - truth.height[0])
    return {key: float(f"{value:.4g}") for key, value in error.items()}


def deviations(readings: ImuData, ideal: ImuData) -> list[AllanDeviation]:
    """Return Allan deviations of readings less those of an ideal unit on the same motion."""
    step = float(np.diff(ideal.time).mean())
    found = []
    for own, true in ((readings.dtheta, ideal.dtheta), (readings.dvel, ideal.dvel)):
        for axis in range(3):
            sums = np.concatenate([[0.0], np.cumsum(own[:, axis])])  # stamps of the log jitter: interpolate the sums
            at = np.interp(ideal.time, readings.time, sums)
            found.append(allan_deviation(np.diff(at) - true[:, axis], step))
    return found


def words(values: dict[str, float], sides: dict[str, Side]) -> str:
    """Return the tables of the summary."""
    lines = ["| noise of the unit in motion | |", "|---|---|", *(f"| {k} | {v:.4g} |" for k, v in values.items()), ""]
    numbers = {name: side.numbers() for name, side in sides.items()}
    lines += ["| | " + " | ".join(numbers) + " | ratio |", "|---" * (len(numbers) + 2) + "|"]
    rows = {
        "outages": "outages",
        "median_m": "horizontal error at the end, median [m]",
        "p90_m": "horizontal error at the end, 90 % [m]",
        "sigma_rms_m": "its 1σ by the filter, rms [m]",
    }
    for key, text in rows.items():
        own = [one[key] for one in numbers.values()]
        lines.append(f"| {text} | " + " | ".join(f"{v:.3g}" for v in own) + f" | {own[1] / own[0]:.2f} |")
    for sensor in numbers["recorded"]["innovation_rms"]:
        own = [float(np.sqrt(np.mean(np.square(one["innovation_rms"][sensor])))) for one in numbers.values()]
        cells = " | ".join(f"{v:.3g}" for v in own)
        unit = "m/s" if "velocity" in sensor else "m"
        lines.append(f"| innovations of {sensor}, rms per axis [{unit}] | {cells} | {own[1] / own[0]:.2f} |")
    lines += ["", "| error of the inertial data, Allan deviation | recorded | simulated |", "|---|---|---|"]
    for tau in (0.1, 1.0, 10.0):
        for part, unit, size in ((slice(0, 3), "deg/h", DEG_H), (slice(3, 6), "µg", UG)):
            own = []
            for side in sides.values():
                at = [float(np.interp(np.log(tau), np.log(d.tau), d.deviation)) for d in side.deviations[part]]
                own.append(float(np.sqrt(np.mean(np.square(at)))) / size)
            name = "gyros" if unit == "deg/h" else "accelerometers"
            lines.append(f"| {name}, {tau:g} s [{unit}] | {own[0]:.4g} | {own[1]:.4g} |")
    return "\n".join(lines) + "\n"


def study(options: argparse.Namespace) -> dict[str, Any]:
    """Tune the noise, run both sides, write everything, and return the summary."""
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)
    scenario = sinssim.load_scenario(options.log)
    if options.imu is not None:
        scenario = block_of(options.imu, scenario)
    file, values = out / "recorded.toml", {}
    file.write_text(scenario.to_toml(), encoding="utf-8")
    settings = ["filter.smooth=true"]
    if not options.as_told:
        kinds = {one.measurements.kind for one in prepare(scenario).log.sensed}
        of_fixes = [key for kind, key in FACTORS.items() if kind in kinds]
        tuned = sinssim.tune(file, keys=() if options.imu is None else of_fixes, held_out=0.0)
        values = {key.key: key.value for key in tuned.keys if not key.refused}
        settings += tuned.lines
    scenario = sinssim.load_scenario(file, settings)
    file.write_text(scenario.to_toml(), encoding="utf-8")
    recorded = sinssim.run(scenario, out / "recorded", overwrite=True)
    twin = simulated_scenario(recorded, (out / "recorded").resolve(), 1)
    (out / "simulated.toml").write_text(twin.to_toml(), encoding="utf-8")
    simulated = sinssim.run(twin, out / "simulated", overwrite=True)
    start, end = float(recorded.truth.time[0]), float(recorded.truth.time[-1])
    phases = regular_outages(start, end, options.length_s, options.every_s, options.first_s)
    sides = {"recorded": Side(), "simulated": Side()}
    for outages in phases:
        if not outages:
            continue
        log = scenario.contents()["log"] | {"outages": {"at_s": outages}}
        one = with_tables(scenario, log=log, filter=scenario.contents()["filter"] | {"smooth": False})
        sides["recorded"].add_outages(sinssim.run(one), outages)
        for seed in range(1, options.runs + 1):
            contents = twin.contents()
            contents["seed"] = seed
            contents["aiding"]["gnss"]["outages_s"] = outages
            contents["filter"]["smooth"] = False
            sides["simulated"].add_outages(sinssim.run(Scenario.model_validate(contents)), outages)
    ideal = simulated.truth.ideal
    for name, run in (("recorded", recorded), ("simulated", simulated)):
        sides[name].add_innovations(run, 20.0)
        sides[name].deviations = deviations(run.sensed.measured, ideal)
    summary = {
        "log": str(options.log),
        "tuned": values,
        "outage_s": options.length_s,
        **{name: side.numbers() for name, side in sides.items()},
    }
    text = words(values, sides)
    (out / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    (out / "summary.md").write_text(text, encoding="utf-8")
    figure = figure_of(twin_charts(sides, options.length_s))
    for suffix in ("svg", "png"):
        save(figure, out / f"recorded_and_simulated.{suffix}")
    print(f"\n{text}\nEverything is in {out}")
    return summary


def main() -> None:
    """Read the options and run the study."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path, nargs="?", default=LOG, help="a scenario with [log]")
    parser.add_argument("-o", "--out", type=Path, default=Path("runs/recorded_and_simulated"), help="folder to write")
    parser.add_argument("--imu", type=Path, help="a file with the table [imu] to be taken")
    parser.add_argument("--as-told", action="store_true", help="search for nothing: the noise is that of the scenario")
    parser.add_argument("--runs", type=int, default=4, help="simulated runs")
    parser.add_argument("--length-s", type=float, default=15.0, help="length of the outages")
    parser.add_argument("--every-s", type=float, default=45.0, help="their period")
    parser.add_argument("--first-s", type=float, default=30.0, help="begin of the first")
    study(parser.parse_args())


if __name__ == "__main__":
    main()
