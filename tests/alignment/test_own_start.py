"""The state from which a navigator starts after its own alignment, against the truth of the vehicle."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scenarios.support.swaying import Sway, Swaying
from sinssim import rotation
from sinssim.alignment import Expected
from sinssim.alignment.initial_conditions import aligned_state
from sinssim.data import NavState
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.truth.motions.parked_and_great_circle import Parked
from sinssim.units import ARCSEC

WGS84 = ELLIPSOIDS["wgs84"]
NOISE = Expected(ImuErrors(), ImuErrors(TriadErrors(random_walk=1e-7), TriadErrors(random_walk=1e-5)))


def turned(q: np.ndarray, p: np.ndarray) -> float:
    return float(
        (Rotation.from_quat(q, scalar_first=True).inv() * Rotation.from_quat(p, scalar_first=True)).magnitude()
    )


@pytest.mark.parametrize("latitude", [0.8, -0.6])
@pytest.mark.parametrize("method", ["quiet", "disturbed"])
def test_high_above_the_ellipsoid_the_attitude_refers_to_the_normal(method: str, latitude: float) -> None:
    """At 9 km the plumb line is 1.5″ off the normal; the place is the known one, not the determined one."""
    q_nb = rotation.quaternion_from_euler(0.3, -0.2, 1.1)
    truth = Parked(latitude, 0.4, 9000.0, q_nb, 100.0)
    place = NavState(np.asarray(latitude), np.asarray(0.4), np.asarray(9000.0), np.zeros(3), np.array([1.0, 0, 0, 0]))
    state, found = aligned_state(truth.increments(10.0), place, method, NOISE, "normal", WGS84)
    assert turned(state.q_nb, q_nb) < 0.01 * ARCSEC
    plumb = rotation.quaternion_from_euler(float(found.roll), float(found.pitch), float(found.heading))
    assert turned(plumb, q_nb) > 1.0 * ARCSEC
    assert (state.latitude, state.longitude, state.height) == (latitude, 0.4, 9000.0)
    np.testing.assert_allclose(state.velocity_ned, 0.0, rtol=0, atol=1e-5)  # m/s


def test_the_velocity_is_that_of_the_sway_at_the_last_instant() -> None:
    sways = [Sway("north", 0.05, 0.31, 0.4), Sway("east", 0.08, 0.23, 1.9), Sway("down", 0.03, 0.37, 2.5),
             Sway("heading", 0.05, 0.11, 0.7), Sway("roll", 0.02, 0.17, 0.2)]  # fmt: skip
    truth = Swaying(0.8, 0.4, 0.0, 0.3, -0.2, 1.1, 300.0, sways)
    last = truth.state(300.0)
    place = NavState(np.asarray(0.8), np.asarray(0.4), np.asarray(0.0), np.zeros(3), np.array([1.0, 0, 0, 0]))
    state, found = aligned_state(truth.increments(50.0), place, "disturbed", NOISE, "normal", WGS84)
    assert np.linalg.norm(last.velocity_ned) > 0.1
    np.testing.assert_allclose(state.velocity_ned, last.velocity_ned, rtol=0, atol=3e-3)
    assert turned(state.q_nb, last.q_nb) < 1e-5
    assert found.warnings == ()
