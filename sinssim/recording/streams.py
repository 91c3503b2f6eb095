"""The streams of a run: exact, in SI units, with the same column names everywhere; written row by row as Parquet."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.data import BLOCK, Array, Computed, ImuData, NavSolution, NavState, Rows, blocks, described, html_table
from sinssim.errors import InputError, unknown_name
from sinssim.sensors.imu.faults import CHANNELS, channels_of
from sinssim.strapdown.navigation_error import NavError
from sinssim.system import process
from sinssim.system.files import draft
from sinssim.truth.sampling import Channel, FlightEvent
from sinssim.units import ARCSEC, MGAL

if TYPE_CHECKING:
    from sinssim.logs.reference_solution import Reference
    from sinssim.sensors.fault_detection import Monitored
    from sinssim.sensors.imu.rotation_encoder import Encoders
    from sinssim.sensors.sensor_set_readings import Readings
    from sinssim.strapdown.gimballed_platform import PlatformSolution
    from sinssim.truth.true_gravity_disturbance import GravityValues


@dataclass(frozen=True)
class Vector:
    """A group of related columns of a stream."""

    name: str  # short name
    columns: tuple[str, ...]  # name of each column, ending in its unit
    values: Rows  # (N, len(columns))


@dataclass(frozen=True)
class Stream:
    """A table over time: one Parquet file, and one entity per vector in the recording."""

    name: str  # name of the file and of the entities' parent
    time: Array  # (N,) s
    vectors: tuple[Vector, ...]  # the columns


_MOST_ROWS = 262144
"""Largest number of rows of a row group, which is one page of each column."""
_MOST_BYTES = 24 * 2**20
"""Memory of a row group, beyond which it has fewer rows."""


def write_stream(stream: Stream, folder: Path, metadata: Mapping[str, str] | None = None) -> Path:
    """Write a stream as `<folder>/<name>.parquet`, through a temporary file. `stream`: the stream; doubles stay
    doubles."""
    tables = (arrow_table(stream, rows) for rows in blocks(len(stream.time)))
    return _write(tables, folder / f"{stream.name}.parquet", metadata)


def arrow_table(stream: Stream, rows: slice) -> Any:
    """Return rows of a stream as a `pyarrow.Table` with the column `time_s` and the columns of all vectors; doubles
    stay doubles."""
    import pyarrow as pa

    columns = {"time_s": pa.array(stream.time[rows])}
    for vector in stream.vectors:
        values = vector.values[rows]
        columns |= {name: pa.array(values[:, i].copy()) for i, name in enumerate(vector.columns)}
    return pa.table(columns)


def write_events(events: Sequence[FlightEvent], folder: Path) -> Path:
    """Write events as `<folder>/events.parquet`, columns `time_s` and `text`."""
    import pyarrow as pa

    table = pa.table(
        {
            "time_s": pa.array([event.time for event in events], pa.float64()),
            "text": pa.array([event.text for event in events], pa.string()),
        }
    )
    return write_table(table, folder / "events.parquet")


def write_table(table: Any, path: Path) -> Path:
    """Write a table as a Parquet file, through a temporary file. `table`: a `pyarrow.Table`; doubles stay doubles."""
    return _write([table], path)


def _write(tables: Iterable[Any], path: Path, metadata: Mapping[str, str] | None = None) -> Path:
    """Write the blocks of a table, at least one, as a Parquet file.

    Doubles of a simulation rarely repeat: a dictionary costs time and saves nothing. With their bytes split into eight
    planes, the planes of signs and exponents compress well. zstd has one code for 128 kB: a plane of a page must be as
    long, or planes of different statistics share a code.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    first, others = next(blocks := iter(tables)), blocks
    schema = first.schema.with_metadata({**(first.schema.metadata or {}), **(metadata or {})} or None)
    numbers = [f.name for f in schema if not (pa.types.is_string(f.type) or pa.types.is_boolean(f.type))]
    with (
        draft(path) as beside,
        pq.ParquetWriter(
            beside,
            schema,
            compression="zstd",
            compression_level=3,
            use_dictionary=False,
            write_statistics=False,
            column_encoding=dict.fromkeys(numbers, "BYTE_STREAM_SPLIT"),
            data_page_size=8 * _MOST_ROWS,
            max_rows_per_page=_MOST_ROWS,
        ) as writer,
    ):
        for group in _groups(chain((first,), others), _rows_together(len(schema))):
            writer.write_table(group.replace_schema_metadata(schema.metadata))
            del group  # before the next is put together
    return path


