"""Chooses the default states of a scenario's filter: inertial errors that the planned motion makes noticeable.

An error of 1σ that multiplies an input u(t) adds σ u(t) to a reading with white noise of density N. The input is 1 for
a bias, the rates of the motion for the gyros' scale factors and misalignments, and the specific force for those of the
accelerometers. The largest signal-to-noise ratio d that any filter can have for it, whatever the aiding sensors, is
that of the matched filter,

    d² = Σ σ² ∫u² dt / N²,

summed over the errors of a block. An error without a state disturbs the filter by at most that: the innovations, and
the errors in units of their covariance, are projections of the signal, so that νᵀS⁻¹ν over the run and xᵀP⁻¹x are
noncentral χ² with a mean noncentrality of at most d². A block is a state if d² exceeds `LEFT_OUT`; a bias is one if the
sensors have a bias. Noisy readings hide more than that. A superfluous state makes a filter slower but not less
accurate.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from sinssim.data import Array
from sinssim.earth.models import OMEGA_IE
from sinssim.estimation.model import error_model
from sinssim.scenario.excitation import Excitation, excitation
from sinssim.scenario.sections.filter import FILTER_STATES
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.errors import ImuErrors
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.terms import of_triad
from sinssim.units import DEG_H

if TYPE_CHECKING:
    from sinssim.scenario import Scenario

LEFT_OUT = 0.3
"""Largest d² of a block that is left out: the NEES of three states is then at most 1.1 per state instead of 1, which a
single run cannot distinguish."""

PRODUCTS = 3.0
"""Smallest d of second-order errors that is reported: 3σ of the noise."""

_TRIADS = {"gyro": "gyros", "accelerometer": "accelerometers"}


class Weight(NamedTuple):
    """Significance of one block.

    Attributes:
        block: its name.
        ratio: d, its largest signal-to-noise ratio over the run; infinite without noise.
        needed: whether a filter needs it.
    """

    block: str
    ratio: float
    needed: bool


def weights(scenario: Scenario, moved: Excitation | None = None) -> tuple[Weight, ...]:
    """Return the significance of each block of the inertial sensors' errors in a scenario.

    Args:
        moved: rotation and acceleration of the motion if they are known; by default those of the plan.

    Returns:
        One entry for each block of `sinssim.scenario.sections.filter.FILTER_STATES`.

    Raises:
        InputError: the aircraft's description is invalid.
    """
    motion, sigma = moved or excitation(scenario), inertial_sigma(scenario)
    model = error_model(sigma, imu=tuple(FILTER_STATES), duration=motion.duration)
    found = []
    for block in model.blocks:
        if block.name not in FILTER_STATES:
            continue
        triad, _, what = block.name.partition(" ")
        size = float(np.max(np.square(block.sigma) + np.square(block.density) * motion.duration))
        noise = model.gyro_noise if triad == "gyro" else model.accel_noise
        squared = _ratio_squared(size * block.size / 3.0 * _input(motion, triad, what), noise)
        found.append(Weight(block.name, math.sqrt(squared), squared > (0.0 if what == "bias" else LEFT_OUT)))
    return tuple(found)


def _input(motion: Excitation, triad: str, what: str) -> float:
    """Return ∫u² dt, summed over the three axes."""
    if what == "bias":
        return 3.0 * motion.duration
    return motion.rate if triad == "gyro" else motion.force


def _ratio_squared(signal: float, noise: float) -> float:
    """Return ∫(σu)² dt over N²; infinite without noise."""
    return signal / noise**2 if noise > 0.0 else math.inf if signal > 0.0 else 0.0


def states(scenario: Scenario, moved: Excitation | None = None) -> tuple[str, ...]:
    """Return the blocks of the inertial sensors' errors that a scenario's filter has.

    Args:
        moved: as for `weights`.
    """
    assert scenario.filter is not None
    if scenario.filter.states is not None:
        return scenario.filter.states
    return tuple(weight.block for weight in weights(scenario, moved) if weight.needed)


def with_states(scenario: Scenario, moved: Excitation | None = None) -> Scenario:
    """Return a scenario with the states of its filter written out.

    Args:
        moved: as for `weights`.

    Returns:
        The scenario with the default of `filter.states` filled in; the same object if there is nothing to fill in.
    """
    section = scenario.filter
    if section is None or section.states is not None:
        return scenario
    return scenario.model_copy(update={"filter": section.model_copy(update={"states": states(scenario, moved)})})


def choice(scenario: Scenario, moved: Excitation | None = None) -> tuple[str, ...]:
    """Explain which states a scenario's filter has by default.

    Args:
        moved: as for `weights`.

    Returns:
        Lines of text, one for each block; none if the scenario has no filter or names its states.
    """
    if scenario.filter is None or scenario.filter.states is not None:
        return ()
    motion = "planned" if moved is None else "recorded"
    lines = [f"states chosen by the sensors and the {motion} motion, with the signal-to-noise ratio of a 1σ error:"]
    for block, ratio, needed in weights(scenario, moved):
        why = "no such error" if ratio == 0.0 else _times(ratio)
        lines.append(f"  {block:<27} {'a state' if needed else 'left out':<9} {why}")
    return tuple(lines)


def _times(ratio: float) -> str:
    return f"{ratio:.2g}" if ratio < 99.5 else f"{ratio:.0f}" if math.isfinite(ratio) else "infinite, no noise"


def hints(scenario: Scenario) -> Iterator[str]:
    """Explain an inconsistent filter by states that it lacks."""
    own, every = states(scenario), weights(scenario)
    missing = [weight for weight in every if weight.needed and weight.block not in own]
    if missing:
        which = ", ".join(f"{w.block} ({_times(w.ratio)} times the noise over the run)" for w in missing)
        yield (
            f"filter.states lacks errors of the sensors that matter on this motion: {which}. Add them, or "
            "omit filter.states; they are then chosen automatically."
        )
    else:
        yield from _products(scenario)


def notes(scenario: Scenario) -> Iterator[str]:
    """Report what a scenario's sensors are not accurate enough for."""
    section, parked = scenario.filter, scenario.parked
    if section is None or section.alignment_s is None or section.alignment != "at-rest" or parked is None:
        return
    gyro = inertial_sigma(scenario).gyro
    drift = math.hypot(float(np.max(gyro.bias)), gyro.instability, gyro.random_walk / math.sqrt(section.alignment_s))
    north = OMEGA_IE * math.cos(math.radians(parked.latitude_deg))
    if drift > north:  # a heading error of one radian
        yield (
            f"filter.alignment_s: the gyros drift by {drift / DEG_H:.3g} deg/h (1σ), and the north component of the "
            f"Earth's rate is {north / DEG_H:.3g} deg/h. Such gyros cannot find the heading, and the run will most "
            "likely fail. Use better gyros, or an initial heading and [aiding.magnetometer] in place of alignment_s."
        )


