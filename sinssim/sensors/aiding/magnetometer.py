"""A magnetic compass: the block's heading with errors of the declination and of hard iron, and noise.

The compass measures the magnetic heading ψ − D, and the navigator adds the declination that it takes. Its error of the
heading is then d + D_taken − D(p) with the World Magnetic Model's D(p) at the vehicle's place and a random constant d,
the error of the model. With "wmm" the navigator takes D(p), with "start" that of the motion's beginning.

The coefficients and the synthesis of the World Magnetic Model (WMM) are those of the package `pygeomag`. Each model
serves five years: WMM-2015v2 from 2015.0, WMM-2020 from 2020.0, WMM-2025 from 2025.0 to 2030.0. The model describes the
field of the core; its stated 1σ of the declination, which contains the field of the crust, is √(0.26² + (5417 nT/H)²)
degrees with the horizontal intensity H (WMM2025 report, NOAA NCEI).
"""

from __future__ import annotations

import calendar
import datetime
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BeforeValidator, Field

from sinssim import rotation
from sinssim.data import Array, NavState
from sinssim.errors import InputError
from sinssim.sensors.aiding_sensor import AidingReadings, AidingSensor, SensorState, Vehicle, turn_on, white
from sinssim.sensors.measurement_kind import Comparison, MeasurementKind, compare_heading
from sinssim.toml_section import Noise, Offset, Spread
from sinssim.units import DEG

if TYPE_CHECKING:
    from sinssim.truth.trajectory import Trajectory

VALID = (2015.0, 2030.0)
"""First and last decimal year of the models."""

BLACKOUT = 2e-6
"""Horizontal field below which a compass is useless: the blackout zone of the WMM, T."""

_KNOT = 200.0
"""Distance between places at which the model is evaluated, m."""

_RADIUS = 6.371e6
_NANO = 1e-9


def decimal_year(date: float | str) -> float:
    """Return a date, "YYYY-MM-DD" or a decimal year, as a decimal year."""
    if isinstance(date, str):
        try:
            day = datetime.date.fromisoformat(date)
        except ValueError as error:
            raise InputError(f'{date!r} is not a date; give a decimal year or "YYYY-MM-DD"') from error
        elapsed = day.timetuple().tm_yday - 1
        year = day.year + elapsed / (366 if calendar.isleap(day.year) else 365)
    else:
        year = date  # not converted yet: an integer may be too large
    if not VALID[0] <= year <= VALID[1]:
        raise InputError(
            f"{date!r} is outside the validity of the World Magnetic Model, which is known here from {VALID[0]} to "
            f"{VALID[1]}"
        )
    return float(year)


