"""The base class of every kind of measurement: residual, H and noise of the readings of an aiding sensor.

The residual is what inertial navigation predicts less the reading, so that to first order residual = H x + noise with
the errors x of `sinssim.estimation.model`, relative to north; `observe` refers H to the axes of the model. A sensor's
own bias b and scale factor k belong to the reading, (1 + k) z + b, and enter H with the opposite sign.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import ClassVar, Literal

import numpy as np

from sinssim import rotation
from sinssim.data import Array, Measurements, NavState
from sinssim.earth.models import Ellipsoid
from sinssim.estimation.dynamics import PHI, R, earth_rate, earth_rate_slope, rate_error, skew
from sinssim.estimation.earth_dynamics import refer_to_transported
from sinssim.estimation.model import ErrorModel
from sinssim.sensors.aiding.registry import KINDS, load_class


@dataclass(frozen=True)
class Prediction:
    """Inertial navigation at the instants of some readings.

    Attributes:
        state: M rows.
        rate_b: inertial rate of the body, or its mean over the reading's interval, (M, 3) rad/s.
        ellipsoid: reference ellipsoid.
        sensed: of a block that turns in the vehicle, the rate that its gyros sense, (M, 3) rad/s, and C_vb, which
            takes its axes into the vehicle's, (M, 3, 3); None for a block that does not turn.
    """

    state: NavState
    rate_b: Array
    ellipsoid: Ellipsoid
    sensed: tuple[Array, Array] | None = None


@dataclass(frozen=True)
class Comparison:
    """The predicted quantities that readings of one sensor are compared with.

    Attributes:
        prediction: inertial navigation at their instants.
        model: the error model.
        parameters: values of the sensors' compensated parameters, by block.
        label: name of the sensor.
        lever_arm: from the block to the sensor, body axes, (3,) m.
    """

    prediction: Prediction
    model: ErrorModel
    parameters: Mapping[str, Array]
    label: str
    lever_arm: Array

    @property
    def state(self) -> NavState:
        """Inertial navigation, M rows."""
        return self.prediction.state

    @property
    def ellipsoid(self) -> Ellipsoid:
        """Reference ellipsoid."""
        return self.prediction.ellipsoid

    @cached_property
    def c_nb(self) -> Array:
        """Attitude, from body axes to north, east, down, (M, 3, 3)."""
        return rotation.dcm_from_quaternion(self.state.q_nb)

    @property
    def c_bn(self) -> Array:
        """Its transpose, (M, 3, 3)."""
        return np.asarray(self.c_nb.transpose(0, 2, 1))

    def zeros(self, components: int) -> Array:
        """Return an H of zeros, (M, components, n)."""
        return np.zeros((len(self.c_nb), components, self.model.size))

    def states(self, error: str) -> slice | None:
        """Return the place of the states of the sensor's own error, for example "bias"; None if the model has none."""
        return self.model.slices.get(f"{self.label} {error}")

    def known(self, error: str) -> Array:
        """Return the compensated part of the sensor's own error."""
        return self.parameters[f"{self.label} {error}"]

    def turning(self) -> Array:
        """Return the rate relative to the Earth in body axes, (M, 3) rad/s."""
        rate = earth_rate(self.state.latitude, self.ellipsoid)
        return np.asarray(self.prediction.rate_b - np.einsum("kij,kj->ki", self.c_bn, rate))

    def turning_error(self) -> Array:
        """Return W: W x is the error of that rate, (M, 3, n).

        It contains the gyros' errors and the errors of the resolved Earth rate by errors of attitude and position.
        """
        state, ellipsoid = self.state, self.ellipsoid
        if self.prediction.sensed is None:
            out = rate_error(self.model, self.prediction.rate_b)
        else:
            rate, c_vb = self.prediction.sensed
            out = c_vb @ rate_error(self.model, rate)
        out[:, :, PHI] += self.c_bn @ skew(earth_rate(state.latitude, ellipsoid))
        out[:, :, R] -= self.c_bn @ earth_rate_slope(state.latitude, state.height, ellipsoid)
        return out