def _rows_together(columns: int) -> int:
    """Return how many rows of a table are compressed together."""
    return min(_MOST_ROWS, max(BLOCK, _MOST_BYTES // (8 * columns)))


def _groups(tables: Iterable[Any], most: int) -> Iterator[Any]:
    """Put the blocks of a table together to row groups."""
    import pyarrow as pa

    group: list[Any] = []
    for table in tables:
        if group and sum(len(block) for block in group) + len(table) > most:
            yield pa.concat_tables(group)
            group = []
        group.append(table)
    yield pa.concat_tables(group)


def give_back_memory() -> None:
    """Return to the system what writing until now has freed."""
    import pyarrow as pa

    pa.default_memory_pool().release_unused()
    process.give_back_memory()


class StreamTable:
    """A stream of a run: a table over time, whose columns are those of its Parquet file; units are in their names."""

    def __init__(self, stream: Stream) -> None:
        """Take a stream."""
        self._stream = stream

    @property
    def name(self) -> str:
        """Name of the stream, and of its Parquet file."""
        return self._stream.name

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns, beginning with `time_s`."""
        return ("time_s", *(name for vector in self._stream.vectors for name in vector.columns))

    def __len__(self) -> int:
        return len(self._stream.time)

    def __getitem__(self, column: str) -> Array:
        if column == "time_s":
            return self._stream.time
        for vector in self._stream.vectors:
            if column in vector.columns:
                return np.asarray(vector.values[slice(0, len(self))][:, vector.columns.index(column)])
        raise unknown_name(f"column of the stream {self.name}", column, self.columns)

    def __repr__(self) -> str:
        time, shown = self._stream.time, ", ".join(self.columns[:8])
        span = f", {time[0]:g} … {time[-1]:g} s" if len(time) else ""
        more = f", … {len(self.columns)} columns in all" if len(self.columns) > 8 else ""
        return f"StreamTable({self.name}: {len(self)} rows{span}; {shown}{more})"

    def _repr_html_(self) -> str:
        rows: list[tuple[str, ...]] = [(name, described(self[name])) for name in self.columns]
        return html_table(f"{self.name}: {len(self)} rows", rows, ("column", "values"))

    def arrow(self) -> Any:
        """Return the stream as a `pyarrow.Table`, doubles bit for bit."""
        return arrow_table(self._stream, slice(0, len(self)))

    def pandas(self) -> Any:
        """Return the stream as a `pandas.DataFrame`."""
        _needed("pandas")
        return self.arrow().to_pandas()

    def polars(self) -> Any:
        """Return the stream as a `polars.DataFrame`."""
        return _needed("polars").from_arrow(self.arrow())


class Streams(Mapping[str, StreamTable]):
    """The streams of a result by name: `run.streams["truth"].pandas()`.

    Those of a run are `truth`, `imu_ideal`, `imu_measured`, `nav_NAME` and `error_NAME` of each solution, and those of
    a filter. Streams of special sensor sets and further coordinates are in the Parquet files of a recorded run alone.
    """

    def __init__(self, streams: Iterable[Stream] = ()) -> None:
        """Take streams."""
        self._by_name = {stream.name: StreamTable(stream) for stream in streams}

    def __getitem__(self, name: str) -> StreamTable:
        try:
            return self._by_name[name]
        except KeyError:
            raise unknown_name("stream", name, tuple(self._by_name)) from None

    def __contains__(self, name: object) -> bool:
        return name in self._by_name

    def __iter__(self) -> Iterator[str]:
        return iter(self._by_name)

    def __len__(self) -> int:
        return len(self._by_name)

    def __repr__(self) -> str:
        return f"Streams({', '.join(self)})"

    def _repr_html_(self) -> str:
        rows: list[tuple[str, ...]] = [
            (name, str(len(table)), str(len(table.columns))) for name, table in self._by_name.items()
        ]
        return html_table("Streams", rows, ("stream", "rows", "columns"))


def _needed(library: str) -> Any:
    """Return an optional library; raise with the command that installs it."""
    try:
        return importlib.import_module(library)
    except ImportError as error:
        raise InputError(
            f"{library} is not installed. Install sinssim with its extra, pip install 'sinssim[{library}]', or take "
            "arrow(), which needs nothing more."
        ) from error


def _state(latitude: Array, longitude: Array, height: Array, velocity_ned: Array, q_nb: Array) -> tuple[Vector, ...]:
    position = Computed(len(latitude), lambda rows: np.column_stack((latitude[rows], longitude[rows], height[rows])))
    return (
        Vector("position", ("latitude_rad", "longitude_rad", "height_m"), position),
        Vector("velocity", ("velocity_n_mps", "velocity_e_mps", "velocity_d_mps"), velocity_ned),
        Vector("attitude", ("q_nb_w", "q_nb_x", "q_nb_y", "q_nb_z"), q_nb),
    )


def truth_stream(time: Array, truth: NavState) -> Stream:
    """Return the stream `truth`: n+1 rows. `time`: (N+1,) s."""
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
    """Return the stream `imu_<kind>`, "ideal", "measured" or "compensated", of N rows: the time of a row is the end of
    its interval. Increments of angle are from gyros or from six accelerometers; there is a column of flags for each
    sensor if the sensors report flags."""
    vectors = [Vector("dvel", ("dvel_x_mps", "dvel_y_mps", "dvel_z_mps"), imu.dvel)]
    if with_angles:
        vectors.insert(0, Vector("dtheta", ("dtheta_x_rad", "dtheta_y_rad", "dtheta_z_rad"), imu.dtheta))
    if (flags := imu.flags) is not None:
        columns = tuple(f"flags_{channel}" for channel in CHANNELS)
        vectors.append(Vector("flags", columns, Computed(len(flags), lambda rows: flags[rows].astype(np.float64))))
    return Stream(f"imu_{kind}", imu.time[1:], tuple(vectors))


def set_streams(kind: str, readings: Readings) -> list[Stream]:
    """Return the streams of a sensor set other than increments, "ideal" or "measured": `accelerometers_<kind>`, N rows,
    for six accelerometers; `attitude_<kind>`, N+1 rows, for an attitude sensor; `gyros_<kind>` and
    `accelerometers_<kind>`, N rows, and `redundancy`, N rows, if it is monitored, for a redundant set."""
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


def rotation_stream(encoders: Encoders) -> Stream:
    """Return the stream `rotation`, N+1 rows: true and read angles of a block that turns."""
    e = encoders
    true = Computed(len(e.edges), lambda rows: e.turns.angles(e.edges[rows]))
    read = Computed(len(e.edges), lambda rows: e.angles(e.edges[rows]))
    return Stream(
        "rotation",
        e.edges,
        (
            Vector("angle", ("outer_angle_rad", "inner_angle_rad"), true),
            Vector("encoder", ("outer_encoder_rad", "inner_encoder_rad"), read),
        ),
    )


def platform_stream(solution: PlatformSolution) -> Stream:
    """Return the stream `platform` of its navigator, N rows: commanded rates, gimbal angles, drift and readings at the
    ends of the intervals."""
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
    """Return the stream `nav_<algorithm>`, N+1 rows: the solution, and the defect of the algorithm's attitude
    variables."""
    s = solution
    state = _state(s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb)
    return Stream(f"nav_{name}", s.time, (*state, Vector("defect", ("defect",), s.defect[:, np.newaxis])))


def error_stream(name: str, error_at: Callable[[slice], NavError], time: Array) -> Stream:
    """Return the stream `error_<name>`, n+1 rows, of a solution, or of one for comparison that has no other streams:
    "without_monitoring" if a redundant set's faulty sensors had been used; "without_errors_of_turns" if the gyros
    beside a platform had no errors that act in turns only; "without_rotation" if the block of the same sensors did not
    turn."""
    # the three vectors of a block, of which two threads write, are computed together
    block = lru_cache(maxsize=2)(lambda start, stop: error_at(slice(start, stop)))

    def part(field: str) -> Rows:
        return Computed(len(time), lambda rows: np.asarray(getattr(block(rows.start, rows.stop), field)))

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
    """Return the streams logged along the flight, `flight`, and `flight_2`, … for channels over other times."""
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
    """Return the stream `gravity`: the true field along the motion, once a second."""
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
