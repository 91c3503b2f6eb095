"""IMUs that turn in the vehicle, a gimballed platform and [imu.rotation], beside the same sensors strapped down."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NotRequired, TypedDict

import numpy as np

from sinssim import units
from sinssim.charts import PAIR, Axis, Chart, Charts, Color, Line, Weight, over
from sinssim.data import Array, ImuData
from sinssim.exhibits import Beside, Column, Item, Section, Sentence, Table
from sinssim.experiments.run.run_result import Part, side_by_side
from sinssim.experiments.run.summary_types import ErrorNumbers, Number
from sinssim.recording.streams import Stream, error_stream, platform_stream, rotation_stream
from sinssim.sensors.imu.emulation import digital, emulate
from sinssim.sensors.imu.rotation_encoder import Encoders, encoders_of
from sinssim.sensors.imu.size_effect import rectified
from sinssim.sensors.sensor_set_readings import PlatformErrors, read, without_errors_of_turns
from sinssim.simulation.navigation_stage import Navigated, what_if
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.strapdown.attitude import PLATFORM
from sinssim.strapdown.gimballed_platform import PlatformSolution, inertial_forces
from sinssim.strapdown.navigation_error import NO_NUMBERS, NavError, error_numbers
from sinssim.strapdown.platform_theory import ACCELEROMETERS, GYROS, START, TORQUERS, ErrorsByCause, errors_by_cause
from sinssim.truth.true_gravity_disturbance import Disturbed
from sinssim.units import ANGLE_SCALE, DEG, LENGTH_SCALE, fixed, number_text

_TURNING = 10.0 * units.DEG / 60.0  # rate above which the vehicle is said to turn, rad/s
_LEAST = 1e-6
"""Largest error of a cause that is left out, m: rounding."""
_COLORS = {GYROS: "gyro bias", TORQUERS: "heading", ACCELEROMETERS: "accelerometer bias", START: "position"}
"""Colours of the causes."""
_NOT_LINEAR = 0.2
"""Share of the largest error by which the linear equations may differ from the simulation."""
_FREE = "strapdown, no rate-dependent errors"
"""Name of the strapdown solution whose gyros have no errors that depend on the sensed rate."""
_BODY = ("x, forward", "y, right", "z, down")
_AXES = {
    "level": ("north", "east", "down"),
    "inertial": ("north at the start", "east at the start", "down at the start"),
}
_STANDS = {
    "level": "It is level and points north",
    "wander": "It is level and does not rotate about the vertical relative to the Earth (wander azimuth)",
    "free-azimuth": "It is level and does not rotate about the vertical in inertial space (free azimuth)",
    "transverse": "It is level and points along the great circle of the route",
    "inertial": "It keeps the direction of north, east and down at the start in inertial space and is not torqued",
}


class StrapdownNumbers(TypedDict):
    """The first strapdown algorithm, and how far errors that act in turns only take it away."""

    algorithm: str
    without_errors_of_turns: ErrorNumbers
    final_distance_m: Number
    max_distance_m: Number


class PlatformNumbers(TypedDict):
    """A platform: its errors, rates, the causes of its position error, and the same sensors strapped down."""

    torquer_scale_ppm: list[float]
    pickoff_arcsec: list[float]
    max_commanded_rate_deg_h: float
    max_rate_of_the_vehicle_deg_s: float
    turned_deg: float
    final_horizontal_error_by_cause_m: dict[str, Number]
    largest_difference_from_error_equations_m: Number
    strapdown: NotRequired[StrapdownNumbers]


@dataclass(frozen=True)
class OnPlatform(Part[PlatformNumbers]):
    """The platform of a run whose navigator has a solution."""

    name, title, place, compares = "platform", "Platform and strapdown", "sensors", 2

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the run has a solution on a platform."""
        return run.sensed.errors is not None and run.sensed.errors.platform is not None and PLATFORM in run.solutions

    @property
    def solution(self) -> PlatformSolution:
        """The solution of the platform's navigator, with the platform itself."""
        solution = self.run.solutions[PLATFORM]
        assert isinstance(solution, PlatformSolution)
        return solution

    @property
    def true_increments(self) -> ImuData:
        """Ideal increments of the same sensors strapped down."""
        assert isinstance(self.run.truth, Truth)
        return self.run.truth.ideal

    @property
    def errors(self) -> NavError:
        """Errors of the solution."""
        return self.run.errors[PLATFORM]

    @property
    def strapdown(self) -> tuple[str, NavError] | None:
        """The first strapdown algorithm with a solution, and its errors; None without one."""
        return next(((name, error) for name, error in self.run.errors.items() if name != PLATFORM), None)

    @cached_property
    def without_errors_of_turns(self) -> NavError | None:
        """Errors of `strapdown` if its gyros had no errors that depend on the sensed rate.

        These are scale factor, misalignment and non-linearity, which a platform does not have. None without such a
        solution.
        """
        truth, true = self.run.truth, self.run.sensed.errors
        if self.strapdown is None:
            return None
        assert isinstance(truth, Truth)
        assert true is not None
        errors = without_errors_of_turns(true.imu)
        imu = emulate(rectified(truth.trajectory, truth.ideal, errors), errors, self.run.scenario.seed, rounded=True)
        return what_if(self.run, self.strapdown[0], imu)

    @cached_property
    def errors_by_cause(self) -> ErrorsByCause:
        """Position errors of the solution by cause, from the linear error equations."""
        truth, true = self.run.truth, self.run.sensed.errors
        assert isinstance(truth, Truth)
        assert true is not None
        assert true.platform is not None
        motion = truth.trajectory
        felt = motion.disturbance_ned(truth.time, truth.state) if isinstance(motion, Disturbed) else None
        forces = inertial_forces(truth.time, truth.state, motion.gravity, motion.ellipsoid, felt)
        return errors_by_cause(truth.state, forces, self.solution, true.platform, motion.ellipsoid)

    def numbers(self) -> PlatformNumbers:
        """Return the results of the platform, for `summary.json`."""
        true = self.run.sensed.errors
        assert true is not None
        assert true.platform is not None
        return platform_numbers(
            self.solution, true.platform, self.true_increments, self.strapdown, self.without_errors_of_turns,
            self.errors_by_cause, self.errors,
        )  # fmt: skip

    def streams(self) -> Iterator[Stream]:
        """Yield what the platform did, and the errors of gyros without errors of turns."""
        yield platform_stream(self.solution)
        if (error := self.without_errors_of_turns) is not None:
            yield error_stream("without_errors_of_turns", error.at, error.time)

    def brief(self, algorithms: Mapping[str, ErrorNumbers]) -> Iterator[Item]:
        """Yield the rates, and the errors of the same sensors on the platform and strapped down."""
        entry = self.entry
        most, turned = number_text(entry["max_commanded_rate_deg_h"], 3), entry["max_commanded_rate_deg_h"] > 0.0
        yield Sentence(
            f"The platform was {f'turned by its gyros at up to {most} deg/h' if turned else 'not turned in inertial '}"
            f"{'' if turned else 'space'}; in the strapdown system, they measured up to "
            f"{number_text(entry['max_rate_of_the_vehicle_deg_s'], 3)} deg/s, and "
            f"{number_text(entry['turned_deg'], 4)}° in turns."
        )
        beside = entry.get("strapdown")
        if beside is None or PLATFORM not in algorithms or beside["algorithm"] not in algorithms:
            return
        platform, other, without = (
            algorithms[PLATFORM],
            algorithms[beside["algorithm"]],
            beside["without_errors_of_turns"],
        )
        if any(n["final_horizontal_error_m"] is None for n in (platform, other, without)):
            return

        def both(errors: ErrorNumbers) -> str:
            end, most = (number_text(errors[f"{when}_horizontal_error_m"], 4) for when in ("final", "max"))
            return f"{end} m at the end, {most} m at most"

        yield Sentence(
            f"Horizontal error of the same sensors on the platform: {both(platform)}; strapdown "
            f"({beside['algorithm']}): {both(other)}."
        )
        yield Sentence(
            "Scale factor, misalignment and non-linearity of the gyros, which act on the sensed rate, changed the "
            f"strapdown solution by {number_text(beside['final_distance_m'], 4)} m at the end, "
            f"{number_text(beside['max_distance_m'], 4)} m at most; without them its error is {both(without)}."
        )

    def exhibits(self) -> Iterator[Item]:
        """Yield its errors beside those of the same sensors strapped down, rates, gimbal angles, and the causes."""
        frame, time = self.run.scenario.navigation.frame, self.run.time
        span = (float(time[0]), float(time[-1]))
        torqued = (
            "The scale-factor error of their torquers acts on the commanded rates. " if frame != "inertial" else ""
        )
        yield Sentence(
            f"Three gyros and three accelerometers on a gimballed platform. {_STANDS[frame]}. The gyros stabilise the "
            "platform and do not sense the rotation of the vehicle: their bias, random walk and g-sensitivity act "
            "about the axes of the platform, and their scale-factor error, misalignment and non-linearity have no "
            f"effect. {torqued}Roll, pitch and heading are gimbal angles. For comparison, the same sensors with the "
            "same errors are used in a strapdown system."
        )
        yield from self._side_by_side(span)
        yield from self._rates(span)
        title = "What each error contributes" if self._is_linear else ""
        yield Section(title, list(self._by_cause(span)))

    @property
    def _is_linear(self) -> bool:
        """Whether the linear error equations describe the simulation."""
        return self.errors_by_cause.apart(self.errors) <= _NOT_LINEAR * float(self.errors.horizontal.max())

    def _side_by_side(self, span: tuple[float, float]) -> Iterator[Item]:
        solutions: dict[str, tuple[NavError, Color, Weight]] = {PLATFORM: (self.errors, PLATFORM, "bold")}
        if self.strapdown is not None:
            solutions[f"strapdown ({self.strapdown[0]})"] = (self.strapdown[1], self.strapdown[0], "line")
        if self.without_errors_of_turns is not None:
            solutions[_FREE] = (self.without_errors_of_turns, "reference", "line")
        full = {_FREE: "strapdown, gyros without scale-factor error, misalignment and non-linearity"}
        yield Table(
            (Column("", words=True), Column("horizontal error, end", LENGTH_SCALE), Column("largest", LENGTH_SCALE),
             Column("attitude error, end", ANGLE_SCALE), Column("largest", ANGLE_SCALE)),
            [[full.get(name, name), float(e.horizontal[-1]), float(e.horizontal.max()), float(e.angle[-1]),
              float(e.angle.max())] for name, (e, *_) in solutions.items()],
        )  # fmt: skip
        yield side_by_side("platform", solutions, span)

    def _rates(self, span: tuple[float, float]) -> Iterator[Item]:
        """Yield what the gyros sense strapped down, what the platform is commanded, and the gimbal angles."""
        edges, solution = self.run.time, self.solution
        sensed = self.true_increments.dtheta / np.diff(edges)[:, np.newaxis]
        frame = self.run.scenario.navigation.frame
        angles = solution.gimbals[:, (0, 1, 2)]
        rates, turns = fixed("deg/s", units.DEG), fixed("deg/h", units.DEG_H)
        yield Charts("platform_rates", ((
            Chart(key="platform/sensed", title="Strapdown: true rate of the IMU", x=over(span), y=Axis(units=rates),
                  marks=_three(edges[1:], sensed, _BODY)),
            Chart(key="platform/commanded", title="Platform: commanded rate", x=over(span), y=Axis(units=turns),
                  marks=_three(edges[1:], solution.commanded, _AXES.get(frame, ("x", "y", "z, down")))),
        ),), PAIR)  # fmt: skip
        yield Sentence(
            "The scale factor of a gyro multiplies the rate on the left, deg/s, that of a torquer the rate on the "
            "right, deg/h. Turns to one side add up; turns in alternating directions cancel.", "note",
        )  # fmt: skip
        marks = tuple(
            Line(label=name, x=solution.time, y=angles[:, k], color=color, turn=0.0 if k == 1 else 2.0 * np.pi)
            for k, (name, color) in enumerate((("roll", "roll"), ("pitch", "pitch"), ("azimuth", "heading")))
        )
        y = Axis(units=fixed("deg", units.DEG))
        gimbals = Chart(key="platform/gimbals", title="Gimbal angles", x=over(span), y=y, marks=marks)
        yield Charts("platform_gimbals", ((gimbals,),), PAIR, on=("recording",))

    def _by_cause(self, span: tuple[float, float]) -> Iterator[Item]:
        """Yield what each error of the platform contributes, by the linear error equations, beside the simulation."""
        causes, horizontal = self.errors_by_cause, self.errors.horizontal
        sizes = {name: np.linalg.norm(rows, axis=1) for name, rows in causes.position.items()}
        sizes = {name: size for name, size in sizes.items() if size.max() > _LEAST}
        total, apart = np.linalg.norm(causes.total, axis=1), causes.apart(self.errors)
        if not self._is_linear:
            yield Sentence(
                "The errors are too large for the linear error equations, which give the contribution of each."
            )
            return
        listed = {**sizes, "all together, as vectors": total, "the simulated platform": horizontal}
        table = Table(
            (Column("cause", words=True), Column("horizontal error, end", LENGTH_SCALE), Column("most", LENGTH_SCALE)),
            [[name, float(size[-1]), float(size.max())] for name, size in listed.items()],
        )
        chart = Chart(
            key="platform/by_cause", title="Horizontal error by cause", x=over(span),
            y=Axis(units=LENGTH_SCALE, low=0.0),
            marks=(
                Line(label="all causes together", x=causes.time, y=total, color="reference", weight="wide"),
                Line(label="simulated platform", x=self.errors.time, y=horizontal, color=PLATFORM),
                *(Line(label=name, x=causes.time, y=size, color=_COLORS[name]) for name, size in sizes.items()),
            ),
        )  # fmt: skip
        yield Beside([table, Charts("platform_causes", ((chart,),), (0.5 * PAIR[0], PAIR[1]), on=("page",))])
        yield Sentence(
            "Each cause separately, by the linear error equations of the platform; the simulation is that of the "
            f"complete loop. The two differ by {number_text(apart, 3)} m at most.", "note",
        )  # fmt: skip


