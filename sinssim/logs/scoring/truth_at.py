"""The truth of a recorded run at any instant: cubic through four samples, in Earth-fixed axes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array, NavState
from sinssim.earth.coordinates import ecef_to_geodetic, geodetic_to_ecef, q_en
from sinssim.earth.models import WGS84, Ellipsoid
from sinssim.errors import InputError
from sinssim.logs.streams import SolutionStream

_NEAR = 1e-9  # s: an instant this close to a sample is the sample
_BLOCK = 65536


class TruthAt:
    """The truth between the samples of a recorded run.

    Position, velocity and attitude are taken to Earth-fixed axes, where nothing is singular and longitude does not
    wrap. A cubic through the two samples before and the two after an instant interpolates the position, the velocity,
    and the rotation vector from the sample before it. At a sample the result is the sample.

    Args:
        truth: samples in order of time, at least 4.
        ellipsoid: of the coordinates.

    Raises:
        InputError: there are fewer than 4 samples.
    """

    def __init__(self, truth: SolutionStream, ellipsoid: Ellipsoid = WGS84) -> None:
        if len(truth) < 4 or truth.velocity_ned is None or truth.q_nb is None:
            raise InputError(f"the truth has {len(truth)} samples; at least 4 are needed to interpolate it.")
        self.time = truth.time
        self._truth = NavState(truth.latitude, truth.longitude, truth.height, truth.velocity_ned, truth.q_nb)
        self._ellipsoid = ellipsoid

    def state(self, time: Array) -> NavState:
        """Return the true states.

        Args:
            time: instants from the first to the last sample, (M,) s.
        """
        parts = [self._block(time[a : a + _BLOCK]) for a in range(0, len(time), _BLOCK)]
        return NavState(
            *(np.concatenate([getattr(part, name) for part in parts])
              for name in ("latitude", "longitude", "height", "velocity_ned", "q_nb"))
        )  # fmt: skip

    def at_samples(self, time: Array) -> NDArray[np.bool_]:
        """Return which instants are samples of the truth, where nothing is interpolated, (M,)."""
        right = np.searchsorted(self.time, time).clip(max=len(self.time) - 1)
        left = (right - 1).clip(min=0)
        return np.asarray(np.minimum(np.abs(self.time[right] - time), np.abs(self.time[left] - time)) <= _NEAR)

    def antenna(self, time: Array, lever_arm: Array) -> NavState:
        """Return the true states of an antenna.

        Args:
            time: instants, (M,) s.
            lever_arm: from the sensor block, forward, right, down, (3,) m.
        """
        block = self.state(time)
        step = 0.25 * float(np.median(np.diff(self.time)))
        after = np.minimum(time + step, self.time[-1])
        before = np.maximum(time - step, self.time[0])

        def arm_at(instants: Array) -> Array:
            s = self.state(instants)
            return rotation.rotate(rotation.multiply(q_en(s.latitude, s.longitude), s.q_nb), lever_arm)

        place = geodetic_to_ecef(block.latitude, block.longitude, block.height, self._ellipsoid) + arm_at(time)
        latitude, longitude, height = ecef_to_geodetic(place, self._ellipsoid)
        moved = (arm_at(after) - arm_at(before)) / (after - before)[:, np.newaxis]
        velocity_e = rotation.rotate(q_en(block.latitude, block.longitude), block.velocity_ned) + moved
        velocity = rotation.rotate(rotation.conjugate(q_en(latitude, longitude)), velocity_e)
        return NavState(latitude, longitude, height, velocity, block.q_nb)

    def _block(self, time: Array) -> NavState:
        """Return the states of a block of instants."""
        count = len(self.time)
        before = (np.searchsorted(self.time, time, side="right") - 1).clip(0, count - 2)
        nodes = (before - 1).clip(0, count - 4)[:, np.newaxis] + np.arange(4)
        weights = _weights(self.time[nodes], time)
        rows, place = np.unique(nodes, return_inverse=True)
        place = place.reshape(nodes.shape)
        t = self._truth
        turn = q_en(t.latitude[rows], t.longitude[rows])
        position = geodetic_to_ecef(t.latitude[rows], t.longitude[rows], t.height[rows], self._ellipsoid)
        velocity = rotation.rotate(turn, t.velocity_ned[rows])
        q_eb = rotation.multiply(turn, t.q_nb[rows])
        base = place[:, 1]  # differences from one node keep the digits of a position of 6.4e6 m
        here = position[base] + np.einsum("mi,mij->mj", weights, position[place] - position[base][:, np.newaxis])
        moving = np.einsum("mi,mij->mj", weights, velocity[place])
        back = rotation.conjugate(q_eb[base])
        turns = np.stack(
            [rotation.rotation_vector_from_quaternion(rotation.multiply(back, q_eb[place[:, i]])) for i in range(4)], 1
        )
        turned = rotation.quaternion_from_rotation_vector(np.einsum("mi,mij->mj", weights, turns))
        latitude, longitude, height = ecef_to_geodetic(here, self._ellipsoid)
        level = rotation.conjugate(q_en(latitude, longitude))
        state = NavState(
            latitude, longitude, height, rotation.rotate(level, moving),
            rotation.multiply(level, rotation.multiply(q_eb[base], turned)),
        )  # fmt: skip
        return self._with_samples(time, state)

    def _with_samples(self, time: Array, state: NavState) -> NavState:
        """Put the samples themselves where an instant is one, bit for bit."""
        nearest = np.searchsorted(self.time, time - _NEAR).clip(max=len(self.time) - 1)
        same = np.flatnonzero(np.abs(self.time[nearest] - time) <= _NEAR)
        for name in ("latitude", "longitude", "height", "velocity_ned", "q_nb"):
            getattr(state, name)[same] = getattr(self._truth, name)[nearest[same]]
        return state


def _weights(nodes: Array, time: Array) -> Array:
    """Return Lagrange's weights of four nodes, (M, 4)."""
    found = np.ones_like(nodes)
    for i in range(4):
        for j in range(4):
            if i != j:
                found[:, i] *= (time - nodes[:, j]) / (nodes[:, i] - nodes[:, j])
    return found


