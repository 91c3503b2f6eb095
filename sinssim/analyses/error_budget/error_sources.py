"""The sources of navigation errors by inertial sensors, initial state and encoders, each with its size.

The angles of a rotating IMU enter the vehicle's attitude alone, and directly: an error b of the angle about an axis a
of the rotation, in north-east-down axes, is an attitude error φ = a b. The noise and the step of the encoders
(`sinssim.sensors.imu.encoder`) count with σ² and Q²/12. A filter compares the readings of its sensors with the
vehicle's attitude, so that the error acts on them, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from sinssim import rotation
from sinssim.analyses.error_budget.propagation import Flicker, GaussMarkov, Process, Sum, Walk
from sinssim.data import Array
from sinssim.sensors.imu.encoder import EncoderErrors, draw_encoders, encoders_of
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.sensors.sets.redundant_errors import axes_of_values, spread
from sinssim.sensors.sets.redundant_geometry import estimator
from sinssim.sensors.sets.sensor_set import Redundant
from sinssim.truth.motions.imu_rotation import TurningBlock
from sinssim.units import ARCMIN, ARCSEC

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.truth.trajectory import Trajectory


Kind = Literal["random", "given", "one run"]
"""random: differs from run to run, with a 1σ; given: the same in every run, with its sign; one run: not linear, the
effect of the sensors' readings in one run with this source alone."""

_GROUPS = {"gyro": "gyros", "accel": "accelerometers"}


@dataclass(frozen=True)
class Source:
    """One source of navigation errors.

    Attributes:
        name: as in the scenario without the unit, for example "gyro_bias".
        label: in words.
        group: "gyros", "accelerometers", "initial state", or the aiding sensor.
        kind: how it enters.
        value: its 1σ, the value of a noise, or the given error, in `unit`; the largest component if they differ; NaN if
            no number describes it.
        unit: unit as people write it.
    """

    name: str
    label: str
    group: str
    kind: Kind
    value: float
    unit: str


class Column(NamedTuple):
    """One value of a constant error, of one sensor.

    Attributes:
        triad: 0 for gyros, 1 for accelerometers.
        direction: in which the sensor's reading acts, (3,): its axis, or the gain of a combination of sensors.
        own: sensitive axis of the sensor, (3,).
        along: axis to which the value belongs, (3,).
        term: the error, whose `multiplies` is the input of the column.
    """

    triad: int
    direction: Array
    own: Array
    along: Array
    term: ErrorTerm


@dataclass(frozen=True)
class Constants:
    """Constant errors of the inertial sensors: one column for each value of each error.

    Attributes:
        sources: of each column's random part and given part, by name; one entry for each source.
        columns: the columns.
        parts: for each source its columns and their sizes: 1σ for a random source, values for a given one.
    """

    sources: list[Source]
    columns: list[Column]
    parts: dict[str, tuple[list[int], Array]]


@dataclass(frozen=True)
class InertialNoise:
    """A noise of the three sensors of a triad.

    Attributes:
        source: the source.
        triad: 0 for gyros, 1 for accelerometers, 2 for gravity in north, east, down.
        what: "white", "quantum", or "process".
        size: density, quantum or 1σ, SI.
        density: of the white noise that drives the navigation errors, for a white noise or a quantum.
        process: of unit size, for a process.
        sizes: 1σ of the three components, where they differ, (3,).
        mix: root of the matrix by which the squares of size and density are multiplied for a redundant set, (3, 3).
    """

    source: Source
    triad: int
    what: Literal["white", "quantum", "process"]
    size: float
    density: float = 0.0
    process: Process | None = None
    sizes: Array | None = None
    mix: Array = field(default_factory=lambda: np.eye(3))


def _in_unit(term: ErrorTerm, values: Array) -> float:
    largest = float(np.max(np.abs(values)))
    return float(f"{largest / term.unit:.12g}")


def remaining(scenario: Scenario, term: ErrorTerm) -> tuple[Array, Array]:
    """Return mean and 1σ of one error of the increments that navigation receives, after [compensation].

    Returns:
        Mean and 1σ over all runs, SI, in the shape of its field of `TriadErrors`.
    """
    mean, sigma = scenario.imu.stated(term)
    known = scenario.compensation
    if known is None or not term.calibrated:
        return mean, sigma
    value = getattr(known, term.key)
    if value is not None:  # a measured value is removed as it is
        return np.asarray(mean - term.si(value)), sigma
    return np.zeros(()), term.si(getattr(known, term.sigma_key))


