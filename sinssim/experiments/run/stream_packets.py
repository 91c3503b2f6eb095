"""What the sensors of a finished run send, as packets with their instants: JSON, NMEA, MAVLink or the binary protocol.

Inertial samples go out at the end of their interval, and measurements when they arrive. MAVLink is that of the common
message set, https://mavlink.io/en/messages/common.html.
"""

from __future__ import annotations

import heapq
import json
import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sinssim import rotation
from sinssim.data import Array, ImuData, Measurements, NavSolution, NavState
from sinssim.earth.ellipsoids import ellipsoid_by_name
from sinssim.errors import InputError
from sinssim.experiments.run.finished_runs import FinishedRun
from sinssim.logs.formats import DEFAULT_START
from sinssim.logs.formats.export_streams import Content, choose, date_of_run
from sinssim.logs.formats.nmea_ubx import MOST_HZ, nmea_instants
from sinssim.logs.gps_time import WEEK, parse_date
from sinssim.logs.recorded_streams import FixStream
from sinssim.logs.stored_run import STATE_COLUMNS, RecordedRun
from sinssim.scenario import Scenario, filter_model, load_scenario
from sinssim.sensors.aiding_registry import KINDS
from sinssim.sensors.measurement_kind import earth_rate
from sinssim.simulation.navigator_protocol import WITHIN, Feed
from sinssim.system.files import Draft
from sinssim.truth.atmosphere import Air
from sinssim.truth.flight.flight_log import FlightLog
from sinssim.truth.flight.guidance import TRUTH
from sinssim.units import DEG, G0

if TYPE_CHECKING:
    from sinssim.simulation.guided_passes import LiveFlight

_INCREMENTS = tuple(f"{word}_{axis}_{unit}" for word, unit in (("dtheta", "rad"), ("dvel", "mps")) for axis in "xyz")
_BLOCK = 256
"""Samples that are prepared together, in much less than the time between two."""
_KELVIN = 273.15
_TRUTH_HZ = 50.0
"""Most HIL_STATE_QUATERNION a second."""
_SYSTEM, _COMPONENT = 1, 191
"""Sender of MAVLink: the first system, and its on-board computer, which is no autopilot."""


class Packet(NamedTuple):
    """What is sent together."""

    time: float  # instant at which it is due, on the run's clock, s
    kind: str
    data: bytes


@dataclass(frozen=True)
class Streamed:
    """The readings of a run that are sent."""

    content: Content  # the run with the date of its time 0
    imu: ImuData  # increments
    together: int = 1  # number of samples of the run in each of these, if their rate is limited

    @property
    def run(self) -> RecordedRun:
        """The run."""
        return self.content.run

    @property
    def duration(self) -> float:
        """Time from the first to the last packet, s."""
        return self.end - float(self.imu.time[0])

    @property
    def end(self) -> float:
        """End of the last sample, s."""
        return float(self.imu.time[-1])

    @cached_property
    def start(self) -> tuple[float, NavState]:
        """Instant and state from which the run navigates."""
        if not self.run.algorithms:
            raise InputError(f"{self.run.path} has no solution, whose start a navigator could begin with.")
        s = self.run.solution(self.run.algorithms[0])
        assert s.velocity_ned is not None
        assert s.q_nb is not None
        return float(s.time[0]), NavState(s.latitude[0], s.longitude[0], s.height[0], s.velocity_ned[0], s.q_nb[0])

    @property
    def sensors(self) -> list[str]:
        """Names of the aiding sensors' streams, without `aiding_`."""
        return self.run.streams("aiding_")

    def readings(self, name: str) -> dict[str, Array]:
        """Return the columns of a sensor's readings up to their arrival, those that arrive during the run, in order."""
        table = self.run.table(f"aiding_{name}")
        columns = list(table)[: list(table).index("arrival_s") + 1]
        order = np.argsort(table["arrival_s"], kind="stable")
        kept = order[table["arrival_s"][order] <= self.end + WITHIN]
        return {column: table[column][kept] for column in columns}

    def fixes(self, name: str) -> tuple[Array, FixStream]:
        """Return the instants at which a receiver's fixes arrive during the run, (N,) s, and the fixes."""
        fixes, table = self.content.fix(name), self.run.table(f"aiding_{name}_position")
        rows = np.flatnonzero(table["arrival_s"] <= self.end + WITHIN)
        return table["arrival_s"][rows], fixes.rows(rows)


