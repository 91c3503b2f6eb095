"""The interface of every source of true motion: a continuous trajectory, and the exact increments along it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from sinssim.truth.sampling import BlockMotion, Channel, FlightEvent

if TYPE_CHECKING:
    from sinssim.data import Array, ImuData, NavState
    from sinssim.earth.ellipsoids import Ellipsoid
    from sinssim.truth.track_curve import TrackCurve


class Trajectory(Protocol):
    """The true motion of a sensor block, known at all times between `start` and `end`.

    Attributes:
        start: first time, s.
        end: last time, s.
        events: events along the motion, in order of time.
        gravity: name of the gravity model of the specific force.
        ellipsoid: reference ellipsoid of heights and gravity.
        channels: other logged quantities by name.
    """

    @property
    def start(self) -> float: ...
    @property
    def end(self) -> float: ...
    @property
    def events(self) -> tuple[FlightEvent, ...]: ...
    @property
    def gravity(self) -> str: ...
    @property
    def ellipsoid(self) -> Ellipsoid: ...
    @property
    def channels(self) -> Mapping[str, Channel]: ...

    def state(self, t: ArrayLike) -> NavState:
        """Return position, velocity and attitude of the sensor block.

        Args:
            t: times, () or (N,) s.

        Returns:
            The state at those times, in arrays of the same leading shape.

        Raises:
            InputError: a time lies outside [start, end].
        """
        ...

    def increments(self, rate_hz: float) -> ImuData:
        """Return the increments of an ideal IMU over consecutive intervals of 1/rate_hz.

        Args:
            rate_hz: samples per second.

        Returns:
            Integrals of inertial angular rate and specific force; edges at start + k/rate_hz up to `end`.

        Raises:
            InputError: the rate is not positive and finite, or an interval is longer than the trajectory.
        """
        ...

    def rates(self, t: ArrayLike) -> tuple[Array, Array]:
        """Return the outputs of ideal rate sensors at given times.

        Args:
            t: times, () or (N,) s.

        Returns:
            Inertial angular rate ω_ib^b, (..., 3) rad/s, and specific force f^b, (..., 3) m/s², both in the
            sensor block's axes.

        Raises:
            InputError: a time lies outside [start, end].
        """
        ...

    if not TYPE_CHECKING:  # of the interface; a type checker would ask every trajectory for it

        @staticmethod
        def from_samples(
            time: ArrayLike,
            latitude: ArrayLike,
            longitude: ArrayLike,
            height: ArrayLike,
            quaternion: ArrayLike | None = None,
            **options: Any,
        ) -> TrackCurve:
            """Return the smooth exact motion along recorded samples: the motion; time 0 is the first sample. Its
            attribute `fit` says how far it passes from the samples.

            Args:
                time: instants, increasing, (N,) s.
                latitude, longitude: geodetic, (N,) rad.
                height: above the ellipsoid, (N,) m; NaN where unknown.
                quaternion: attitude q_nb, scalar first, v_n = C_nb v_b, (N, 4); it follows from the motion if not
                    given.
                options: `vehicle`, `smoothing_s` and others, see `sinssim.truth.track_curve.from_samples`.
            """
            from sinssim.truth.track_curve import from_samples

            return from_samples(time, latitude, longitude, height, quaternion, **options)


class DerivedMotion(BlockMotion):
    """A motion derived from another one, `base`, with its times, events, gravity model and other quantities."""

    def __init__(self, base: Trajectory) -> None:
        self.base = base
        self.start, self.end = base.start, base.end
        self.events, self.channels = base.events, base.channels
        self.gravity, self.ellipsoid = base.gravity, base.ellipsoid
        # instants at which a derivative of the motion may jump, s, and its fastest oscillation, rad/s
        self.breaks = np.asarray(getattr(base, "breaks", ()), dtype=np.float64)
        self.fastest = float(getattr(base, "fastest", 0.0))
