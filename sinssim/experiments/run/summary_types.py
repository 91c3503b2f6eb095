"""The entries of `summary.json`: their keys, with the unit at the end of a name, and the types of their values.

A number that is not known is None.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NotRequired, TypedDict

Number = float | None
ErrorNumbers = Mapping[str, Number]
"""Final, rms and largest errors of a solution: `final_horizontal_error_m` and so on."""


class Test(TypedDict):
    """A statistic over its degrees of freedom, with the band that holds 95 % of those of a correct filter."""

    value: float
    lower_95: float
    upper_95: float
    probability: float


class JudgedTest(Test):
    """A test with its verdict, "consistent" or another."""

    verdict: str


class StatesTest(JudgedTest):
    """A test of the errors of some states, with their number."""

    states: int


class SensorUse(TypedDict):
    """What became of the readings of an aiding sensor."""

    readings: int
    taken: int
    unused: dict[str, int]


class RestNumbers(TypedDict):
    """Detected rest beside the true one: instants of the readings at which a vehicle was at rest, those without a
    reading, the readings, and those in motion."""

    at_rest: int
    missed: int
    readings: int
    in_motion: int


class SensorNumbers(SensorUse):
    """An aiding sensor: readings, rejections, tests of its innovations."""

    kind: str
    refused: int
    refused_expected: float
    withdrawn_s: Number
    first_refused_s: Number
    verdict: str
    tests: dict[str, Test]
    detection: RestNumbers | None


class Detection(TypedDict):
    """When fixes were first withdrawn by the monitor or rejected by the gate in a long series, and those then."""

    time_s: float
    by: Literal["monitor", "gate"]
    sensors: list[str]


class FaultNumbers(TypedDict):
    """The gate's response to a jump or a ramp of the satellites."""

    kind: str
    from_s: float
    to_s: float
    readings: int
    refused: int
    first_refused_s: Number
    believed_again_s: Number
    forged_then_m: Number
    caught: bool
    max_horizontal_error_m: Number


class StateNumbers(TypedDict):
    """A state of the filter: 1σ at the start and at the end, error or estimate at the end, SI."""

    sigma_start: float
    sigma_end: float
    error_end: Number
    estimate_end: NotRequired[Number]
    reduction: Number
    observable: NotRequired[bool]


class HeadingNumbers(TypedDict):
    """The heading at an instant of an alignment."""

    time_s: float
    heading_sigma_arcmin: float
    heading_error_arcmin: float


class AlignmentNumbers(TypedDict):
    """The result of an alignment for the heading."""

    method: str
    coarse_s: Number
    begin: HeadingNumbers
    end: HeadingNumbers


class HypothesisNumbers(TypedDict):
    """An explanation of the innovations, with its estimates in SI."""

    name: str
    kind: str
    value: list[float]
    sigma: list[float]
    gain: float
    needed: float


class RefusedSpan(TypedDict):
    """Consecutive readings of a sensor that the gate rejected."""

    sensor: str
    from_s: float
    to_s: float
    count: int


class SizeNumbers(TypedDict):
    """By how much the innovations of a sensor are larger than assumed, and the factor of its σ that explains it."""

    innovations_larger_by: Number
    sigma_factor: NotRequired[Number]


class DiagnosisNumbers(TypedDict):
    """The diagnosis of a filter; without a search for causes, only spans, sizes and what to try."""

    until_s: NotRequired[float]
    runs: NotRequired[int]
    seconds: NotRequired[float]
    false_alarm: NotRequired[float]
    refused: list[RefusedSpan]
    sensors: dict[str, SizeNumbers]
    cause: NotRequired[str | None]
    hypotheses: NotRequired[list[HypothesisNumbers]]
    what_to_try: list[str]


class DivergenceNumbers(TypedDict):
    """When and why a filter diverged."""

    time_s: float
    measurement: str | None
    reason: str


class FilterNumbers(TypedDict):
    """The filter: how consistent it is, the errors of its solutions, its sensors, faults, tests and states."""

    divergence: DivergenceNumbers | None
    remarks: list[str]
    consistent: bool
    findings: list[str]
    recorded: NotRequired[bool]
    hints: list[str]
    aided: ErrorNumbers | None
    smoothed: NotRequired[ErrorNumbers]
    backward: NotRequired[ErrorNumbers]
    alignment: NotRequired[AlignmentNumbers]
    diagnosis: NotRequired[DiagnosisNumbers]
    sensors: dict[str, SensorNumbers]
    faults: list[FaultNumbers]
    detections: list[Detection]
    nees: dict[str, StatesTest]
    noise: dict[str, JudgedTest]
    states: dict[str, StateNumbers]


class FailureNumbers(TypedDict):
    """Why an algorithm has no result."""

    time_s: Number
    text: str


class PassageNumbers(TypedDict):
    """A passage through a singular attitude."""

    start_s: float
    end_s: float
    damage_arcsec: Number
    text: str


class LogNumbers(TypedDict):
    """What is known of a recording."""

    reference_file: str | None
    compared_with: str | None
    knows: list[str]
    notes: list[str]
    time_0_gps_s: Number


class FileNumbers(TypedDict):
    """A file of the user's own content."""

    kind: str
    name: str
    file: str
    sha256: str


class PlaneDifference(TypedDict):
    """The largest difference of an error equation from the simulation, m and relative to the largest error."""

    max_m: Number
    relative: Number


class PlaneNumbers(TypedDict):
    """A run in a vertical plane: errors of the simulation, of perfect sensors and of the error equations."""

    variant: str
    schuler_period_s: float
    errors: dict[str, ErrorNumbers]
    errors_by_source: dict[str, ErrorNumbers]
    differences: dict[str, PlaneDifference]


class RequirementNumbers(TypedDict):
    """A requirement with its verdict in one run; value and limit are in the unit."""

    requirement: str
    verdict: str
    value: Number
    limit: float
    unit: str
    time_s: Number
    exceeded_from_s: Number


class StageEntries(TypedDict, total=False):
    """Entries of a run that follow from its stages, as far as it has come."""

    flight_cached: bool | None
    not_attained: list[str]
    singularities: dict[str, list[PassageNumbers]]
    failures: dict[str, FailureNumbers]
    filter: FilterNumbers
    requirements: list[RequirementNumbers]


class RunFacts(TypedDict):
    """Entries of a run that do not depend on its success; its status is "finished", "failed" or "interrupted"."""

    scenario: str
    status: str
    message: NotRequired[str]
    seed: int
    rate_hz: float
    timing: dict[str, float]
    versions: dict[str, str]
    own_content: NotRequired[list[FileNumbers]]


class RunSummary(RunFacts, StageEntries):
    """The contents of `summary.json`; the entries of what only some runs have are those of the parts."""

    start_s: float
    end_s: float
    flagged_samples: dict[str, int]
    algorithms: dict[str, ErrorNumbers]
    log: NotRequired[LogNumbers]
    one_component: NotRequired[PlaneNumbers]
