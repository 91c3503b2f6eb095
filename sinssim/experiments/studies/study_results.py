"""The results of a study: one row of numbers for each case, and the evidence that claims are decided by."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sinssim.data import Array, short_repr
from sinssim.experiments.studies.study_schema import CLAIM_WORDS, MotionFacts, Study
from sinssim.recording.result import Media, Result
from sinssim.strapdown.mechanization import OF_TRUTH

if TYPE_CHECKING:
    from sinssim.experiments.studies.attitude_cost import AttitudeCost
    from sinssim.experiments.studies.step_cost import Cost


NAN = float("nan")

Engine = tuple[str, str, tuple[float, ...]]
"""What a cost belongs to: algorithm, frame and schedule."""


@dataclass(frozen=True)
class Case:
    """One navigation of a study, by the title of its part, the name of its motion, its sensors and its engine.

    `schedule_hz` is empty if everything runs at the sample rate; `slow` is "hold" or "extrapolate".
    """

    part: str
    motion: str
    variant: str
    sensors: str
    algorithm: str
    frame: str
    gravity: str
    curvature: str
    rate_hz: float
    schedule_hz: tuple[float, ...]
    slow: str
    ellipsoid: str = OF_TRUTH

    @property
    def pace(self) -> str:
        """The rate, or the schedule's three rates, as text."""
        rates = "/".join(f"{rate:g}" for rate in self.schedule_hz) or f"{self.rate_hz:g}"
        return f"{rates} {self.slow}" if self.slow == "extrapolate" else rates


@dataclass(frozen=True)
class Row(Case):
    """The result of one navigation. Errors are relative to the truth, at the same evenly spread instants in every case.

    Attributes:
        status: "done", or "failed" if the engine failed.
        message: reason of the failure.
        samples: number of samples.
        duration_s: duration of the motion.
        final_…, rms_…, max_…: errors; the final height error has a sign.
        velocity_drift_…, attitude_drift_…: slopes of lines through the origin, and standard errors.
        max_defect: largest loss of norm or orthogonality.
        passages: number of passages of the attitude through an algorithm's singularity.
        max_damage_arcsec: largest damage by such a passage.
        ns_per_step, operations_per_step: cost per sample in this algorithm, frame and schedule, at the sample rate.
        attitude_ns_per_step, attitude_operations_per_step: those of the attitude alone with its matrix; NaN for an
            algorithm that iterates attitude, velocity and position together.
    """

    status: str = "done"
    message: str = ""
    samples: int = 0
    duration_s: float = NAN
    final_horizontal_error_m: float = NAN
    rms_horizontal_error_m: float = NAN
    max_horizontal_error_m: float = NAN
    final_height_error_m: float = NAN
    rms_height_error_m: float = NAN
    max_height_error_m: float = NAN
    final_velocity_error_mps: float = NAN
    rms_velocity_error_mps: float = NAN
    max_velocity_error_mps: float = NAN
    final_attitude_error_arcsec: float = NAN
    rms_attitude_error_arcsec: float = NAN
    max_attitude_error_arcsec: float = NAN
    velocity_drift_ug: float = NAN
    velocity_drift_uncertainty_ug: float = NAN
    attitude_drift_arcsec_h: float = NAN
    attitude_drift_uncertainty_arcsec_h: float = NAN
    max_defect: float = NAN
    passages: int = 0
    max_damage_arcsec: float = 0.0
    ns_per_step: float = NAN
    operations_per_step: float = NAN
    attitude_ns_per_step: float = NAN
    attitude_operations_per_step: float = NAN

    @property
    def case(self) -> Case:
        """The navigation."""
        return Case(**{field.name: getattr(self, field.name) for field in fields(Case)})


@dataclass(frozen=True)
class ErrorGrowth:
    """Growth of the errors of a case: time, s, horizontal error, m, and attitude error, arcsec, (K,) each."""

    time: Array
    horizontal: Array
    attitude: Array


@dataclass(frozen=True)
class CoordinateError:
    """The largest and the final error of a case in one column of further coordinates, in the unit of the column's name.

    "attitude_rad" is the angle of rotation.
    """

    case: Case
    coordinates: str
    column: str
    max_error: float
    final_error: float


@dataclass(frozen=True)
class Heading:
    """The heading through a motion's turns in one form, compared with the true heading that counts turns."""

    part: str
    motion: str
    form: str  # how the heading is obtained
    rate_hz: float
    turns: float  # full turns of the true heading from start to end
    # difference from the true heading modulo 360°
    max_error_arcsec: float
    final_error_arcsec: float
    jumps: int  # number of jumps relative to the true heading by more than a quarter turn
    wrong: float  # part of the time with an error above 0.3′
    least_hz: float  # lowest rate of reading at which the form counts the turns; 0 if it does not depend on the reading
    time: Array  # (K,) s
    # in this form, and true, (K,) rad
    heading: Array
    truth: Array