def magnetic_field(latitude: ArrayLike, longitude: ArrayLike, height: ArrayLike, year: float) -> Array:
    """Return the main field, north, east, down, (..., 3) T, at geodetic places on WGS-84 in a decimal year of
    `VALID`."""
    from pygeomag import GeoMag

    first = min(5 * int(decimal_year(year) // 5), int(VALID[1]) - 5)  # 2030.0 is the end of WMM-2025
    model = GeoMag(base_year=first)
    lat, lon, h = np.broadcast_arrays(np.degrees(latitude), np.degrees(longitude), height)
    out = np.empty((lat.size, 3))
    for i, (phi, lam, z) in enumerate(zip(lat.flat, lon.flat, h.flat, strict=True)):
        field = model.calculate(float(phi), math.remainder(lam, 360.0), 1e-3 * float(z), year)
        out[i] = field.x, field.y, field.z
    return _NANO * out.reshape(*lat.shape, 3)


def field_along(latitude: Array, longitude: Array, height: Array, year: float) -> Array:
    """Return the main field along a path of geodetic points on WGS-84, (M,): north, east, down, (M, 3) T. It is
    evaluated every 200 m and interpolated in Earth-fixed axes between."""
    axes = _axes(latitude, longitude)
    gone = np.concatenate(
        ([0.0], np.cumsum(np.linalg.norm(np.diff(axes[:, 2] * (_RADIUS + height)[:, None], axis=0), axis=1)))
    )
    # a point is a knot if it is the first of its stretch of 200 m, or the last of the path
    knot = np.flatnonzero(np.diff(np.floor(gone / _KNOT), prepend=-1.0))
    knot = np.unique(np.append(knot, len(gone) - 1))
    ned = magnetic_field(latitude[knot], longitude[knot], height[knot], year)
    fixed = np.einsum("kij,ki->kj", axes[knot], ned)
    between = np.column_stack([np.interp(gone, gone[knot], axis) for axis in fixed.T])
    return np.asarray(np.einsum("kij,kj->ki", axes, between))


def _axes(latitude: Array, longitude: Array) -> Array:
    """Return the axes north, east, down in Earth-fixed axes, one in each row, (M, 3, 3)."""
    s, c, sl, cl = np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude)
    rows = [[-s * cl, -s * sl, c], [-sl, cl, np.zeros_like(s)], [-c * cl, -c * sl, -s]]
    return np.moveaxis(np.array(rows), 2, 0)


_EPOCH = 2025.0
_FORWARD = np.array([1.0, 0.0, 0.0])

_MODEL_SIGMA_DEG = 0.4
"""Stated 1σ of WMM-2025 at a horizontal field of 18 µT, that of latitudes of about 55 degrees."""


_INSTANTS = 101
"""Instants of a motion at which its change is evaluated for the filter."""


def _date(value: Any) -> Any:
    """Return a date as a decimal year or as text; raise ValueError if the model is not valid then."""
    if isinstance(value, datetime.date):  # a date of TOML
        value = value.isoformat()[:10]
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError('give a decimal year or "YYYY-MM-DD"')
    decimal_year(value)
    return float(value) if isinstance(value, int) else value


Date = Annotated[float | str, BeforeValidator(_date)]
"""Decimal year, or "YYYY-MM-DD"."""


def _heading(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare the heading of the forward axis; the deviation A sin ψ + B cos ψ is an error of the reading."""
    deviation, wave = at.states("deviation"), np.zeros(0)
    if deviation is not None:
        north, east = at.c_nb[:, :2, 0].T
        wave = at.c_nb[:, 1::-1, 0] / np.hypot(north, east)[:, None]  # sin ψ, cos ψ
        value = value - wave @ at.known("deviation")[:, None]
    residual, h = compare_heading(at, value, _FORWARD)
    if deviation is not None:
        h[:, 0, deviation] -= wave
    return residual, h


class Magnetometer(AidingSensor):
    """A magnetic compass, which measures the heading of the sensor block after correction for declination."""

    kinds: ClassVar = (
        MeasurementKind(
            "heading",
            columns=("heading_rad",),
            unit="rad",
            compare=_heading,
            rounding="gyros",
            own_errors={"deviation": (("sin", "cos"), "rad")},
            diagnosed={"bias": 1.0},
            of_north=True,
        ),
    )

    sigma_deg: Noise = Field(default=0.5, description="white noise")
    bias_deg: Offset | None = Field(default=None, description="given error of declination and mounting")
    bias_sigma_deg: Spread = Field(default=0.0, description="1σ of a random error, added to the given one")
    deviation_sigma_deg: Spread = Field(
        default=0.0, description="1σ of each of the two coefficients of A sin ψ + B cos ψ (hard iron)"
    )
    declination: Literal["exact", "wmm", "start"] = Field(
        default="exact",
        description="declination for the correction of the magnetic heading: exact, the true declination; wmm, that "
        "of the World Magnetic Model at the position of the vehicle; start, that of the model at the start, which "
        "ignores the change along the path",
    )
    date: Date = Field(
        default=_EPOCH, description="date for the model, as a decimal year or YYYY-MM-DD, from 2015.0 to 2030.0"
    )
    declination_sigma_deg: Spread = Field(
        default=0.0, description="1σ of the constant error of the model; default: 0.4 with wmm and start"
    )

    rules = (
        (lambda s: s.declination == "exact" and s.changed("date", "declination_sigma_deg"),
         '{it} would have no effect: the declination is exact. Add declination = "wmm" or "start", or remove {it}'),
    )  # fmt: skip

    @classmethod
    def normalized(cls, data: dict[str, Any]) -> dict[str, Any]:
        """Add the stated 1σ of the model where the model is used."""
        used = data.get("declination") in ("wmm", "start")
        return {"declination_sigma_deg": _MODEL_SIGMA_DEG, **data} if used else data

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return headings ψ + b + D_taken − D + A sin ψ + B cos ψ + ν, where b contains the error of the model."""
        s, trajectory, seed = self, vehicle.trajectory, vehicle.seed
        time = s.epochs(trajectory)
        state = trajectory.state(time)
        heading = rotation.euler_from_quaternion(state.q_nb)[2]
        bias = np.array([turn_on(seed, "magnetometer bias", s.bias_deg, s.bias_sigma_deg)])
        if s.declination != "exact":
            bias += turn_on(seed, "magnetometer declination", None, s.declination_sigma_deg)
            change = s._change_deg(trajectory.state(np.array([trajectory.start])), state)
            if s.declination == "start":
                bias = bias - change[:, np.newaxis]
        a, b = (turn_on(seed, "magnetometer deviation", None, s.deviation_sigma_deg, i) for i in range(2))
        error = DEG * (bias + (a * np.sin(heading))[:, np.newaxis] + (b * np.cos(heading))[:, np.newaxis])
        true = {"magnetometer bias": DEG * bias, "magnetometer deviation": DEG * np.array([a, b])}
        noise = DEG * white(seed, "magnetometer noise", (s.sigma_deg,), len(time))
        value = np.mod(heading[:, np.newaxis] + error + noise, 2.0 * np.pi)
        return [s.readings("magnetometer", "heading", time, value, (DEG * s.sigma_deg,), true)]

    def _change_deg(self, first: NavState, state: NavState) -> Array:
        """Return the declination of the model at the readings, less that at the start, (M,) deg."""
        path = [np.append(getattr(first, name), getattr(state, name)) for name in ("latitude", "longitude", "height")]
        north, east, _ = field_along(path[0], path[1], path[2], decimal_year(self.date)).T
        level = np.hypot(north, east)
        weakest = int(np.argmin(level))
        if level[weakest] < BLACKOUT:
            raise InputError(
                f'aiding.magnetometer.declination = "{self.declination}": the horizontal magnetic field falls to '
                f"{1e9 * level[weakest]:.0f} nT at latitude {path[0][weakest] / DEG:.1f}°, longitude "
                f"{path[1][weakest] / DEG:.1f}°. Below {1e9 * BLACKOUT:.0f} nT no compass can be used: remove "
                "[aiding.magnetometer], or choose another route."
            )
        declination = np.unwrap(np.arctan2(east, north))
        return np.asarray(declination[1:] - declination[0]) / DEG

    def largest_change(self, trajectory: Trajectory) -> float:
        """Return the largest change of the declination along a motion that the navigator does not follow, rad; 0 unless
        the declination is that of the start."""
        if self.declination != "start":
            return 0.0
        state = trajectory.state(np.linspace(trajectory.start, trajectory.end, _INSTANTS))
        first = trajectory.state(np.array([trajectory.start]))
        return float(DEG * np.abs(self._change_deg(first, state)).max())

    def states(self) -> Iterator[SensorState]:
        """Yield the states of the constant error and of the deviation's two coefficients."""
        sigma = math.hypot(self.bias_sigma_deg, self.bias_deg or 0.0, self.declination_sigma_deg)
        yield SensorState("magnetometer bias", (DEG * sigma,), key="bias_sigma_deg")
        yield SensorState("magnetometer deviation", (DEG * self.deviation_sigma_deg,) * 2)