def interpolation_error(truth: SolutionStream, ellipsoid: Ellipsoid = WGS84) -> tuple[float, float]:
    """Estimate the largest error of interpolating the truth, by leaving out every other sample.

    Returns:
        Error of position, m, and of attitude, rad: a sixteenth of the errors at the samples left out, as the error of
        a cubic grows with the fourth power of the interval. NaN for fewer than 9 samples.
    """
    count = len(truth) if len(truth) % 2 else len(truth) - 1
    if count < 9 or truth.velocity_ned is None or truth.q_nb is None:
        return float("nan"), float("nan")
    rows = np.arange(0, count, max(2, 2 * (count // 40000)))
    kept = slice(0, count, 2)
    half = SolutionStream(
        truth.time[kept], truth.latitude[kept], truth.longitude[kept], truth.height[kept], truth.datum,
        truth.velocity_ned[kept], truth.q_nb[kept],
    )  # fmt: skip
    left_out = rows[rows < count - 1] + 1
    found = TruthAt(half, ellipsoid).state(truth.time[left_out])
    difference = geodetic_to_ecef(found.latitude, found.longitude, found.height, ellipsoid) - geodetic_to_ecef(
        truth.latitude[left_out], truth.longitude[left_out], truth.height[left_out], ellipsoid
    )
    angle = rotation.rotation_vector_from_quaternion(
        rotation.multiply(truth.q_nb[left_out], rotation.conjugate(found.q_nb))
    )
    sizes = np.linalg.norm(difference, axis=1).max(), np.linalg.norm(angle, axis=1).max()
    return float(sizes[0]) / 16.0, float(sizes[1]) / 16.0