class MeasurementKind:
    """A kind of measurement.

    Attributes:
        columns: names of the reading's components with their units, as in the recorded streams.
        axes: axes of the residual and of sigma, as in the streams; "" for a single one.
        unit: unit of the residual, as in the streams.
        rounding: the inertial sensors whose pulse rounding is in the predicted quantity.
        mean_rate: whether the reading is compared with the gyros' mean rate since the previous reading.
        needs_rate: whether the reading is compared with the body's rate even without a lever arm.
        at_antenna: whether the reading is that of the satellite antenna, so that the states "gnss lever arm" apply.
        on_gnss_clock: whether the satellite receiver stamps the reading, so that the state "gnss time offset" applies.
        own_errors: axes and unit, as in the streams, of errors that only sensors of this kind have.
        diagnosed: own errors that a diagnosis tries as states, with a wide 1σ in SI; for example a bias.
        of_north: whether the reading depends on the direction of north, so that it has no meaning at a pole.
        turns_with_north: whether H is that of errors relative to north, which `observe` refers to the model's axes;
            False if it is the same in all axes, as for a velocity of zero.
        velocities: number of the first components that are velocities or rates, whose sign changes in reverse time.
    """

    columns: ClassVar[tuple[str, ...]]
    axes: ClassVar[tuple[str, ...]]
    unit: ClassVar[str]
    rounding: ClassVar[Literal["gyros", "accelerometers"] | None] = None
    mean_rate: ClassVar[bool] = False
    needs_rate: ClassVar[bool] = False
    at_antenna: ClassVar[bool] = False
    on_gnss_clock: ClassVar[bool] = False
    own_errors: ClassVar[Mapping[str, tuple[tuple[str, ...], str]]] = {}
    diagnosed: ClassVar[Mapping[str, float]] = {}
    of_north: ClassVar[bool] = False
    turns_with_north: ClassVar[bool] = True
    velocities: ClassVar[int] = 0

    @property
    def components(self) -> int:
        """Number of the reading's components."""
        return len(self.columns)

    @property
    def errors(self) -> int:
        """Number of components of the residual and of sigma."""
        return len(self.axes)

    def compare(self, at: Comparison, value: Array) -> tuple[Array, Array]:
        """Compare readings, free of the sensor's known errors, with inertial navigation.

        Args:
            at: the predicted quantities.
            value: M readings, (M, components).

        Returns:
            Residuals, prediction less reading, (M, errors), and H, (M, errors, n), zero for the sensor's own errors.
        """
        raise NotImplementedError

    def less_bias(self, value: Array, bias: Array) -> Array:
        """Return readings less a bias of the sensor, (M, components)."""
        return value - bias

    def observe(self, at: Comparison, value: Array) -> tuple[Array, Array]:
        """Return residuals and H of readings, with the sensor's own bias and scale factor.

        Args:
            at: the predicted quantities.
            value: M readings of the sensor, (M, components).

        Returns:
            Residuals, (M, errors), and H, (M, errors, n).
        """
        bias, scale = at.states("bias"), at.states("scale")
        if bias is not None:
            value = self.less_bias(value, at.known("bias"))
        if scale is None:
            residual, h = self.compare(at, value)
        else:
            # (1 + k) z + b is linear in k at the predicted z; the reading over 1 + k is not, and its noise is less
            gain = 1.0 + at.known("scale")
            residual, h = self.compare(at, value / gain)
            predicted = residual + value / gain
            residual, h = gain * residual, gain * h
            h[:, :, scale] -= predicted[:, :, None]
        if bias is not None:
            h[:, :, bias] -= np.eye(self.errors)
        return residual, h

    def noise(self, model: ErrorModel, interval: Array) -> Array:
        """Return the contribution of the inertial sensors' noise to R.

        The rounding of the last pulse is independent from sample to sample in velocity and attitude, with the variance
        Q²/12. The random walk is process noise.

        Args:
            model: the error model.
            interval: time from the previous reading to each, (M,) s.

        Returns:
            Variance of every component, (M,).
        """
        quanta = {"gyros": model.gyro_quantum, "accelerometers": model.accel_quantum, None: 0.0}
        return np.full(len(interval), quanta[self.rounding] ** 2 / 12.0)

    def fault(self, value: Array) -> str:
        """Return the reason why a reading cannot be used, "" if it can.

        Args:
            value: the reading, with finite components, (components,).
        """
        return ""


def delays(kind: MeasurementKind, label: str, model: ErrorModel) -> list[str]:
    """Return the names of the blocks that describe by how much readings of a sensor are stamped too late.

    Args:
        kind: kind of the readings.
        label: name of the sensor.
        model: the error model.
    """
    own = [f"{label} delay", *(["gnss time offset"] if kind.on_gnss_clock else [])]
    return [name for name in own if name in model.slices]


def measurement_kind(name: str) -> MeasurementKind:
    """Return a kind of measurement by its name.

    Args:
        name: one of `sinssim.sensors.aiding.registry.KINDS`.

    Returns:
        The kind.

    Raises:
        InputError: the name is unknown, or its file cannot be used.
    """
    entry = KINDS.check(name)
    return _loaded(entry) if isinstance(entry, str) else _own(entry)


@cache
def _own(kind: type[MeasurementKind]) -> MeasurementKind:
    return kind()


@cache
def _loaded(entry: str) -> MeasurementKind:
    return load_class("sinssim.estimation.measurements", entry, MeasurementKind)()


def observe(
    measurements: Measurements, prediction: Prediction, model: ErrorModel, parameters: Mapping[str, Array]
) -> tuple[Array, Array]:
    """Return residuals and H of readings.

    Args:
        measurements: M readings of one sensor.
        prediction: inertial navigation at their instants.
        model: the error model.
        parameters: values of the sensors' compensated parameters, by block.

    Returns:
        Residuals, prediction less reading, (M, k), and H, (M, k, n).
    """
    kind = measurement_kind(measurements.kind)
    arm = np.asarray(measurements.lever_arm, dtype=np.float64)
    if kind.at_antenna and "gnss lever arm" in model.slices:
        arm = arm + parameters["gnss lever arm"]
    at = Comparison(prediction, model, parameters, measurements.label, arm)
    residual, h = kind.observe(at, measurements.value)
    if model.axes == "transported" and kind.turns_with_north:
        refer_to_transported(h, prediction.state, prediction.ellipsoid)
    return residual, h
