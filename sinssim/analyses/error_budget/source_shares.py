"""All sources of a scenario and their places in the propagation, shared by unaided and aided budgets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim.analyses.error_budget.error_sources import (
    AngleError,
    Column,
    Constants,
    InertialNoise,
    InitialErrors,
    Source,
)
from sinssim.analyses.error_budget.propagation import Propagation
from sinssim.data import Array
from sinssim.sensors.imu.error_term_table import FIELDS
from sinssim.sensors.measurement_kind import CORE

_BIASES = [Column(triad, axis, axis, axis, FIELDS["bias"]) for triad in (0, 1) for axis in np.eye(3)]


@dataclass(frozen=True)
class SensorConstant:
    """Constant errors of an aiding sensor's readings.

    Attributes:
        source: the source.
        block: block of states of the truth's model.
        sigma: 1σ of each component, SI.
    """

    source: Source
    block: str
    sigma: Array


@dataclass(frozen=True)
class SensorProcess:
    """A Gauss-Markov error of an aiding sensor's readings.

    Attributes:
        source: the source.
        block: block of states of the truth's model.
        sigma: 1σ of each component, SI.
        correlation_time: s.
    """

    source: Source
    block: str
    sigma: Array
    correlation_time: float


@dataclass(frozen=True)
class SensorNoise:
    """White noise of an aiding sensor's readings, for one kind of measurement.

    Attributes:
        source: the source.
        label: name of the readings.
        sigma: true 1σ of each component, SI.
    """

    source: Source
    label: str
    sigma: Array


@dataclass(frozen=True)
class SensorGiven:
    """Errors of an aiding sensor's readings that are the same in every run.

    Attributes:
        source: the source.
        label: name of the readings.
    """

    source: Source
    label: str


@dataclass(frozen=True)
class SensorAngle:
    """An error of the angles of a rotating IMU, for a filter whose readings are those of the vehicle.

    Attributes:
        source: the source.
        error: the error.
    """

    source: Source
    error: AngleError


SensorSource = SensorConstant | SensorProcess | SensorNoise | SensorGiven | SensorAngle


class Shares:
    """The columns and covariances of all sources.

    The constant columns are those of the inertial sensors, of the series, of the initial errors, and of the aiding
    sensors, in this order.
    """

    def __init__(
        self,
        constants: Constants,
        noises: list[InertialNoise],
        series: list[Source],
        initial: InitialErrors,
        sensors: list[SensorSource],
    ) -> None:
        """Lay out the columns.

        Args:
            series: sources of one run, in the order of the given readings.
        """
        self.noises, self.initial, self.sensors = noises, initial, sensors
        self.sources = [*constants.sources, *(n.source for n in noises), *series, *initial.sources]
        self.sources += [s.source for s in sensors]
        self.kernel_columns: list[Column | int] = [*constants.columns, *range(len(series)), *_BIASES]
        self.inertial = len(constants.columns) + len(series)
        self.parts = dict(constants.parts)
        for k, source in enumerate(series):
            self.parts[source.name] = ([len(constants.columns) + k], np.ones(1))
        self.starts: dict[int, Array] = {}
        self.of_block: dict[str, int] = {}
        self.of_label: dict[str, int] = {}
        count = self.inertial
        for name, start in initial.parts.items():
            columns = list(range(count, count + start.shape[1]))
            self.starts |= dict(zip(columns, start.T, strict=True))
            self.parts[name] = (columns, np.ones(len(columns)))
            count += len(columns)
        for sensor in sensors:
            if isinstance(sensor, SensorConstant):
                self.of_block[sensor.block] = count
                self.parts[sensor.source.name] = (list(range(count, count + len(sensor.sigma))), sensor.sigma)
                count += len(sensor.sigma)
            elif isinstance(sensor, SensorGiven):
                self.of_label[sensor.label] = count
                self.parts[sensor.source.name] = ([count], np.ones(1))
                count += 1
            elif isinstance(sensor, SensorAngle) and sensor.error.what != "noise":
                own = list(range(count, count + len(sensor.error.size)))
                self.parts[sensor.source.name] = (own, sensor.error.size)
                count += len(own)
        self.count = count

    def begin(self, core: int) -> Propagation:
        """Return the propagation at the start, with the initial errors."""
        white = [n.source.name for n in self.noises if n.process is None]
        white += [s.source.name for s in self.sensors if isinstance(s, SensorNoise)]
        white += [s.source.name for s in self.sensors if isinstance(s, SensorAngle) and s.error.what == "noise"]
        propagation = Propagation.start(core, self.count, white)
        for column, start in self.starts.items():
            propagation.sensitivity[:CORE, column] = start
        for noise in self.noises:
            if noise.process is not None:
                sizes = np.full(3, noise.size) if noise.sizes is None else noise.sizes
                propagation.add(noise.source.name, noise.process, sizes, noise.triad, noise.mix)
        for sensor in self.sensors:
            if isinstance(sensor, SensorProcess):
                from sinssim.analyses.error_budget.propagation import GaussMarkov

                propagation.add(sensor.source.name, GaussMarkov(sensor.correlation_time), sensor.sigma, None)
        return propagation

    def random(self, source: Source) -> bool:
        """Return whether a source differs from run to run."""
        return source.kind == "random"