def streamed(run: RecordedRun, start: str | None = None, rate_hz: float | None = None) -> Streamed:
    """Return what a run sends. `start`: date of the run's time 0, UTC; by default that of the log, or of exports;
    `rate_hz`: largest rate of the inertial samples; the increments of several are added."""
    content = choose(run, date_of_run(run, start), [], None)
    readings = content.imu
    assert readings.interval is not None  # those of a run
    edges = np.concatenate((readings.time[:1] - readings.interval[0, 0], readings.time))
    every = 1
    if rate_hz is not None:
        if not 0.0 < rate_hz < math.inf:
            raise InputError(f"--rate {rate_hz:g}: the rate of samples must be positive, in hertz.")
        every = max(1, math.ceil(1.0 / (rate_hz * float(np.median(np.diff(edges)))) - 1e-6))
    count = len(readings) // every
    if not count:
        raise InputError(f"{run.path} has no inertial sample of 1/{rate_hz:g} s.")
    dtheta, dvel = (
        values[: count * every].reshape(count, every, 3).sum(axis=1) for values in (readings.gyro, readings.accel)
    )
    return Streamed(content, ImuData(edges[: count * every + 1 : every], dtheta, dvel), every)


@contextmanager
def readings_of(
    name: str, settings: Sequence[str], start: str | None, rate_hz: float | None, *, progress: bool = False
) -> Iterator[Streamed]:
    """Yield what a run sends, given its directory, or a scenario, which is computed first; otherwise as `streamed`.
    `settings`: settings "key=value" of a scenario."""
    if Path(name).is_dir():
        if settings:
            raise InputError(f"--set changes a scenario, and {name} is a run that is computed already.")
        yield streamed(RecordedRun(FinishedRun(Path(name)).path), start, rate_hz)
        return
    scenario = _streamed_scenario(name, settings)
    if scenario.one_component is not None:
        raise InputError(f"{scenario.name} is a motion of one component, which has no position on the Earth to send.")
    with computed(scenario, start, rate_hz, progress=progress) as sent:
        yield sent


def _streamed_scenario(name: str, settings: Sequence[str]) -> Scenario:
    return load_scenario(name, [*settings, 'recording.keep="streams"', 'recording.detail="none"'])


@contextmanager
def computed(
    scenario: Scenario, start: str | None, rate_hz: float | None = None, flown: FlightLog | None = None,
    *, progress: bool = False,
) -> Iterator[Streamed]:  # fmt: skip
    """Yield what a run of a scenario sends, which is computed, along a flight that has been flown if one is given."""
    from sinssim.experiments.run.run_execution import run

    with Draft(name="stream") as folder:
        place = run(scenario, folder.path / scenario.name, progress=progress, flown=flown).directory
        assert place is not None
        yield streamed(RecordedRun(place), start, rate_hz)


def live_scenario(name: str, settings: Sequence[str], form: str, rate_hz: float | None, *, listens: bool) -> Scenario:
    """Return the scenario of a flight that the answers of a navigator are to guide; raise InputError if they cannot."""
    if not listens:
        raise InputError("--guide: the answers of a navigator guide the flight; give --listen.")
    if form != "binary" or rate_hz is not None:
        raise InputError("--guide needs the protocol with navigators: give --as binary, without --rate.")
    if Path(name).is_dir():
        raise InputError(f"--guide flies a scenario, and {name} is a run that is flown already.")
    scenario = _streamed_scenario(name, settings)
    if scenario.flight is None or scenario.flight.guidance.source != TRUTH:
        raise InputError(f'--guide needs a [flight], with flight.guidance.source = "{TRUTH}".')
    if scenario.navigation.alignment is not None:
        raise InputError("--guide: the navigator begins at once; remove [navigation.alignment].")
    return filter_model.with_states(scenario)


def _line(kind: str, time: float, columns: Sequence[str], values: Sequence[float]) -> Packet:
    """Return a JSON object as a line; what is not known is null."""
    known = (value if math.isfinite(value) else None for value in values)
    text = json.dumps({"type": kind, **dict(zip(columns, known, strict=True))}, allow_nan=False)
    return Packet(time, kind, text.encode() + b"\n")