def _three(time: Array, rows: Array, names: tuple[str, ...]) -> tuple[Line, ...]:
    """Return a line for each axis."""
    return tuple(Line(label=name, x=time, y=rows[:, k], color="xyz"[k]) for k, name in enumerate(names))


def platform_numbers(
    solution: PlatformSolution,
    errors: PlatformErrors,
    ideal: ImuData,
    strapdown: tuple[str, NavError] | None,
    without: NavError | None,
    by_cause: ErrorsByCause,
    simulated: NavError,
) -> PlatformNumbers:
    """Return the entry of a platform, and of a strapdown algorithm with and without errors that act in turns."""
    rate = ideal.dtheta / np.diff(ideal.time)[:, np.newaxis]
    speed = np.linalg.norm(rate, axis=1)
    turning = speed > _TURNING
    numbers: PlatformNumbers = {
        "torquer_scale_ppm": (errors.torquer_scale / units.PPM).tolist(),
        "pickoff_arcsec": (errors.pickoff / units.ARCSEC).tolist(),
        "max_commanded_rate_deg_h": float(np.linalg.norm(solution.commanded, axis=1).max() / units.DEG_H),
        "max_rate_of_the_vehicle_deg_s": float(speed.max() / units.DEG),
        "turned_deg": float((speed * np.diff(ideal.time))[turning].sum() / units.DEG),
        "final_horizontal_error_by_cause_m": {
            name.replace(" ", "_"): float(np.hypot(*rows[-1])) for name, rows in by_cause.position.items()
        },
        "largest_difference_from_error_equations_m": by_cause.apart(simulated),
    }
    if strapdown is not None and without is not None:
        name, error = strapdown
        rows = min(len(error.time), len(without.time))
        apart = np.linalg.norm(error.position_ned[:rows, :2] - without.position_ned[:rows, :2], axis=1)
        numbers["strapdown"] = {
            "algorithm": name,
            "without_errors_of_turns": error_numbers(without),
            "final_distance_m": float(apart[-1]),
            "max_distance_m": float(apart.max()),
        }
    return numbers


