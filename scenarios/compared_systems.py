"""Two and three whole navigation systems compared with each other, of which one has a fault.

Run it from anywhere:  python scenarios/compared_systems.py [SCENARIO] [-o DIR] [--teams N] [--false-alarm P]

The systems of a team fly the same motion with independent errors: runs of an ensemble of the scenario without its
faults. The first system of a team also flies with the faults. At every epoch, the horizontal positions and the
horizontal velocities of the systems are compared; the thresholds follow from the covariance budget of the scenario
without faults and from the probability of false alarm. It writes summary.json, summary.md, report.html, a figure (SVG
and PNG) and recording.rrd:
  1. the rate of false alarms of teams without a fault against the stated probability;
  2. the time until two systems detect the fault, and three identify the system, against the prediction;
  3. the position of three systems by the mid-value, by the mean, and without the identified system.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sinssim
from sinssim.charts import Axis, Chart, Charts, Line
from sinssim.exhibits import Column, Exhibits, Sentence, Table
from sinssim.recording import style
from sinssim.recording.figures import figure_of, save
from sinssim.recording.page import page_of
from sinssim.recording.rerun_exhibits import markdown, record
from sinssim.scenario import Scenario
from sinssim.statistics.chi_square import ComparedSystems, compare_systems, detection_probability, mid_value
from sinssim.system.files import write_text
from sinssim.units import fixed

Array = NDArray[np.float64]

LINES = ("effect", "threshold", "sigma")
QUANTITIES = {"position": (slice(0, 2), "m"), "velocity": (slice(3, 5), "m/s")}
SCENARIO = Path(__file__).with_suffix(".toml")


@dataclass(frozen=True)
class Flown:
    """Errors of all systems.

    Attributes:
        time: epochs since the start, (E,) s.
        sound: position and velocity errors of teams of three sound systems, (T, 3, E, 6).
        faulty: of the first systems with the fault, (T, E, 6).
        covariance: of one sound system by the budget, (E, 6, 6).
        onset: time of the first fault since the start, s.
    """

    time: Array
    sound: Array
    faulty: Array
    covariance: Array
    onset: float

    def teams(self, systems: int, *, fault: bool, part: slice) -> Array:
        """Return a quantity of teams of so many systems, (T, n, E, 2)."""
        found = self.sound[:, :systems].copy()
        if fault:
            found[:, 0] = self.faulty
        return np.asarray(found[..., part])


def fly(scenario: Scenario, teams: int) -> Flown:
    """Run both ensembles and the budget; a run with the fault has the seed of the first system of its team."""
    sound = scenario.model_copy(update={"imu": scenario.imu.model_copy(update={"faults": ()})})
    several, one = sinssim.ensemble(sound, runs=3 * teams), sinssim.ensemble(scenario, runs=teams)
    if several.failures or one.failures:
        raise SystemExit(f"{len(several.failures) + len(one.failures)} runs failed; try `sinssim ensemble`.")
    errors = [np.concatenate((e.errors.position_ned, e.errors.velocity_ned), axis=2) for e in (several, one)]
    budget = sinssim.budget(sound, times=several.elapsed.tolist())
    rows = [budget.row(float(t)) for t in several.elapsed]
    starts = [fault.at_s if fault.type == "spike" else fault.from_s for fault in scenario.imu.faults]
    together = errors[0].reshape(3, teams, *errors[0].shape[1:]).swapaxes(0, 1)  # run i is system i // teams
    return Flown(several.elapsed, together, errors[1], budget.total[rows][:, :6, :6], min(starts))


def first(time: Array, flags: NDArray[np.bool_]) -> Array:
    """Return the time of the first flag of each team, infinite without one."""
    return np.where(flags.any(axis=1), time[flags.argmax(axis=1)], np.inf)


def compared(flown: Flown, quantity: str, false_alarm: float) -> dict[str, Any]:
    """Return the numbers of one quantity."""
    part, _ = QUANTITIES[quantity]
    covariance = flown.covariance[:, part, part]

    def tested(systems: int, *, fault: bool) -> ComparedSystems:
        return compare_systems(flown.teams(systems, fault=fault, part=part), covariance, false_alarm)

    sound, two, three = tested(3, fault=False), tested(2, fault=True), tested(3, fault=True)
    after = flown.time > flown.onset
    # the mean over the first systems: the effect of the fault is the same in every run, to first order
    effect = np.mean(flown.faulty - flown.sound[:, 0], axis=0)[:, part]
    predicted = detection_probability(effect, covariance, false_alarm)
    rates = sound.alarms[:, :, 1:].mean(axis=(1, 2))
    identified = np.where(after, three.identified, -1)
    found, wrong = first(flown.time, identified == 0), first(flown.time, identified > 0)
    return {
        "false_alarm_probability": false_alarm,
        "false_alarm_rate": float(rates.mean()),
        "false_alarm_rate_standard_error": float(rates.std() / np.sqrt(len(rates))),
        "teams_with_a_false_alarm": float(sound.detected.any(axis=1).mean()),
        "predicted_detection_s": _at(flown.time, predicted, 0.5) - flown.onset,
        "predicted_detection_95_s": _at(flown.time, predicted, 0.95) - flown.onset,
        "detection_s": float(np.median(first(flown.time, two.detected & after))) - flown.onset,
        "detection_95_s": float(np.quantile(first(flown.time, two.detected & after), 0.95, method="higher"))
        - flown.onset,
        "identification_s": float(np.median(found)) - flown.onset,
        "identified_at_end": float(np.mean(identified[:, -1] == 0)),
        "wrong_system_first": float(np.mean(wrong < found)),
        "curves": {
            "effect": np.linalg.norm(effect, axis=1).tolist(),
            "sigma_of_difference": np.sqrt(2.0 * np.linalg.eigvalsh(covariance)[:, -1]).tolist(),
            "threshold": np.sqrt(2.0 * np.linalg.eigvalsh(covariance)[:, -1] * two.threshold).tolist(),
            "predicted": predicted.tolist(),
            "detected": two.detected.mean(axis=0).tolist(),
            "identified": (identified == 0).mean(axis=0).tolist(),
        },
    }


def _at(time: Array, probability: Array, level: float) -> float:
    """Return the first time at which a probability reaches a level, infinite if it never does."""
    reached = probability >= level
    return float(time[reached.argmax()]) if reached.any() else float("inf")


def outputs(flown: Flown, false_alarm: float) -> dict[str, float]:
    """Return the 95 % horizontal position error at the end by each way to combine three systems."""
    part = QUANTITIES["position"][0]
    faulty = flown.teams(3, fault=True, part=part)
    identified = compare_systems(faulty, flown.covariance[:, part, part], false_alarm).identified[:, -1]
    use = identified[:, None] != np.arange(3)
    without = np.sum(faulty[:, :, -1] * use[..., None], axis=1) / use.sum(axis=1)[:, None]
    ways = {
        "one sound system": flown.sound[:, 0, -1, part],
        "the faulty system": faulty[:, 0, -1],
        "mean of three": faulty[:, :, -1].mean(axis=1),
        "mid-value of three": mid_value(faulty)[:, -1],
        "mean without the identified system": without,
    }
    return {name: float(np.quantile(np.linalg.norm(error, axis=1), 0.95)) for name, error in ways.items()}


def charts(flown: Flown, found: dict[str, dict[str, Any]]) -> Charts:
    """Return the growth of the difference, and the share of teams that detect and identify the fault."""
    effect, threshold, sigma = style.colors(LINES)
    rows = []
    for name, (_, unit) in QUANTITIES.items():
        curves = {key: np.asarray(values) for key, values in found[name]["curves"].items()}
        differences = (("by the fault", "effect", effect, "line"), ("threshold", "threshold", threshold, "line"),
                       ("1σ of sound systems", "sigma_of_difference", sigma, "line"))  # fmt: skip
        shares = (("predicted for two", "predicted", style.SOFT, "thin"), ("two detect", "detected", effect, "line"),
                  ("three identify", "identified", threshold, "line"))  # fmt: skip
        rows.append(tuple(
            Chart(key=f"{name}/{kind}", title=title, y=Axis(units=fixed(of)), marks=tuple(
                Line(label=label, x=flown.time, y=curves[key], color=color, weight=weight)  # type: ignore[arg-type]
                for label, key, color, weight in lines
            ))
            for kind, title, of, lines in (("difference", f"Difference of {name}", unit, differences),
                                           ("share", "Share of teams", "", shares))
        ))  # fmt: skip
    return Charts("systems", tuple(rows), (10.5, 7.0))


ROWS = (
    ("stated probability of false alarm of a test", "false_alarm_probability", ".2g", 1.0),
    ("measured rate, sound systems", "false_alarm_rate", ".2g", 1.0),
    ("standard error of the rate", "false_alarm_rate_standard_error", ".1g", 1.0),
    ("teams of three with a false alarm during the run, %", "teams_with_a_false_alarm", ".1f", 100.0),
    ("two detect: predicted time after the fault, min", "predicted_detection_s", ".1f", 1.0 / 60.0),
    ("two detect: median time, min", "detection_s", ".1f", 1.0 / 60.0),
    ("two detect: predicted for 95 %, min", "predicted_detection_95_s", ".1f", 1.0 / 60.0),
    ("two detect: 95 % of teams, min", "detection_95_s", ".1f", 1.0 / 60.0),
    ("three identify: median time, min", "identification_s", ".1f", 1.0 / 60.0),
    ("three identify the faulty system at the end, %", "identified_at_end", ".1f", 100.0),
    ("another system was identified before, %", "wrong_system_first", ".1f", 100.0),
)


def exhibits_of(
    title: str, lead: str, flown: Flown, found: dict[str, dict[str, Any]], r95: dict[str, float]
) -> Exhibits:
    """Return what the study has to show."""
    tests = [
        (label, *(format(factor * found[quantity][key], digits) for quantity in QUANTITIES))
        for label, key, digits, factor in ROWS
    ]
    ends = [(name, f"{value:.0f}") for name, value in r95.items()]
    items = [
        Sentence(lead, "lead"),
        charts(flown, found),
        Table((Column("", words=True), *map(Column, QUANTITIES)), tests),
        Table((Column("horizontal position at the end", words=True), Column("95 % of teams, m")), ends),
    ]
    span = (float(flown.time[0]), float(flown.time[-1]))
    return Exhibits(title, items, name="compared_systems", root="systems", span=span)


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("scenario", nargs="?", default=str(SCENARIO), help="scenario with [[imu.faults]]")
    parser.add_argument("-o", "--out", type=Path, default=Path("runs/compared_systems"), help="folder to write")
    parser.add_argument("--teams", type=int, default=200, help="number of teams")
    parser.add_argument("--false-alarm", type=float, default=0.01, help="probability of false alarm of a test")
    options = parser.parse_args()
    folder: Path = options.out
    try:
        scenario = sinssim.load_scenario(options.scenario)
        if not scenario.imu.faults:
            parser.error(f"{options.scenario} has no [[imu.faults]]: add the fault of one system.")
        if options.teams < 2:
            parser.error(f"--teams {options.teams}: give at least 2.")
        flown = fly(scenario, options.teams)
        found = {quantity: compared(flown, quantity, options.false_alarm) for quantity in QUANTITIES}
        r95 = outputs(flown, options.false_alarm)
    except sinssim.SinssimError as error:
        raise SystemExit(f"compared_systems: {error}") from error
    title, lead = f"Compared systems: {scenario.name}", f"{scenario.description}. {options.teams} teams."
    exhibits = exhibits_of(title, lead, flown, found, r95)
    text = markdown(exhibits)
    folder.mkdir(parents=True, exist_ok=True)
    figure = figure_of(exhibits.chosen("systems"))
    for suffix in (".svg", ".png"):
        save(figure, folder / f"compared_systems{suffix}")
    summary = {"scenario": scenario.name, "teams": options.teams, "time_s": flown.time.tolist(), **found,
               "r95_at_end_m": r95}  # fmt: skip
    write_text(folder / "summary.json", json.dumps(summary, indent=2))
    write_text(folder / "summary.md", text)
    write_text(folder / "report.html", page_of(exhibits))
    record(exhibits, folder / "recording.rrd")
    print(text)
    print(f"Report, figure and recording are in {folder}. View: sinssim view {folder}")


if __name__ == "__main__":
    main()