def json_packets(of: Streamed, pace: float = 1.0) -> Iterator[Packet]:
    """Yield lines of JSON: the state that the run navigates from, samples, readings, the end."""
    imu, (begin, s) = of.imu, of.start
    first = float(imu.time[0])
    state = [float(v) for v in (begin, s.latitude, s.longitude, s.height, *s.velocity_ned, *s.q_nb)]
    yield _line("begin", first, ("time_s", *STATE_COLUMNS), state)

    def samples() -> Iterator[Packet]:
        columns = ("time_s", "interval_s", *_INCREMENTS)
        for k in range(0, len(imu), _BLOCK):
            edges = imu.time[k : k + _BLOCK + 1]
            rows = np.column_stack((edges[1:], np.diff(edges), imu.dtheta[k : k + _BLOCK], imu.dvel[k : k + _BLOCK]))
            for row in rows.tolist():
                yield _line("imu", row[0], columns, row)

    def readings(name: str) -> Iterator[Packet]:
        table = of.readings(name)
        for row in np.column_stack(list(table.values())).tolist():
            yield _line(name, max(row[-1], first), tuple(table), row)

    yield from heapq.merge(samples(), *map(readings, of.sensors), key=lambda packet: packet.time)
    yield _line("end", of.end, ("time_s",), [of.end])


def nmea_packets(of: Streamed, pace: float = 1.0) -> Iterator[Packet]:
    """Yield the sentences of the run's first satellite receiver; without one, of the true motion."""
    content, name = of.content, next(iter(of.run.fixes), None)
    arrival: Callable[[float], float] = lambda time: time  # noqa: E731
    if name is not None:
        content, table = replace(content, solution_name=name), of.run.table(f"aiding_{name}_position")
        arrival = lambda time: float(np.interp(time, table["time_s"], table["arrival_s"]))  # noqa: E731
    for time, text in nmea_instants(content.with_rate(MOST_HZ)):
        if arrival(time) <= of.end + WITHIN:
            yield Packet(arrival(time), "NMEA", text.encode("ascii"))


def binary_packets(of: Streamed, pace: float = 1.0) -> Iterator[Packet]:
    """Yield the messages of the protocol with navigators of others, each sample with what arrives by its end."""
    from sinssim.simulation.foreign_navigator import first_message

    begin, state = of.start
    row = int(np.searchsorted(of.imu.time, begin - WITHIN))  # after an alignment
    imu = ImuData(of.imu.time[row:], of.imu.dtheta[row:], of.imu.dvel[row:])
    scenario = load_scenario(of.run.path / "scenario.toml")
    numbers = first_message(scenario, ellipsoid_by_name(of.run.ellipsoid), of.content.start_gps_s, imu, state)
    numbers["imu_rate_hz"] /= of.together
    feed = Feed(numbers, imu, [_measurements(of, name) for name in of.sensors])
    yield Packet(float(imu.time[0]), "begin", feed.opening())
    number = 0
    for block in feed.blocks():
        for part in block.parts:
            number += 1
            yield Packet(float(imu.time[number]), "imu", bytes(part))
    yield Packet(of.end, "end", feed.closing())