@dataclass(frozen=True)
class Order:
    """Order of convergence of an error with the sample interval, error ~ interval^order, with its standard error.

    It is fitted to the log of the error at a number of rates, `points`, from the lowest to the highest.
    """

    part: str
    motion: str
    algorithm: str
    quantity: str
    order: float
    uncertainty: float
    points: int
    low_hz: float
    high_hz: float


@dataclass(frozen=True)
class Verdict:
    """The verdict on a claim."""

    claim: str
    sentence: str  # text of the claim
    verdict: str  # "confirmed", "refuted", "partly" or "undecided"
    reason: str  # in a sentence or two
    points: tuple[str, ...] = ()  # the deciding numbers, motion by motion
    numbers: dict[str, float] = field(default_factory=dict)  # the deciding numbers by name
    judged: tuple[str, ...] = ()  # the verdict on each point, "" for one that only informs; empty if no point is judged
    # the deciding figure, and what it would be if the claim held, each with its unit
    measured: str = ""
    expected: str = ""

    @property
    def title(self) -> str:
        """The claim in a few words."""
        return CLAIM_WORDS[self.claim].title

    @property
    def lines(self) -> tuple[tuple[str, str], ...]:
        """Each point with its verdict, "" if it has none."""
        return tuple(zip(self.points, self.judged or ("",) * len(self.points), strict=True))

    @property
    def text(self) -> str:
        """Reason and points in one paragraph."""
        return f"{self.reason} {'; '.join(self.points)}.".replace("..", ".") if self.points else self.reason


@dataclass(frozen=True)
class Pick:
    """The recommended engine of one part with one sensor set, with its rate; "" if no engine qualifies."""

    part: str
    sensors: str
    variant: str
    choice: str
    reason: str
    numbers: dict[str, float] = field(default_factory=dict)

    @property
    def block(self) -> str:
        """The grade, and the set of sensors if it is not the default."""
        return self.sensors if self.variant == "rate-gyros" else f"{self.sensors}, {self.variant}"


@short_repr
@dataclass
class StudyResult(Result):
    """A study and its results so far.

    Attributes:
        study: the study.
        status: "finished", "interrupted" or "failed".
        seconds: duration of the computation.
        rows: one row for each finished case.
        histories: growth of the errors by case.
        motions: numbers of each motion by its part's title and its name.
        costs: cost of the whole navigation by algorithm, frame and schedule, which is empty for one rate.
        attitude_costs: cost of the attitude alone.
        headings: headings through turns, form by form.
        coordinate_errors: errors in further coordinates, of parts that ask for them.
        orders: orders of convergence.
        verdicts: the claims.
        picks: recommended engines, part by part.
        directory: directory of the study; None if nothing is kept.
        media: what draws and writes it.
    """

    study: Study
    status: str = "finished"
    seconds: float = 0.0
    rows: list[Row] = field(default_factory=list)
    histories: dict[Case, ErrorGrowth] = field(default_factory=dict)
    motions: dict[tuple[str, str], MotionFacts] = field(default_factory=dict)
    costs: dict[Engine, Cost] = field(default_factory=dict)
    attitude_costs: list[AttitudeCost] = field(default_factory=list)
    headings: list[Heading] = field(default_factory=list)
    coordinate_errors: list[CoordinateError] = field(default_factory=list)
    orders: list[Order] = field(default_factory=list)
    verdicts: list[Verdict] = field(default_factory=list)
    picks: list[Pick] = field(default_factory=list)
    directory: Path | None = None
    media: Media[StudyResult] = field(kw_only=True, repr=False, compare=False)

    def history(self, row: Row) -> ErrorGrowth:
        """Return the growth of the errors of the case of a finished `row`."""
        return self.histories[row.case]

    def history_or_none(self, row: Row) -> ErrorGrowth | None:
        """Return the growth of the errors of the case of a finished `row`, None if it was not kept."""
        return self.histories.get(row.case)

    def of_part(self, title: str) -> list[Row]:
        """Return the rows of the part with a `title`, in order."""
        return [row for row in self.rows if row.part == title]


ERRORS = ("max_attitude_error_arcsec", "max_horizontal_error_m")
"""The errors whose order of convergence is fitted."""

DEFECT = "max_defect"
"""Loss of norm or orthogonality, whose order is fitted, too."""

_FLOORS = {"max_attitude_error_arcsec": 1e-6, "max_horizontal_error_m": 1e-6, DEFECT: 1e-10}
"""Error below which rounding contributes."""
_ABOVE_BEST = 30.0
"""Ratio to the smallest error of the best algorithm above which an error counts as that of the algorithm."""
_FITTED = 4
"""Number of the highest rates that are fitted, where the leading term dominates."""
_STRAIGHT = 0.15
"""Largest standard error of a slope that counts as an order of convergence."""