def constants(scenario: Scenario) -> Constants:
    """Return the constant errors of a scenario's inertial sensors.

    Returns:
        Those that are not zero; an error that varies about a given value is two sources.
    """
    found = Constants([], [], {})
    own, axes = scenario.imu.sensor_set, np.eye(3)
    for term in TERMS:
        if not term.drawn:
            continue
        triad, mean_and_sigma = ("gyro", "accel").index(term.triad), remaining(scenario, term)
        columns: dict[tuple[int, ...], Column] = {}
        if isinstance(own, Redundant):  # the same 1σ for all single sensors; given values are refused
            gains, many = estimator(own.axes).T, list(enumerate(axes_of_values(own.axes, term.size)))
            for i, (gain, axis) in enumerate(zip(gains, own.axes, strict=True)):
                columns |= {(i, k): Column(triad, gain, axis, along[i], term) for k, along in many}
            sigma = np.full((len(gains), len(many)), np.max(mean_and_sigma[1]))
            mean = np.zeros_like(sigma)
        else:
            mean, sigma = (np.broadcast_to(a, term.shape) for a in mean_and_sigma)
            for at in np.ndindex(term.shape):
                columns[at] = Column(triad, axes[at[0]], axes[at[0]], axes[at[-1]], term)
        kinds: Iterable[tuple[Kind, str, str, Array]] = (
            ("random", term.name, "", sigma),
            ("given", f"{term.name}_given", ", given", mean),
        )
        places: dict[tuple[int, ...], int] = {}
        for kind, name, also, values in kinds:
            where = [tuple(map(int, index)) for index in np.argwhere(values)]
            if not where:
                continue
            for index in where:
                if index not in places:
                    places[index] = len(found.columns)
                    found.columns.append(columns[index])
            found.sources.append(
                Source(name, f"{_label(term)}{also}", _GROUPS[term.triad], kind, _in_unit(term, values),
                       term.written_unit)
            )  # fmt: skip
            found.parts[name] = ([places[index] for index in where], np.array([values[index] for index in where]))
    return found


def _label(term: ErrorTerm) -> str:
    words = term.name.split("_", 1)[1].replace("_", " ")
    return {"arw": "angle random walk", "vrw": "velocity random walk", "rrw": "rate random walk",
            "scale": "scale factor", "cross axis": "cross-axis coupling", "quantum": "quantisation",
            "instability": "bias instability", "g sensitivity": "g-sensitivity", "ramp": "bias ramp"
            }.get(words, words)  # fmt: skip


def inertial_noises(scenario: Scenario, *, summed: bool = False) -> list[InertialNoise]:
    """Return the noises of a scenario's inertial sensors.

    Args:
        summed: whether the integral of the gyros' white noise is a state of its own, for readings of a mean rate.
    """
    section, found = scenario.imu, []
    own = section.sensor_set
    mix = np.asarray(np.linalg.cholesky(spread(own.axes)) if isinstance(own, Redundant) else np.eye(3))
    by_name = {(term.triad, term.field): term for term in TERMS}
    for term in TERMS:
        if term.field not in ("random_walk", "quantum", "instability", "rate_walk", "flicker"):
            continue
        size = float(section.stated(term)[0])
        if not size:
            continue
        tau = float(section.stated(by_name[term.triad, "correlation_time"])[0])
        processes: dict[str, Process] = {"random_walk": Sum()} if summed and term.triad == "gyro" else {}
        processes |= {
            "instability": GaussMarkov(tau), "rate_walk": Walk(), "flicker": Flicker(1.0 / section.rate_hz)
        }  # fmt: skip
        rounded = term.field == "quantum" and section.output != "increments"  # each reading by itself
        what: Literal["white", "quantum", "process"] = (
            "white" if term.field == "random_walk" or rounded else "quantum" if term.field == "quantum" else "process"
        )
        source = Source(
            term.name, _label(term), _GROUPS[term.triad], "random", _in_unit(term, np.array(size)), term.written_unit
        )
        triad = ("gyro", "accel").index(term.triad)
        size = size * math.sqrt(section.rate_hz / 12.0) if rounded else size
        density = size if what == "white" else size / math.sqrt(12.0 * section.rate_hz) if what == "quantum" else 0.0
        found.append(InertialNoise(source, triad, what, size, density, processes.get(term.field), mix=mix))
    return found


@dataclass(frozen=True)
class InitialErrors:
    """Errors of the initial state.

    Attributes:
        sources: the sources.
        parts: for each of them its errors at the start, one column for each independent one, (9, c).
    """

    sources: list[Source] = field(default_factory=list)
    parts: dict[str, Array] = field(default_factory=dict)


def initial_errors(scenario: Scenario, given: Array) -> InitialErrors:
    """Return the errors of a scenario's initial state.

    Args:
        given: errors at the start by the given initial errors alone, position, velocity and attitude, (9,).
    """
    e, found = scenario.navigation.initial_error, InitialErrors()
    rows: tuple[tuple[str, str, tuple[int, ...], float, float, str], ...] = (
        ("initial_position", "position, north and east", (0, 1), e.position_sigma_m, 1.0, "m"),
        ("initial_height", "height", (2,), e.height_sigma_m, 1.0, "m"),
        ("initial_velocity", "velocity", (3, 4, 5), e.velocity_sigma_mps, 1.0, "m/s"),
        ("initial_tilt", "tilts", (6, 7), e.tilt_sigma_arcmin, ARCMIN, "arcmin"),
        ("initial_heading", "heading", (8,), e.heading_sigma_arcmin, ARCMIN, "arcmin"),
    )
    for name, label, where, size, unit, written in rows:
        if size:
            found.sources.append(Source(name, label, "initial state", "random", size, written))
            found.parts[name] = size * unit * np.eye(9)[:, list(where)]
    if given.any():
        found.sources.append(Source("initial_given", "given errors", "initial state", "given", float("nan"), ""))
        found.parts["initial_given"] = given[:, None]
    return found