def live_packets(
    flight: LiveFlight, start: str | None, paced: bool, solution: Callable[[float], NavSolution | None]
) -> Iterator[Packet]:
    """Yield the messages of the protocol with navigators of others while the flight of a scenario, which starts at a
    date, UTC, is flown by what they answer. If it is paced, the next step is flown while one is sent, otherwise after
    that. The last solution that has come, if any, is asked for with the time until when samples were sent, s."""
    from sinssim.simulation.foreign_navigator import first_message, readings_by_name
    from sinssim.simulation.navigation_stage import first_state

    zero = parse_date(DEFAULT_START if start is None else start, "--start")
    scenario, number, opened = flight.scenario, 0, False
    names = () if scenario.aiding is None else tuple(scenario.aiding.sensors())

    def step(sent: float) -> list[Packet]:
        nonlocal number, opened
        if (last := solution(sent)) is not None:
            flight.believe(last)
        sensed, until = flight.step()
        imu, truth, begun = sensed.imu, sensed.truth, opened
        end = int(np.searchsorted(imu.time, until + WITHIN, side="right")) - 1
        edges = imu.time[number : end + 1]
        new = ImuData(edges, imu.dtheta[number:end], imu.dvel[number:end])
        readings = [m for series in readings_by_name(scenario, truth, imu, names).values() for m in series]
        readings = [_arrived_after(m, edges[0] + WITHIN) if begun else m for m in readings]
        numbers = first_message(scenario, truth.ellipsoid, zero, new, first_state(scenario, truth))
        feed, opened = Feed(numbers, new, readings), True
        packets = [] if begun else [Packet(float(edges[0]), "begin", feed.opening())]
        parts = (bytes(part) for block in feed.blocks() for part in block.parts)
        packets += [Packet(time, "imu", part) for time, part in zip(edges[1:].tolist(), parts, strict=True)]
        number = end
        return packets + ([Packet(float(edges[-1]), "end", feed.closing())] if flight.over else [])

    with ThreadPoolExecutor(1) as pool:
        packets = step(-math.inf)
        while packets:
            last, over = packets[-1].time, flight.over
            ahead = pool.submit(step, last) if paced and not over else None
            yield from packets
            packets = ahead.result() if ahead is not None else [] if over else step(last)


def _arrived_after(m: Measurements, time: float) -> Measurements:
    """Return the readings, in the order of arrival, that arrive after an instant."""
    k = int(np.searchsorted(m.arrival, time, side="right"))
    return replace(m, time=m.time[k:], arrival=m.arrival[k:], value=m.value[k:], sigma=m.sigma[k:])


def _measurements(of: Streamed, name: str) -> Measurements:
    """Return the readings of a sensor as the protocol has them."""
    table, label = of.readings(name), name.replace("_", "-")
    columns = list(table)
    sigmas = [column for column in columns if column.startswith("sigma")]
    values = columns[1 : columns.index(sigmas[0])]
    like = [kind.name for kind in KINDS.values() if kind.columns == tuple(values)]
    of_same_word = (kind for kind in like if kind.split("-")[-1] == label.split("-")[-1])  # of a second receiver
    tables = of.run.scenario.get("log" if of.run.of_log else "aiding", {})
    keys = max((t for t in tables if f"{name}_".startswith(f"{t}_")), key=len, default="")
    sensor = tables.get(keys, {})
    kind = label if label in like else next(of_same_word, like[0] if like else label)
    if "baseline_m" in sensor:  # of two antennas; the heading of a magnetometer has the same columns
        kind = "baseline-heading"
    arm = sensor.get("baseline_m", sensor.get("lever_arm_m", (0.0, 0.0, 0.0)))
    value, sigma = (np.column_stack([table[column] for column in names]) for names in (values, sigmas))
    return Measurements(kind, table["time_s"], table["arrival_s"], value, sigma, np.array(arm, dtype=float), label)


def mavlink_packets(of: Streamed, pace: float = 1.0) -> Iterator[Packet]:
    """Yield HIL_SENSOR, HIL_GPS, GPS_INPUT, the truth as HIL_STATE_QUATERNION, and HEARTBEAT once a second of the
    clock."""
    try:
        from pymavlink.dialects.v20 import common
    except ImportError as error:
        raise InputError(
            f"--as mavlink needs the library pymavlink, which is not installed ({error}). Install it with: "
            "pip install 'sinssim[stream]'"
        ) from error
    link = common.MAVLink(None, _SYSTEM, _COMPONENT)
    parts = [
        _heartbeats(link, common, of, pace if math.isfinite(pace) else 1.0),
        _hil_sensors(link, common, of),
        *(_fixes(link, common, of, name, number) for number, name in enumerate(of.run.fixes)),
        _true_states(link, of),
    ]
    for time, message in heapq.merge(*parts, key=lambda part: part[0]):
        yield Packet(time, message.get_type(), message.pack(link))
        link.seq = (link.seq + 1) % 256  # `pack` leaves it as it is


