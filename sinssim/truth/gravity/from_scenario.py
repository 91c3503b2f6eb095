"""The true gravity of a scenario: field and remainder of its [gravity] table."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from sinssim.earth.harmonics.coefficients import Coefficients
from sinssim.earth.harmonics.field import DisturbingField
from sinssim.earth.harmonics.omission import omission
from sinssim.earth.models import ELLIPSOIDS
from sinssim.truth.gravity.disturbed import Disturbed
from sinssim.truth.gravity.remainder import RemainderModel
from sinssim.units import ARCSEC, MGAL

if TYPE_CHECKING:
    from sinssim.scenario.schema import Scenario
    from sinssim.scenario.sections.within_truth.gravity import GravitySection
    from sinssim.truth.trajectory import Trajectory

_NORMAL_DEGREE = 2
"""Degree to which normal gravity knows the field."""


def in_true_gravity(scenario: Scenario, trajectory: Trajectory) -> Disturbed:
    """Return a motion in the true gravity of a scenario.

    Args:
        scenario: with [gravity].
        trajectory: the motion in normal gravity.

    Returns:
        The motion, whose sensors feel the disturbance.
    """
    gravity = scenario.gravity
    assert gravity is not None
    field = field_of(gravity, scenario.truth.ellipsoid)
    return Disturbed(trajectory, field, remainder_model(gravity), scenario.seed)


def field_of(gravity: GravitySection, ellipsoid: str, degree: int | None = None) -> DisturbingField | None:
    """Return the disturbing field of a [gravity] table.

    Args:
        gravity: the table.
        ellipsoid: name of the ellipsoid of the truth.
        degree: highest degree; by default that of the table.

    Returns:
        The field; None for normal gravity.
    """
    model = gravity.coefficients(degree)
    return None if model is None else _field(model, ellipsoid)


def known_field(scenario: Scenario) -> DisturbingField | None:
    """Return the disturbing field that the navigator of a scenario knows.

    Args:
        scenario: the scenario.

    Returns:
        The field of navigation.gravity_degree; None if it knows normal gravity only.
    """
    degree, gravity = scenario.navigation.gravity_degree, scenario.gravity
    return None if degree is None or gravity is None else field_of(gravity, scenario.truth.ellipsoid, degree)


def unknown_field(scenario: Scenario) -> DisturbingField | None:
    """Return the part of the true field that the navigator does not know.

    Args:
        scenario: the scenario.

    Returns:
        The field; None if there is none.
    """
    gravity, known = scenario.gravity, scenario.navigation.gravity_degree
    field = None if gravity is None else field_of(gravity, scenario.truth.ellipsoid)
    if field is None or known == field.degree:
        return None
    return field if known is None else field.beyond(known)


@lru_cache(maxsize=4)
def _field(model: Coefficients, ellipsoid: str) -> DisturbingField:
    return DisturbingField(model, ELLIPSOIDS[ellipsoid])


def remainder_model(gravity: GravitySection) -> RemainderModel | None:
    """Return the statistics of the remainder of a [gravity] table.

    Args:
        gravity: the table.

    Returns:
        The statistics, with the sizes of `omission` where the table has none; None without a remainder.
    """
    section = gravity.remainder
    if section is None:
        return None
    model = gravity.coefficients()
    left = omission(_NORMAL_DEGREE if model is None else model.degree, section.altitude_m)

    def given(value: float | None, unit: float, instead: float) -> float:
        return instead if value is None else value * unit

    sigma = (
        given(section.xi_sigma_arcsec, ARCSEC, left.deflection),
        given(section.eta_sigma_arcsec, ARCSEC, left.deflection),
        given(section.anomaly_sigma_mgal, MGAL, left.anomaly),
    )
    return RemainderModel(section.order, sigma, given(section.correlation_km, 1e3, left.distance))