_CYCLES_SHOWN = 1200.0
"""Length of the beginning of the run for which the angles are drawn, s."""


class RotationNumbers(TypedDict):
    """What the errors of the first algorithm would be without the rotation."""

    without_rotation: ErrorNumbers


@dataclass(frozen=True)
class Rotation(Part[RotationNumbers]):
    """The rotation of a run's IMU."""

    name, title, place = "rotation", "Rotating IMU", "sensors"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the run's IMU rotates."""
        return run.scenario.imu.rotation is not None and isinstance(run.truth, Truth)

    @cached_property
    def encoders(self) -> Encoders:
        """The encoders of the rotating IMU."""
        truth, errors = self.run.truth, self.run.sensed.errors
        assert isinstance(truth, Truth)
        encoders = encoders_of(truth.block, None if errors is None else errors.encoders, truth.time)
        assert encoders is not None  # the block turns
        return encoders

    @cached_property
    def without_rotation(self) -> NavError | None:
        """Errors of the first algorithm with a solution if the IMU, with the same errors, did not rotate.

        None if there is no solution.
        """
        truth, scenario = self.run.truth, self.run.scenario
        assert isinstance(truth, Truth)
        if not self.run.solutions:
            return None
        imu = scenario.imu.model_copy(update={"rotation": None})
        ideal = digital(truth.trajectory.increments(imu.rate_hz))
        readings = read(truth.trajectory, ideal, imu, scenario.seed, self.run.sensed.errors)[1]
        still = scenario.model_copy(update={"imu": imu})
        return what_if(self.run, next(iter(self.run.solutions)), readings.compensated or readings.imu, still)

    def numbers(self) -> RotationNumbers:
        """Return the errors without the rotation, for `summary.json`."""
        return rotation_numbers(self.without_rotation)

    def streams(self) -> Iterator[Stream]:
        """Yield the angles, and the errors without the rotation."""
        yield rotation_stream(self.encoders)
        if self.without_rotation is not None:
            yield error_stream("without_rotation", self.without_rotation.at, self.without_rotation.time)

    def brief(self, algorithms: Mapping[str, ErrorNumbers]) -> Iterator[Item]:
        """Yield the effect of the rotation on the first algorithm with a solution."""
        still = self.entry["without_rotation"]["max_horizontal_error_m"]
        if still is not None and algorithms:
            largest = next(iter(algorithms.values()))["max_horizontal_error_m"]
            yield Sentence(
                f"The IMU rotates in the vehicle. The horizontal error reaches {number_text(largest, 4)} m. With "
                f"the same sensor errors and without the rotation it reaches {number_text(still, 4)} m."
            )

    def exhibits(self) -> Iterator[Item]:
        """Yield the angles, and the errors with and without the rotation; nothing for a run without errors."""
        run, without = self.run, self.without_rotation
        if not run.errors:
            return
        time = run.time[run.time <= run.time[0] + _CYCLES_SHOWN]
        turned = self.encoders.turns.angles(time)
        angles = [Line(label="outer axis", x=time, y=turned[:, 0], color="aided")]
        if turned[:, 1].any():
            angles.append(Line(label="inner axis", x=time, y=turned[:, 1], color="refused"))
        x, y = over((float(time[0]), float(time[-1]))), Axis(units=fixed("°", DEG))
        chart = Chart(key="rotation/angles", title="Rotation angles of the IMU", x=x, y=y, marks=tuple(angles))
        yield Charts("rotation_angles", ((chart,),), (0.5 * PAIR[0], PAIR[1]), on=("page",))
        if without is None:
            return
        name, with_rotation = next(iter(run.errors.items()))
        both = {"without rotation": without, "with rotation": with_rotation}
        table = Table(
            (Column("", words=True), Column("horizontal error, largest", LENGTH_SCALE),
             Column("horizontal error, at the end", LENGTH_SCALE), Column("attitude error, largest", ANGLE_SCALE),
             Column("attitude error, at the end", ANGLE_SCALE)),
            [[label, *(float(v) for values in (error.horizontal, error.angle) for v in (values.max(), values[-1]))]
             for label, error in both.items()],
            note="Both solutions have the same vehicle motion and the same sensor errors. The attitude of the vehicle "
            "is that of the rotating IMU minus the measured rotation, so it contains the errors of the encoders.",
        )  # fmt: skip
        drawn = side_by_side(
            "rotation",
            {"without rotation": (without, "refused", "bold"), "with rotation": (with_rotation, "aided", "line")},
            (float(run.time[0]), float(run.time[-1])),
        )  # fmt: skip
        yield Section(f"With and without rotation: {name}", [drawn, table])


def rotation_numbers(without: NavError | None) -> RotationNumbers:
    """Return the entry of a rotating IMU, from the errors of the first algorithm without the rotation."""
    return {"without_rotation": NO_NUMBERS if without is None else error_numbers(without)}
