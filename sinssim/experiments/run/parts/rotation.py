"""An IMU that rotates in the vehicle, [imu.rotation], beside one with the same errors that does not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from sinssim.charts import PAIR, Axis, Chart, Charts, Line, over
from sinssim.exhibits import Column, Item, Section, Sentence, Table
from sinssim.experiments.run.part import Part, side_by_side
from sinssim.formatting import number_text
from sinssim.recording.store.streams import other_error_stream, rotation_stream
from sinssim.recording.streams import Stream
from sinssim.scales import ANGLES, LENGTHS, fixed
from sinssim.simulation.navigation import Navigated, what_if
from sinssim.simulation.truth import Truth
from sinssim.strapdown.error_numbers import NO_NUMBERS, error_numbers
from sinssim.units import DEG

if TYPE_CHECKING:
    from sinssim.sensors.imu.encoder import Encoders
    from sinssim.strapdown.nav_error import NavError

_CYCLES_SHOWN = 1200.0
"""Length of the beginning of the run for which the angles are drawn, s."""


@dataclass(frozen=True)
class Rotation(Part):
    """The rotation of a run's IMU."""

    name, title, place = "rotation", "Rotating IMU", "sensors"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the run's IMU rotates."""
        return run.scenario.imu.rotation is not None and isinstance(run.truth, Truth)

    @cached_property
    def encoders(self) -> Encoders:
        """The encoders of the rotating IMU."""
        from sinssim.sensors.imu.encoder import encoders_of

        truth, errors = self.run.truth, self.run.sensed.errors
        assert isinstance(truth, Truth)
        found = encoders_of(truth.block, None if errors is None else errors.encoders, truth.time)
        assert found is not None  # the block turns
        return found

    @cached_property
    def without_rotation(self) -> NavError | None:
        """Errors of the first algorithm with a solution if the IMU, with the same errors, did not rotate.

        None if there is no solution.
        """
        from sinssim.sensors.imu.emulate import digital
        from sinssim.sensors.sets.reading import read

        truth, scenario = self.run.truth, self.run.scenario
        assert isinstance(truth, Truth)
        if not self.run.solutions:
            return None
        imu = scenario.imu.model_copy(update={"rotation": None})
        ideal = digital(truth.trajectory.increments(imu.rate_hz))
        readings = read(truth.trajectory, ideal, imu, scenario.seed, self.run.sensed.errors)[1]
        still = scenario.model_copy(update={"imu": imu})
        return what_if(self.run, next(iter(self.run.solutions)), readings.compensated or readings.imu, still)

    def numbers(self) -> Mapping[str, Any]:
        """Return the errors without the rotation, for `summary.json`."""
        return rotation_numbers(self.without_rotation)

    def streams(self) -> Iterator[Stream]:
        """Yield the angles, and the errors without the rotation."""
        yield rotation_stream(self.encoders)
        if self.without_rotation is not None:
            yield other_error_stream("error_without_rotation", self.without_rotation)

    def brief(self, algorithms: Mapping[str, Mapping[str, Any]]) -> Iterator[Item]:
        """Yield the effect of the rotation on the first algorithm with a solution."""
        still = self.entry["without_rotation"]["max_horizontal_error_m"]
        if still is not None and algorithms:
            own = next(iter(algorithms.values()))["max_horizontal_error_m"]
            yield Sentence(
                f"The IMU rotates in the vehicle. The horizontal error reaches {number_text(own, 4)} m. With the same "
                f"sensor errors and without the rotation it reaches {number_text(still, 4)} m."
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
        name, own = next(iter(run.errors.items()))
        both = {"without rotation": without, "with rotation": own}
        table = Table(
            (Column("", words=True), Column("horizontal error, largest", LENGTHS),
             Column("horizontal error, at the end", LENGTHS), Column("attitude error, largest", ANGLES),
             Column("attitude error, at the end", ANGLES)),
            [[label, *(float(v) for values in (error.horizontal, error.angle) for v in (values.max(), values[-1]))]
             for label, error in both.items()],
            note="Both solutions have the same vehicle motion and the same sensor errors. The attitude of the vehicle "
            "is that of the rotating IMU minus the measured rotation, so it contains the errors of the encoders.",
        )  # fmt: skip
        drawn = side_by_side(
            "rotation",
            {"without rotation": (without, "refused", "bold"), "with rotation": (own, "aided", "line")},
            (float(run.time[0]), float(run.time[-1])),
        )  # fmt: skip
        yield Section(f"With and without rotation: {name}", [drawn, table])


def rotation_numbers(without: NavError | None) -> dict[str, Any]:
    """Return the entry of a rotating IMU.

    Args:
        without: errors of the first algorithm without the rotation; None without a solution.

    Returns:
        `without_rotation`, as the entries of algorithms.
    """
    return {"without_rotation": NO_NUMBERS if without is None else error_numbers(without)}