_GROUP = "rotation"


@dataclass(frozen=True)
class AngleError:
    """An error of the angles.

    Attributes:
        source: the source.
        what: a constant of a run, a noise of its own at every instant, or an error that is the same in every run.
        size: 1σ of each component, rad; 1 for a given error, (c,).
        phi: returns the vehicle's attitude error by a unit of each component at instants (K,) s, (K, 3, c).
    """

    source: Source
    what: Literal["constant", "noise", "given"]
    size: Array
    phi: Callable[[Array], Array]


def angle_errors(scenario: Scenario, block: Trajectory) -> list[AngleError]:
    """Return the errors of the angles of a rotating IMU.

    Returns:
        The errors that are not zero; none for a block that does not turn.
    """
    section = scenario.imu.rotation
    if section is None or not isinstance(block, TurningBlock):
        return []
    turning, turns = block, block.turns
    found: list[AngleError] = []

    def axes(time: Array) -> Array:
        q_nv = turning.base.state(time).q_nb
        outer_turn = rotation.quaternion_from_rotation_vector(turns.angles(time)[:, :1] * turns.outer)
        outer = rotation.rotate(q_nv, turns.outer)
        inner = rotation.rotate(rotation.multiply(q_nv, outer_turn), turns.inner)
        return np.stack([outer, inner][: 2 if turns.two_axes else 1], axis=2)

    def add_random(name: str, label: str, what: Literal["constant", "noise"], value: float, size: float) -> None:
        if value:
            source = Source(name, label, _GROUP, "random", value, "arcsec")
            found.append(AngleError(source, what, np.full(2 if turns.two_axes else 1, size * ARCSEC), axes))

    bias, noise, step = section.encoder_bias_sigma_arcsec, section.encoder_noise_arcsec, section.encoder_quantum_arcsec
    add_random("encoder_bias", "encoder bias", "constant", bias, bias)
    add_random("encoder_noise", "encoder noise", "noise", noise, noise)
    add_random("encoder_quantum", "step of the encoder", "noise", step, step / 12.0**0.5)
    same = scenario.imu.model_copy(update={"rotation": section.model_copy(update={"encoder_bias_sigma_arcsec": 0.0})})
    given = draw_encoders(same, scenario.seed)
    assert given is not None
    given = replace(given, noise=0.0, quantum=0.0)
    largest = max(np.abs(given.bias).max(), given.periodic) / ARCSEC
    for name, label, errors, wobbles, value in (
        ("encoder_given", "encoder errors equal in every run", given, False, float(largest)),
        ("wobble", "wobble of the axis", EncoderErrors(), True, section.wobble_arcsec),
    ):
        if value:
            source = Source(name, label, _GROUP, "given", value, "arcsec")
            found.append(AngleError(source, "given", np.ones(1), _given(turning, errors, wobbles)))
    return found


def _given(block: TurningBlock, errors: EncoderErrors, wobbles: bool) -> Callable[[Array], Array]:
    """Return the attitude error by errors that are the same in every run, with or without the wobble of the axis."""

    def phi(time: Array) -> Array:
        q_nv, turns = block.base.state(time).q_nb, block.turns
        encoders = encoders_of(block, errors, time)
        assert encoders is not None
        true = turns.attitude(time) if wobbles else turns.without_wobble(turns.angles(time))
        q_solution = rotation.multiply(rotation.multiply(q_nv, true), rotation.conjugate(encoders.attitude(time)))
        off = rotation.multiply(q_nv, rotation.conjugate(q_solution))
        return np.asarray(rotation.rotation_vector_from_quaternion(off)[:, :, None])

    return phi


def of_turning(
    scenario: Scenario, block: Trajectory, outputs: Array
) -> tuple[list[Source], dict[str, Array], dict[str, Array]]:
    """Return the errors of a rotating IMU's angles as sources of an inertial solution.

    Args:
        outputs: instants, (E,) s.

    Returns:
        The sources, the covariances of the random ones, (E, 9, 9), and the errors that are the same in every run,
        (E, 9), SI; nothing for a block that does not turn.
    """
    sources: list[Source] = []
    covariance: dict[str, Array] = {}
    mean: dict[str, Array] = {}
    for error in angle_errors(scenario, block):
        sources.append(error.source)
        phi = error.phi(outputs) * error.size
        if error.what == "given":
            mean[error.source.name] = np.hstack([np.zeros((len(outputs), 6)), phi.sum(axis=2)])
        else:
            covariance[error.source.name] = np.zeros((len(outputs), 9, 9))
            covariance[error.source.name][:, 6:, 6:] = phi @ phi.transpose(0, 2, 1)
    return sources, covariance, mean