def _products(scenario: Scenario) -> Iterator[str]:
    """Report errors so large that their products matter, which a linear filter neglects."""
    motion, sigma = excitation(scenario), inertial_sigma(scenario)
    for name, triad, of in (("gyro", sigma.gyro, motion.rate), ("accelerometer", sigma.accel, motion.force)):
        product = float(np.max(triad.scale)) ** 2 + 2.0 * float(np.max(triad.misalignment)) ** 2
        ratio = math.sqrt(_ratio_squared(product**2 * of, triad.random_walk))
        if ratio > PRODUCTS:
            yield (
                f"The errors of the {_TRIADS[name]} are too large for a linear filter: the squares of scale factors "
                f"({1e6 * float(np.max(triad.scale)):.3g} ppm) and misalignments "
                f"({1e3 * float(np.max(triad.misalignment)):.3g} mrad), which no state describes, make up to "
                f"{_times(ratio)} times their noise over the run. Calibrate the sensors beforehand ([compensation])."
            )


def inertial_sigma(scenario: Scenario, factor: float | None = None) -> ImuErrors:
    """Return the standard deviations of the inertial sensors' errors that a scenario's filter assumes.

    Args:
        factor: by which the noises are multiplied; by default the section's `inertial_noise_factor`.
    """
    from sinssim.alignment.budget import expected_errors

    assert scenario.filter is not None
    imu, calibrated = scenario.imu, scenario.compensation
    noise = kept = expected_errors(imu)
    single = imu.sensor_set.type == "redundant"  # each sensor is compensated by itself
    if single:
        kept = noise if calibrated is None else expected_errors(calibrated.left(imu))
        imu = imu.model_copy(update={"faults": ()})  # the monitoring excludes a faulty sensor
    factor = scenario.filter.inertial_noise_factor if factor is None else factor

    def size(term: ErrorTerm) -> Array:
        """Return fixed and random part together, after the calibration."""
        if calibrated is not None and term.calibrated and not single:
            return term.si(getattr(calibrated, term.sigma_key))
        of = kept if term.calibrated else noise
        return np.asarray(np.hypot(*(getattr(getattr(one, term.triad), term.field) for one in (of.mean, of.sigma))))

    def triad(name: Literal["gyro", "accel"]) -> TriadErrors:
        own: TriadErrors = getattr(noise.sigma, name)
        drawn: dict[str, Any] = {term.field: size(term) for term in of_triad(name) if term.drawn}
        return replace(own, **drawn, random_walk=factor * own.random_walk, instability=factor * own.instability)

    sigma = imu.with_triads(triad("gyro"), triad("accel"))
    return sigma if calibrated is None else replace(sigma, arms=np.zeros((3, 3)), delay=0.0)
