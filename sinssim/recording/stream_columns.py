"""The streams of a run: recorded exactly, in SI units, with the same column names everywhere."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.recording.stream_tables import Computed, Rows, Stream, Vector
from sinssim.sensors.imu.faults import CHANNELS, channels_of
from sinssim.strapdown.navigation_error import NavError
from sinssim.truth.sampling import Channel
from sinssim.units import ARCSEC, MGAL

if TYPE_CHECKING:
    from sinssim.logs.reference_solution import Reference
    from sinssim.sensors.imu.encoder import Encoders
    from sinssim.sensors.sets.fault_detection import Monitored
    from sinssim.sensors.sets.sensor_readings import Readings
    from sinssim.strapdown.gimballed_platform import PlatformSolution
    from sinssim.truth.true_gravity_disturbance import GravityValues


def _state(latitude: Array, longitude: Array, height: Array, velocity_ned: Array, q_nb: Array) -> tuple[Vector, ...]:
    position = Computed(lambda rows: np.column_stack((latitude[rows], longitude[rows], height[rows])))
    return (
        Vector("position", ("latitude_rad", "longitude_rad", "height_m"), position),
        Vector("velocity", ("velocity_n_mps", "velocity_e_mps", "velocity_d_mps"), velocity_ned),
        Vector("attitude", ("q_nb_w", "q_nb_x", "q_nb_y", "q_nb_z"), q_nb),
    )


def truth_stream(time: Array, truth: NavState) -> Stream:
    """Return the stream `truth`: n+1 rows.

    Args:
        time: (N+1,) s.
    """
    s = truth
    return Stream("truth", time, _state(s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb))


def reference_stream(reference: Reference) -> Stream:
    """Return the stream `reference`: what recorded sensors are compared with, NaN for what it does not have."""
    r, count = reference, len(reference.time)
    velocity = np.full((count, 3), np.nan) if r.velocity_ned is None else r.velocity_ned
    q_nb = np.full((count, 4), np.nan) if r.q_nb is None else r.q_nb
    vectors = _state(r.latitude, r.longitude, r.height, velocity, q_nb)
    if r.position_sigma is not None:
        columns = ("sigma_north_m", "sigma_east_m", "sigma_down_m")
        vectors += (Vector("sigma", columns, r.position_sigma),)
    return Stream("reference", r.time, vectors)


def imu_stream(kind: str, imu: ImuData, *, with_angles: bool = True) -> Stream:
    """Return the stream `imu_<kind>`; the time of a row is the end of its interval.

    Args:
        kind: "ideal", "measured" or "compensated".
        with_angles: whether there are increments of angle, from gyros or from six accelerometers.

    Returns:
        N rows; with a column of flags for each sensor if the sensors report flags.
    """
    vectors = [Vector("dvel", ("dvel_x_mps", "dvel_y_mps", "dvel_z_mps"), imu.dvel)]
    if with_angles:
        vectors.insert(0, Vector("dtheta", ("dtheta_x_rad", "dtheta_y_rad", "dtheta_z_rad"), imu.dtheta))
    if (flags := imu.flags) is not None:
        columns = tuple(f"flags_{channel}" for channel in CHANNELS)
        vectors.append(Vector("flags", columns, Computed(lambda rows: flags[rows].astype(np.float64))))
    return Stream(f"imu_{kind}", imu.time[1:], tuple(vectors))


def set_streams(kind: str, readings: Readings) -> list[Stream]:
    """Return the streams of a sensor set other than increments.

    Args:
        kind: "ideal" or "measured".

    Returns:
        `accelerometers_<kind>`, N rows, for six accelerometers; `attitude_<kind>`, N+1 rows, for an attitude sensor;
        `gyros_<kind>` and `accelerometers_<kind>`, N rows, and `redundancy`, N rows, if it is monitored, for a
        redundant set.
    """
    streams, time = [], readings.imu.time
    if (single := readings.single) is not None:
        count, flags = single.dtheta.shape[1], single.flags
        names = channels_of(count)
        for i, (name, word, unit, rows) in enumerate(
            (("gyros", "dtheta", "rad", single.dtheta), ("accelerometers", "dvel", "mps", single.dvel))
        ):
            vectors = [Vector(word, tuple(f"{word}_{j}_{unit}" for j in range(1, count + 1)), rows)]
            if flags is not None:
                mine = slice(i * count, (i + 1) * count)
                columns = tuple(f"flags_{channel}" for channel in names[mine])
                vectors.append(Vector("flags", columns, flags[:, mine].astype(np.float64)))
            streams.append(Stream(f"{name}_{kind}", time[1:], tuple(vectors)))
    if readings.monitored:
        vectors = [vector for monitored in readings.monitored for vector in _tests(monitored)]
        streams.append(Stream("redundancy", time[1:], tuple(vectors)))
    if readings.accelerometers is not None:
        columns = tuple(f"dvel_{i}_mps" for i in range(1, readings.accelerometers.shape[1] + 1))
        streams.append(Stream(f"accelerometers_{kind}", time[1:], (Vector("dvel", columns, readings.accelerometers),)))
    if readings.attitude is not None:
        columns = ("q_ib_w", "q_ib_x", "q_ib_y", "q_ib_z")
        streams.append(Stream(f"attitude_{kind}", time, (Vector("attitude", columns, readings.attitude),)))
    return streams


def _tests(monitored: Monitored) -> Iterator[Vector]:
    """Yield the statistics of the parity tests, their threshold, and which sensors are used."""
    windows = ["sample", *(f"{window:.6g}s" for window in monitored.windows[1:])]
    columns = tuple(f"{monitored.kind}_statistic_{window}" for window in windows)
    yield Vector(f"{monitored.kind}_statistic", columns, monitored.statistic.T)
    yield Vector(f"{monitored.kind}_threshold", (f"{monitored.kind}_threshold",), monitored.threshold[:, np.newaxis])
    columns = tuple(f"{monitored.kind}_used_{number}" for number in range(1, monitored.used.shape[1] + 1))
    yield Vector(f"{monitored.kind}_used", columns, monitored.used.astype(np.float64))


def other_error_stream(name: str, error: NavError) -> Stream:
    """Return a stream of errors of a solution for comparison, which has no streams of its own: n+1 rows.

    Args:
        name: "error_without_monitoring": if a redundant set's faulty sensors had been used;
            "error_without_errors_of_turns": if the gyros beside a platform had no errors that act in turns only;
            "error_without_rotation": if the block of the same sensors did not turn.
    """
    return Stream(
        name,
        error.time,
        (
            Vector("position", ("position_n_m", "position_e_m", "position_d_m"), error.position_ned),
            Vector("velocity", ("velocity_n_mps", "velocity_e_mps", "velocity_d_mps"), error.velocity_ned),
            Vector("attitude", ("phi_n_rad", "phi_e_rad", "phi_d_rad"), error.attitude),
        ),
    )


def rotation_stream(encoders: Encoders) -> Stream:
    """Return the stream `rotation`: true and read angles of a block that turns.

    Returns:
        N+1 rows.
    """
    e = encoders
    true = Computed(lambda rows: e.turns.angles(e.edges[rows]))
    read = Computed(lambda rows: e.angles(e.edges[rows]))
    return Stream(
        "rotation",
        e.edges,
        (
            Vector("angle", ("outer_angle_rad", "inner_angle_rad"), true),
            Vector("encoder", ("outer_encoder_rad", "inner_encoder_rad"), read),
        ),
    )


def platform_stream(solution: PlatformSolution) -> Stream:
    """Return the stream `platform`: commanded rates, gimbal angles, drift and readings at the ends of the intervals.

    Args:
        solution: of a platform's navigator.

    Returns:
        N rows.
    """
    s = solution
    return Stream(
        "platform",
        s.time[1:],
        (
            Vector("commanded", ("commanded_x_radps", "commanded_y_radps", "commanded_z_radps"), s.commanded),
            Vector("drift", ("drift_x_radps", "drift_y_radps", "drift_z_radps"), s.drift),
            Vector("dvel", ("dvel_x_mps", "dvel_y_mps", "dvel_z_mps"), s.readings),
            Vector("gimbals", ("gimbal_roll_rad", "gimbal_pitch_rad", "gimbal_azimuth_rad"), s.gimbals[1:]),
            Vector("attitude", ("q_ip_w", "q_ip_x", "q_ip_y", "q_ip_z"), s.q_ip[1:]),
        ),
    )


def nav_stream(name: str, solution: NavSolution) -> Stream:
    """Return the stream `nav_<algorithm>`: the solution, and the defect of the algorithm's attitude variables.

    Returns:
        N+1 rows.
    """
    s = solution
    state = _state(s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb)
    return Stream(f"nav_{name}", s.time, (*state, Vector("defect", ("defect",), s.defect[:, np.newaxis])))


def error_stream(name: str, error_at: Callable[[slice], NavError], time: Array) -> Stream:
    """Return the stream `error_<algorithm>`: n+1 rows.

    Args:
        time: (N+1,) s.
    """
    # the three vectors of a block, of which two threads write, are computed together
    block = lru_cache(maxsize=2)(lambda start, stop: error_at(slice(start, stop)))

    def part(field: str) -> Rows:
        return Computed(lambda rows: np.asarray(getattr(block(rows.start, rows.stop), field)))

    return Stream(
        f"error_{name}",
        time,
        (
            Vector("position", ("position_n_m", "position_e_m", "position_d_m"), part("position_ned")),
            Vector("velocity", ("velocity_n_mps", "velocity_e_mps", "velocity_d_mps"), part("velocity_ned")),
            Vector("attitude", ("phi_n_rad", "phi_e_rad", "phi_d_rad"), part("attitude")),
        ),
    )


def channel_streams(channels: Mapping[str, Channel]) -> list[Stream]:
    """Return the streams logged along the flight; channels over the same times share a stream.

    Returns:
        `flight`, and `flight_2`, … for channels over other times.
    """
    groups: list[tuple[Array, list[Vector]]] = []
    for name, channel in channels.items():
        values = channel.values.reshape(len(channel.time), -1)
        unit = _UNIT_NAMES.get(channel.unit, channel.unit.replace("/", "_p_"))
        column = f"{name}_{unit}" if unit and not name.endswith(f"_{unit.lower()}") else name
        columns = (column,) if values.shape[1] == 1 else tuple(f"{column}_{i}" for i in range(values.shape[1]))
        group = next((g for g in groups if g[0] is channel.time or np.array_equal(g[0], channel.time)), None)
        if group is None:
            group = (channel.time, [])
            groups.append(group)
        group[1].append(Vector(name, columns, values))
    return [Stream("flight" if i == 0 else f"flight_{i + 1}", t, tuple(v)) for i, (t, v) in enumerate(groups)]


def gravity_stream(values: GravityValues) -> Stream:
    """Return the stream `gravity`: the true field along the motion, once a second.

    Returns:
        K rows.
    """
    v = values
    columns = {
        "deflection": (("xi_arcsec", v.xi / ARCSEC), ("eta_arcsec", v.eta / ARCSEC)),
        "anomaly": (("disturbance_mgal", v.disturbance / MGAL), ("anomaly_mgal", v.anomaly / MGAL)),
    }
    if v.undulation is not None and v.altitude_msl is not None:
        columns["geoid"] = (("undulation_m", v.undulation), ("altitude_msl_m", v.altitude_msl))
    vectors = (
        Vector(name, tuple(column for column, _ in pair), np.column_stack([values for _, values in pair]))
        for name, pair in columns.items()
    )
    return Stream("gravity", v.time, tuple(vectors))


_UNIT_NAMES = {"m/s": "mps", "m/s²": "mps2", "rad/s": "radps", "deg/s": "degps", "°": "deg", "%": "percent"}
"""Units as written in the name of a column."""