def _heartbeats(link: Any, common: Any, of: Streamed, interval: float) -> Iterator[tuple[float, Any]]:
    for time in np.arange(float(of.imu.time[0]), of.end + WITHIN, interval).tolist():
        yield time, link.heartbeat_encode(
            common.MAV_TYPE_GENERIC, common.MAV_AUTOPILOT_INVALID, common.MAV_MODE_FLAG_HIL_ENABLED, 0,
            common.MAV_STATE_ACTIVE,
        )  # fmt: skip


def _hil_sensors(link: Any, common: Any, of: Streamed) -> Iterator[tuple[float, Any]]:
    """Yield samples as means over their intervals, with the last reading of a barometer.

    The pressure is that of the standard atmosphere at the height that the barometer reads. Its temperature is that of
    the same atmosphere, unless the flight has logged one.
    """
    imu, inertial, baro = of.imu, 0x3F, {}
    of_baro = common.HIL_SENSOR_UPDATED_ABS_PRESSURE | common.HIL_SENSOR_UPDATED_PRESSURE_ALT
    of_baro |= common.HIL_SENSOR_UPDATED_TEMPERATURE
    if "baro" in of.sensors:
        baro = of.readings("baro")
    heights = baro.get("height_m", np.zeros(0)).tolist()
    known = np.searchsorted(baro.get("arrival_s", np.zeros(0)), imu.time[1:] + WITHIN, side="right").tolist()
    logged = _logged(of, "static_temperature_k", imu.time[1:])
    air, height, pressure, temperature, before = Air(), 0.0, 0.0, 0.0, 0
    for k in range(0, len(imu), _BLOCK):
        edges = imu.time[k : k + _BLOCK + 1]
        step = np.diff(edges)[:, np.newaxis]
        rates = np.column_stack((edges[1:], imu.dvel[k : k + _BLOCK] / step, imu.dtheta[k : k + _BLOCK] / step))
        for number, (time, *six) in enumerate(rates.tolist(), start=k):
            new = known[number] > before
            if new:
                before = known[number]
                height = heights[before - 1]
                pressure = air.pressure(height) / 100.0
                temperature = (air.temperature(height) if logged is None else float(logged[number])) - _KELVIN
            fields = inertial | of_baro if new else inertial
            yield (
                time,
                link.hil_sensor_encode(_us(time), *six, 0.0, 0.0, 0.0, pressure, 0.0, height, temperature, fields),
            )


def _fixes(link: Any, common: Any, of: Streamed, name: str, number: int) -> Iterator[tuple[float, Any]]:
    """Yield the fixes of a receiver's antenna, twice: HIL_GPS and GPS_INPUT.

    HIL_GPS has no field for 1σ: eph and epv are 1σ in cm, the dilution of precision of ranges of 1 m. The heights are
    those above the ellipsoid, which is the sea level of the air that the barometer measures.
    """
    arrival, f = of.fixes(name)
    ignored = common.GPS_INPUT_IGNORE_FLAG_HDOP | common.GPS_INPUT_IGNORE_FLAG_VDOP
    unknown = np.full((len(f), 3), np.nan)
    velocity, speeds = (unknown if v is None else v for v in (f.velocity_ned, f.velocity_sigma))
    sigma = unknown if f.position_sigma is None else f.position_sigma
    week, ms = divmod(np.round(1e3 * (of.content.start_gps_s + f.time)), 1e3 * WEEK)
    rows = np.column_stack((arrival, f.time, f.latitude, f.longitude, f.height, velocity, sigma, speeds, week, ms))
    first = float(of.imu.time[0])
    for row in rows.tolist():
        due, time, latitude, longitude, height, north, east, down, *sigmas, of_week, ms_of_week = row
        due, moving = max(due, first), math.isfinite(north + east + down)
        s_n, s_e, s_d, s_vn, s_ve, s_vd = (s if math.isfinite(s) else 0.0 for s in sigmas)
        across, course = math.hypot(s_n, s_e), math.degrees(math.atan2(east, north)) % 360.0 if moving else 0.0
        of_velocity = [_int16(100.0 * v) if moving else 0 for v in (north, east, down)]
        speed = _uint16(100.0 * math.hypot(north, east)) if moving else 65535
        yield due, link.hil_gps_encode(
            _us(time), 3, _e7(latitude), _e7(longitude), round(1e3 * height), _accuracy(across),
            _accuracy(s_d), speed, *of_velocity, round(100.0 * course) % 36000 if moving else 65535, 255,
            number,
        )  # fmt: skip
        flags = ignored | (0 if across else common.GPS_INPUT_IGNORE_FLAG_HORIZONTAL_ACCURACY)
        flags |= 0 if s_d else common.GPS_INPUT_IGNORE_FLAG_VERTICAL_ACCURACY
        flags |= 0 if s_vn else common.GPS_INPUT_IGNORE_FLAG_SPEED_ACCURACY
        flags |= 0 if moving else common.GPS_INPUT_IGNORE_FLAG_VEL_HORIZ | common.GPS_INPUT_IGNORE_FLAG_VEL_VERT
        yield due, link.gps_input_encode(
            _us(time), number, flags, int(ms_of_week), int(of_week), 3, _e7(latitude), _e7(longitude),
            height, 0.0, 0.0, *((north, east, down) if moving else (0.0, 0.0, 0.0)),
            math.sqrt(s_vn**2 + s_ve**2 + s_vd**2), across, s_d, 255,
        )  # fmt: skip