def fit_orders(rows: list[Row]) -> list[Order]:
    """Fit the order of convergence of each algorithm on each motion with ideal sensors, from at least three rates."""
    orders = []
    algorithms = list(dict.fromkeys(row.algorithm for row in rows))
    plain = [r for r in rows if r.status == "done" and r.sensors == "ideal" and not r.schedule_hz and not r.passages]
    for quantity in (*ERRORS, DEFECT):
        for motion in dict.fromkeys(row.motion for row in plain):
            here = [row for row in plain if row.motion == motion]
            best = 0.0 if quantity == DEFECT else min(getattr(row, quantity) for row in here)
            floor = max(_FLOORS[quantity], _ABOVE_BEST * best)
            for key in dict.fromkeys(_engine(row) for row in here):
                errors = [(r.rate_hz, getattr(r, quantity)) for r in here if _engine(r) == key]
                usable = sorted((rate, error) for rate, error in errors if error > floor)[-_FITTED:]
                if len(usable) < 3:
                    continue
                x = -np.log([rate for rate, _ in usable])
                y = np.log([error for _, error in usable])
                slope, offset = np.polyfit(x, y, 1)
                left = y - slope * x - offset
                spread = np.sqrt(np.sum(left**2) / (len(x) - 2) / np.sum((x - x.mean()) ** 2))
                if spread > _STRAIGHT:
                    continue
                low, high = usable[0][0], usable[-1][0]
                orders.append(
                    Order(here[0].part, motion, key[0], quantity, float(slope), float(spread), len(usable), low, high)
                )
    orders.sort(key=lambda order: algorithms.index(order.algorithm))
    return orders


def _engine(row: Row) -> tuple[str, ...]:
    return row.algorithm, row.frame, row.gravity, row.curvature, row.ellipsoid, row.variant


FEW_TENTHS_ARCSEC = 18.0
"""The chapter's "few tenths of a minute of arc": 0.3′."""
ALLOWED_ARCSEC_H = 18.0
"""Attitude drift of a sufficient rate: 0.3′ in an hour, 0.005 deg/h, half of a gyro of the 1 nmi/h grade."""

EULER = "euler"
LOW_ORDER = ("poisson-1", "poisson-2", "quaternion-1", "quaternion-2", "two-quaternions")
"""Algorithms of first and second order."""
PLAIN = ("poisson-3", "poisson-4", "quaternion-3", "quaternion-4", "rotation-vector-1")
"""Algorithms of high order for a constant rate, with the increment in place of the rotation vector."""

LOOKS_AHEAD = ("quaternion", "poisson", "euler", "functional-iteration")
"""Algorithms whose step uses samples after its end, for recorded or delayed data: a rate fitted over five intervals,
two of them later, or a window."""


@dataclass(frozen=True)
class Evidence:
    """The numbers of the parts that decide a claim: the finished cases, and the motions' characteristics by name."""

    rows: list[Row]
    facts: dict[str, MotionFacts] = field(default_factory=dict)
    growth: Callable[[Row], ErrorGrowth | None] = lambda row: None
    headings: Sequence[Heading] = ()


@dataclass(frozen=True)
class Point:
    """One line of a verdict: motion, form, numbers, and the verdict on them; "" for a line that only informs."""

    text: str
    verdict: str = ""


@dataclass(frozen=True)
class Outcome:
    """The result of a rule: a `Verdict` without its claim."""

    verdict: str
    reason: str
    points: tuple[Point, ...] = ()
    numbers: dict[str, float] = field(default_factory=dict)
    measured: str = ""
    expected: str = ""


def undecided(lacking: str) -> Outcome:
    """Return the outcome of a claim without its numbers."""
    return Outcome("undecided", f"The study lacks the numbers that decide it: {lacking}.")


def overall(points: Sequence[Point]) -> str:
    """Return the verdict on a claim that must hold on every motion: that of all judged points, otherwise "partly"."""
    judged = {point.verdict for point in points if point.verdict}
    return judged.pop() if len(judged) == 1 else "partly"


def by(rows: Sequence[Row], key: Callable[[Row], str]) -> dict[str, list[Row]]:
    """Return rows in groups, in the order of their first rows."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(key(row), []).append(row)
    return groups


def of_motion(row: Row) -> str:
    """Return the motion of a row."""
    return row.motion


def base(algorithm: str) -> str:
    """Return the name of an algorithm without its correction after each step."""
    return algorithm.removesuffix("-ortho").removesuffix("-norm")


def needed(rows: Sequence[Row]) -> dict[str, Row]:
    """Return the row of the lowest rate from which on the attitude drifts by at most 0.3′ in an hour, by algorithm.

    An algorithm that exceeds the limit at its highest rate has none.
    """
    lowest = {}
    for algorithm, tested in by(rows, lambda row: row.algorithm).items():
        enough = None
        for row in sorted(tested, key=lambda row: -row.rate_hz):
            if not row.attitude_drift_arcsec_h <= ALLOWED_ARCSEC_H:
                break
            enough = row
        if enough is not None:
            lowest[algorithm] = enough
    return lowest


def drift_at(rows: Sequence[Row], algorithms: Sequence[str], rate_hz: float) -> float:
    """Return the least attitude drift of some algorithms at a rate: arcsec/h; NaN if there is none."""
    tested = [r for r in rows if base(r.algorithm) in algorithms and r.rate_hz == rate_hz]
    return min((row.attitude_drift_arcsec_h for row in tested), default=NAN)
