"""The textbook chapter's axes (N, H, E; X forward, Y up, Z right) say the same as the package's NED and FRD.

The chapter's C_nb, its angles (8.17), its dynamics and its quaternion step (8.19) are written out here from its
formulas and compared with the package's after a change of axes.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim import earth, rotation

# north, up, east from north, east, down; forward, up, right from forward, right, down: the same reordering
NHE_FROM_NED = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], float)
XYZ_FROM_FRD = NHE_FROM_NED
RATE = 7.292115e-5


def chapter_matrix(roll, pitch, yaw):
    """B of the chapter: rows N, H, E, columns X, Y, Z; yaw counter-clockwise about H."""
    cg, sg, ct, st, cp, sp = (f(a) for a in (roll, pitch, yaw) for f in (np.cos, np.sin))
    return np.array(
        [
            [cp * ct, sp * sg - cp * st * cg, sp * cg + cp * st * sg],
            [st, ct * cg, -ct * sg],
            [-sp * ct, cp * sg + sp * st * cg, cp * cg - sp * st * sg],
        ]
    )


@pytest.fixture
def attitudes():
    rng = np.random.default_rng(12)
    return zip(rng.uniform(-np.pi, np.pi, 50), rng.uniform(-1.5, 1.5, 50), rng.uniform(0, 2 * np.pi, 50), strict=True)


def test_the_reordering_is_a_rotation():
    assert np.linalg.det(NHE_FROM_NED) == 1.0
    np.testing.assert_array_equal(NHE_FROM_NED @ [0, 0, -1], [0, 1, 0])  # up


def test_matrix_of_the_chapter_is_the_packages(attitudes):
    for roll, pitch, heading in attitudes:
        c_nb = rotation.dcm_from_quaternion(rotation.quaternion_from_euler(roll, pitch, heading))
        np.testing.assert_allclose(
            chapter_matrix(roll, pitch, -heading), NHE_FROM_NED @ c_nb @ XYZ_FROM_FRD.T, atol=2e-15, rtol=0
        )


def test_angles_of_eq_8_17(attitudes):
    for roll, pitch, heading in attitudes:
        c_nb = rotation.dcm_from_quaternion(rotation.quaternion_from_euler(roll, pitch, heading))
        b = NHE_FROM_NED @ c_nb @ XYZ_FROM_FRD.T
        gamma = np.arctan2(-b[1, 2], b[1, 1])
        theta = np.arcsin(b[1, 0])
        psi = np.arctan2(-b[2, 0], b[0, 0])
        assert (gamma, theta) == pytest.approx((roll, pitch), abs=2e-14)
        assert np.mod(-psi, 2 * np.pi) == pytest.approx(heading, abs=2e-14)


def test_euler_rates_of_the_chapter(attitudes):
    """ψ̇, ϑ̇, γ̇ from the rate in the chapter's body axes, against central differences of the package's attitude."""
    rng = np.random.default_rng(13)
    for roll, pitch, heading in list(attitudes)[:20]:
        omega_frd = rng.normal(size=3)
        wx, wy, wz = XYZ_FROM_FRD @ omega_frd
        gamma, theta = roll, pitch
        yaw_rate = (wy * np.cos(gamma) - wz * np.sin(gamma)) / np.cos(theta)
        pitch_rate = wy * np.sin(gamma) + wz * np.cos(gamma)
        roll_rate = wx - np.tan(theta) * (wy * np.cos(gamma) - wz * np.sin(gamma))
        q = rotation.quaternion_from_euler(roll, pitch, heading)
        h = 1e-4 * np.cos(theta)
        ends = [
            np.array(
                rotation.euler_from_quaternion(
                    rotation.multiply(q, rotation.quaternion_from_rotation_vector(k * h * omega_frd))
                )
            )
            for k in (-1, 1)
        ]
        change = np.mod(ends[1] - ends[0] + np.pi, 2 * np.pi) - np.pi
        expected = np.array([roll_rate, pitch_rate, -yaw_rate])  # heading = −ψ
        np.testing.assert_allclose(change / (2 * h), expected, atol=1e-5 * max(1.0, np.tan(theta) ** 2), rtol=0)


def test_rates_and_dynamics_of_the_chapter():
    """Ω, ω and V̇ = a + g − (2Ω + ω) × V in N, H, E, against the derivative of the velocity of a moving point."""
    latitude, longitude, height = 0.8, 1.0, 7e3
    v_ned = np.array([150.0, -120.0, 8.0])
    v = NHE_FROM_NED @ v_ned
    r1, r2 = earth.radii(latitude)
    big = RATE * np.array([np.cos(latitude), np.sin(latitude), 0.0])  # Ω_N, Ω_H, Ω_E
    small = np.array([v[2] / (r2 + height), v[2] * np.tan(latitude) / (r2 + height), -v[0] / (r1 + height)])
    # a coasting point (no specific force): in inertial axes its acceleration is gravitation alone
    gravity = NHE_FROM_NED @ earth.gravity_ned(latitude, height)
    v_dot = gravity - np.cross(2 * big + small, v)

    def ned_to_i(lat, lon, t):
        return earth.ecef_to_eci(rotation.dcm_from_quaternion(earth.q_en(lat, lon)).T, t).T

    r0 = earth.geodetic_to_ecef(latitude, longitude, height)
    velocity_i = ned_to_i(latitude, longitude, 0.0) @ v_ned + np.cross([0, 0, RATE], r0)
    g_i = earth.gravitation_ecef(r0)
    h = 0.5
    velocities = []
    for t in (-h, h):
        r_e = earth.eci_to_ecef(r0 + velocity_i * t + g_i * t * t / 2, t)
        lat, lon, _ = earth.ecef_to_geodetic(r_e)
        v_i = velocity_i + g_i * t - np.cross([0, 0, RATE], earth.ecef_to_eci(r_e, t))
        velocities.append(NHE_FROM_NED @ ned_to_i(lat, lon, t).T @ v_i)
    np.testing.assert_allclose((velocities[1] - velocities[0]) / (2 * h), v_dot, atol=3e-7, rtol=0)


def test_quaternion_step_of_eq_8_19_is_a_product_on_the_right():
    """The second-order Picard step in the chapter's own body axes against the exact step, to third order."""
    q = Rotation.random(random_state=3).as_quat(scalar_first=True)  # chapter's axes
    for scale in (1e-2, 5e-3):
        d = scale * np.array([0.3, -0.7, 0.5])
        l0, l1, l2, l3 = q
        c = 1 - d @ d / 8
        stepped = np.array(
            [
                c * l0 - (d[0] * l1 + d[1] * l2 + d[2] * l3) / 2,
                c * l1 + (d[0] * l0 + d[2] * l2 - d[1] * l3) / 2,
                c * l2 + (d[1] * l0 + d[0] * l3 - d[2] * l1) / 2,
                c * l3 + (d[2] * l0 + d[1] * l1 - d[0] * l2) / 2,
            ]
        )
        exact = rotation.multiply(q, rotation.quaternion_from_rotation_vector(d))
        assert np.linalg.norm(stepped - exact) == pytest.approx(np.linalg.norm(d) ** 3 / 48, rel=0.02)