def _true_states(link: Any, of: Streamed) -> Iterator[tuple[float, Any]]:
    """Yield the true motion: rates relative to the Earth and its acceleration, about and along the body's axes."""
    s, run = of.content.motion, of.run
    assert s.velocity_ned is not None
    assert s.q_nb is not None
    ideal = run.increments("ideal" if "ideal" in run.inertial else run.inertial[0])
    assert ideal.interval is not None
    row = np.searchsorted(ideal.time, s.time - WITHIN).clip(max=len(ideal) - 1)
    to_body = rotation.conjugate(s.q_nb)
    turning = ideal.gyro[row] / ideal.interval[row, :1]
    turning -= rotation.rotate(to_body, earth_rate(s.latitude, ellipsoid_by_name(run.ellipsoid)))
    accelerating = rotation.rotate(to_body, np.gradient(s.velocity_ned, s.time, axis=0)) / (1e-3 * G0)
    true, calibrated = (_logged(of, name, s.time) for name in ("airspeed_mps", "calibrated_airspeed_mps"))
    none = np.zeros(len(s))
    air = np.column_stack((none if calibrated is None else calibrated, none if true is None else true))
    place = np.column_stack((s.time, s.latitude, s.longitude, s.height))
    rows = np.column_stack((place, s.velocity_ned, s.q_nb, turning, air, accelerating))
    every = max(1, math.ceil(1.0 / (_TRUTH_HZ * float(np.median(np.diff(s.time)))) - 1e-6))
    for time, latitude, longitude, height, *more in rows[::every].tolist():
        yield time, link.hil_state_quaternion_encode(
            _us(time), more[3:7], *more[7:10], _e7(latitude), _e7(longitude), round(1e3 * height),
            *(_int16(100.0 * v) for v in more[:3]), *(_uint16(100.0 * v) for v in more[10:12]),
            *(_int16(a) for a in more[12:]),
        )  # fmt: skip


def _logged(of: Streamed, column: str, time: Array) -> Array | None:
    """Return a quantity that the flight has logged at instants, (N,); None if it has not."""
    for name in of.run.streams("flight"):
        table = of.run.table(f"flight{name}")
        if column in table:
            return np.interp(time, table["time_s"], table[column])
    return None


def _us(time: float) -> int:
    return round(1e6 * time)


def _e7(angle: float) -> int:
    """Return an angle within half a turn, 1e-7 deg."""
    return round(1e7 * ((angle / DEG + 180.0) % 360.0 - 180.0))


def _int16(value: float) -> int:
    return min(max(round(value), -32768), 32767)


def _uint16(value: float) -> int:
    """Return a whole number below 65535, which stands for an unknown one."""
    return min(max(round(value), 0), 65534)


def _accuracy(sigma: float) -> int:
    """Return a 1σ in cm; 65535 if it is not known."""
    return max(1, _uint16(100.0 * sigma)) if sigma else 65535


FORMS: dict[str, Callable[[Streamed, float], Iterator[Packet]]] = {
    "mavlink": mavlink_packets,
    "json": json_packets,
    "nmea": nmea_packets,
    "binary": binary_packets,
}
"""What makes the packets of a form, at a pace."""
