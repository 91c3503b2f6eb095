"""Radii of curvature with e² or the height dropped: against a flight along a meridian integrated here, and by frame."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sinssim import NavState, navigate
from sinssim.data import ImuData
from sinssim.earth.ellipsoids import WGS84
from sinssim.earth.gravity import parameters
from sinssim.jit import rebound
from sinssim.strapdown.frames.navigation_problem import FORMS, distances_k
from sinssim.strapdown.mechanization import CURVATURES
from sinssim.truth.motions.parked_and_great_circle import GreatCircle
from tests.oracles.s_turn import STurn
from tests.slow import slow

A, F = 6378137.0, 1 / 298.257223563
E2 = F * (2 - F)
V = 305.5556  # 1100 km/h
SCHULER = 5064.0


def meridian(form: str, latitude: float, height: float) -> float:
    """1/(R₁+h) of a form."""
    radius = A if form.startswith("spherical") else A * (1 - E2) / (1 - E2 * np.sin(latitude) ** 2) ** 1.5
    return 1 / (radius + (0.0 if form.endswith("no-height") else height))


def north_error(form: str, start: float, height: float, times: np.ndarray) -> np.ndarray:
    """Error of a north-going navigator with perfect sensors in the plane of the meridian, on an Earth at rest.

    φ̇ = V/(R₁+h); the navigator: φ̇' = V' k', θ̇' = V' k' − V k, V̇' = (V² k − g) sin θ', from its own latitude.
    """

    def rates(_, y):
        true, computed, v, tilt = y
        k, own = meridian("exact", true, height), meridian(form, computed, height)
        s2 = np.sin(true) ** 2
        g = 9.7803253359 * (1 + 0.00193185265241 * s2) / np.sqrt(1 - E2 * s2) * (1 - 2 * height / A)
        return [V * k, v * own, (V * V * k - g) * np.sin(tilt), v * own - V * k]

    found = solve_ivp(rates, (0, times[-1]), [start, start, V, 0.0], t_eval=times, rtol=1e-10, atol=1e-12)
    return (found.y[1] - found.y[0]) / np.array([meridian("exact", x, height) for x in found.y[0]])


@pytest.fixture(scope="module", params=[(0.0, 0.0), (np.deg2rad(40.0), 11e3)], ids=["equator", "40° at 11 km"])
def northward(request):
    latitude, height = request.param
    flight = GreatCircle(
        latitude=latitude, longitude=0.3, height=height, course=0.0, speed=V, duration=SCHULER, gravity="somigliana"
    )
    return latitude, height, flight, flight.increments(4.0)


@pytest.mark.parametrize("form", FORMS)
def test_the_distances_of_a_form(form):
    """Uncompiled, R₁+h and R₂+h: the second is the radius of the parallel over the cosine of the latitude."""
    distances = rebound(distances_k.py_func, f"distances_{form}", **FORMS[form])
    for latitude, height in ((-1.2, 0.0), (0.3, 11e3)):
        parallel = A / np.hypot(np.cos(latitude), (1 - F) * np.sin(latitude))  # b/a = 1 − f
        of_form = A if form.startswith("spherical") else parallel
        r1_h, r2_h, r1, r2 = distances(parameters(WGS84), np.sin(latitude), height)
        assert r1_h * meridian(form, latitude, height) == pytest.approx(1.0, abs=1e-14)
        assert r2_h == pytest.approx(of_form + (0.0 if form.endswith("no-height") else height), rel=1e-14)
        assert (r1 * meridian("exact", latitude, 0.0), r2 / parallel) == pytest.approx((1.0, 1.0), abs=1e-14)


# "spherical-no-height" has both changes; each form has an engine of its own, which takes seconds to compile
@pytest.mark.parametrize("form", ["spherical-no-height", *slow("spherical", "no-height")])
def test_a_flight_to_the_north(northward, form):
    """The Earth's rotation, left out here, turns the oscillation's plane like that of Foucault's pendulum.

    By Ω sin φ t, 0.25 rad in a Schuler period from 40° on: 1 − cos is 3 %. From the equator on it is 0.2 %.
    """
    latitude, height, flight, imu = northward
    level = np.full(len(imu.time), height)
    options = {"gravity": "somigliana", "vertical": "truth", "height": level}
    solution = navigate(imu, flight.state(0.0), curvature=form, **options)
    truth = flight.state(solution.time)
    found = (solution.latitude - truth.latitude) / np.array([meridian("exact", x, height) for x in truth.latitude])
    expected = north_error(form, latitude, height, solution.time)
    if form == "no-height" and not height:
        assert np.max(np.abs(found)) < 0.01
        return
    assert np.max(np.abs(expected)) > 200.0
    np.testing.assert_allclose(found, expected, rtol=0, atol=(0.03 if latitude else 0.005) * np.max(np.abs(expected)))


def test_what_the_claim_on_the_radii_rests_on():
    """(1/R₁ − 1/a) V/ω_s at the equator: the amplitude of the Schuler oscillation of a constant e²."""
    amplitude = V * E2 / (1 - E2) / np.sqrt(9.78 / A)
    assert amplitude == pytest.approx(1660, abs=5)
    times = np.linspace(0, SCHULER, 500)
    assert np.max(np.abs(north_error("spherical", 0.0, 0.0, times))) == pytest.approx(1698, abs=5)


@pytest.mark.parametrize(
    ("form", "frame", "algorithm"),
    [
        ("spherical-no-height", "wander", "quaternion"),
        ("spherical-no-height", "free-azimuth", "quaternion"),
        # each of these has a kernel of its own, which takes seconds to compile
        *slow(*((form, "wander", "quaternion") for form in FORMS if form != "spherical-no-height")),
        *slow(*((form, "free-azimuth", "quaternion") for form in FORMS if form != "spherical-no-height")),
        *slow(*((form, "transverse", "poisson") for form in FORMS)),
        *slow(*((form, "level", "functional-iteration") for form in FORMS if form != "spherical-no-height")),
        *slow(("spherical-no-height", "wander", "functional-iteration")),
    ],
)
def test_the_same_in_every_frame_with_radii(form, frame, algorithm):
    flight = STurn(duration=300, height=10e3).fly(20)
    first = NavState(flight.latitude[0], flight.longitude[0], flight.height[0], flight.velocity_ned[0], flight.q_nb[0])
    imu = ImuData(flight.time, flight.dtheta, flight.dvel)
    options = {"curvature": form, "gravity": "somigliana", "vertical": "truth", "height": flight.height}
    level = navigate(imu, first, **options)
    other = navigate(imu, first, frame=frame, algorithm=algorithm, **options)
    at = np.searchsorted(level.time, other.time)
    assert np.max(flight.horizontal_error(level.latitude, level.longitude)) > 1.0
    north = A * (other.latitude - level.latitude[at])
    east = A * np.cos(level.latitude[at]) * (other.longitude - level.longitude[at])
    assert np.max(np.hypot(north, east)) < 1e-3


def test_every_form_has_a_name_for_the_field():
    assert set(CURVATURES) == {"exact", "simplified", *FORMS}
