"""The streams of a run directory in the common form of recorded files, stored or computed; the version of sinssim.

The errors of a solution follow from the stored truth and solution by a rule that is written into the solution's file.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from sinssim import __version__
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.errors import InputError, unknown_name, warn
from sinssim.logs.recorded_streams import FixStream, InertialStream, SolutionStream
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.system.files import MARK

_PARTS = 2
"""Number of parts of a version, such as 0.1, within which the files and their columns stay the same."""


def version_of(run: Path) -> str:
    """Return the version of sinssim that wrote a run directory, from summary.json, or else from the mark of the
    directory; "" if neither gives one."""
    return next((str(v) for v in (_read(run / "summary.json", "versions"), _read(run / MARK)) if v), "")


def _read(file: Path, *path: str) -> Any:
    try:
        summary = json.loads(file.read_text(encoding="utf-8"))
        for key in (*path, "sinssim"):
            summary = summary[key]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return summary


def is_of_another(run: Path) -> bool:
    """Return whether another version of sinssim, whose files and numbers may differ, wrote a run directory: whether the
    first two parts of the version differ; False if the version is not known."""
    version = version_of(run)
    return bool(version) and version.split(".")[:_PARTS] != __version__.split(".")[:_PARTS]


def warn_of_version(run: Path) -> None:
    """Warn of a run directory that another version of sinssim wrote."""
    if is_of_another(run):
        warn(
            f"{run} was written by sinssim {version_of(run)}, and this is {__version__}: its numbers, and the meaning "
            "of its columns, may differ. sinssim run with its scenario.toml makes it again."
        )


def reason_of(run: Path) -> str:
    """Return why a file of a run directory may lack what is needed, as a sentence: the versions if they differ;
    otherwise that the file was changed."""
    if is_of_another(run):
        return (
            f"The run was written by sinssim {version_of(run)}, and this is {__version__}; run its scenario.toml again."
        )
    return "The file was changed after the run, or belongs to another version of sinssim; run its scenario.toml again."


STATE_COLUMNS = (
    "latitude_rad", "longitude_rad", "height_m", "velocity_n_mps", "velocity_e_mps", "velocity_d_mps", "q_nb_w",
    "q_nb_x", "q_nb_y", "q_nb_z",
)  # fmt: skip
ERROR_COLUMNS = (
    "time_s", "position_n_m", "position_e_m", "position_d_m", "velocity_n_mps", "velocity_e_mps", "velocity_d_mps",
    "phi_n_rad", "phi_e_rad", "phi_d_rad",
)  # fmt: skip

_KEY = "sinssim.error"
_VERSION = 1
"""Of the rule; raised when `navigation_error` gives other numbers."""


@dataclass(frozen=True)
class ErrorRule:
    """What the errors depend on beside truth and solution."""

    semi_major_axis: float  # of the reference ellipsoid, m
    flattening: float  # of the reference ellipsoid
    axes: str  # one of `sinssim.strapdown.frames.AXES`

    def metadata(self) -> dict[str, str]:
        """Return the rule as metadata of a Parquet file; doubles keep all their bits."""
        named = {"a_m": self.semi_major_axis, "f": self.flattening, "axes": self.axes}
        return {_KEY: json.dumps({"version": _VERSION, "against": "truth", **named})}

    @classmethod
    def of_metadata(cls, metadata: Mapping[bytes, bytes], file: Path) -> Self | None:
        """Return the rule in the metadata of a file, None if there is none."""
        text = metadata.get(_KEY.encode())
        if text is None:
            return None
        rule = json.loads(text)
        if rule.get("version") != _VERSION:
            raise InputError(
                f"{file} is of another version of sinssim: the rule of its errors is {rule.get('version')}, and this "
                f"version computes rule {_VERSION}. Run its scenario.toml again."
            )
        return cls(float(rule["a_m"]), float(rule["f"]), str(rule["axes"]))


def errors_by(rule: ErrorRule, truth: list[Array], solved: list[Array]) -> list[Array]:
    """Return the errors of a solution: by `ERROR_COLUMNS`, (N,) each. `truth`: `time_s` and `STATE_COLUMNS` of the
    truth, (N,) each; `solved`: the same of the solution, at the same times."""
    ellipsoid = replace(WGS84, name="of the run", a=rule.semi_major_axis, f=rule.flattening)
    state = NavState(truth[1], truth[2], truth[3], np.stack(truth[4:7], 1), np.stack(truth[7:11], 1))
    velocity, q_nb = np.stack(solved[4:7], 1), np.stack(solved[7:11], 1)
    solution = NavSolution(solved[0], solved[1], solved[2], solved[3], velocity, q_nb, np.zeros(len(solved[0])))
    error = navigation_error(state, solution, ellipsoid, rule.axes)
    return [error.time, *error.position_ned.T, *error.velocity_ned.T, *error.attitude.T]


@dataclass(frozen=True)
class StoredStreams:
    """The streams of a run.

    The errors of an algorithm against the truth are not stored: they are computed from the streams `truth` and
    `nav_<algorithm>` by the function that computed them in the run, from the same numbers.
    """

    folder: Path  # the folder `streams` of a run directory

    @cached_property
    def names(self) -> list[str]:
        """Names of all streams, stored and computed, sorted; empty without the folder."""
        stored = {path.stem for path in self.folder.glob("*.parquet")}
        solutions = (name.removeprefix("nav_") for name in stored if name.startswith("nav_"))
        return sorted(stored | {f"error_{name}" for name in solutions if self._rule(name) is not None})

    def is_stored(self, name: str) -> bool:
        """Return whether a stream has a file."""
        return self.path(name).is_file()

    def path(self, name: str) -> Path:
        """Return the file of a stream, which a computed one does not have."""
        return self.folder / f"{name}.parquet"

    def source(self, name: str) -> Path:
        """Return the file that a stream is read from; of computed errors that of the solution."""
        return self.path(name if self.is_stored(name) else name.replace("error_", "nav_", 1))

    def columns(self, name: str) -> list[str]:
        """Return the names of a stream's columns, `time_s` first."""
        from pyarrow import parquet

        if name in self.names and not self.is_stored(name):
            return list(ERROR_COLUMNS)
        return list(parquet.read_schema(self.path(name)).names)

    def read(self, name: str, columns: tuple[str, ...] | list[str]) -> list[Array]:
        """Return columns of a stream: (N,) each. Raise OSError if there is no such stream, KeyError if it has no such
        column, InputError if errors do not follow from the files, because one was changed, pyarrow.ArrowException if a
        file is damaged."""
        if self.is_stored(name) or name not in self.names:
            return self._stored(name, columns)
        errors = dict(zip(ERROR_COLUMNS, self._errors(name.removeprefix("error_")), strict=True))
        return [errors[column] for column in columns]

    def _stored(self, name: str, columns: tuple[str, ...] | list[str]) -> list[Array]:
        from pyarrow import parquet

        table = parquet.read_table(self.path(name), columns=list(columns))
        return [table.column(column).to_numpy() for column in columns]

    def _rule(self, solution: str) -> ErrorRule | None:
        """Return how the errors of a solution follow; None if they do not, or are stored, as older versions did."""
        from pyarrow import ArrowException, parquet

        if self.is_stored(f"error_{solution}") or not self.is_stored("truth"):
            return None
        try:
            metadata = parquet.read_schema(self.path(f"nav_{solution}")).metadata
        except (OSError, ArrowException):
            return None
        return ErrorRule.of_metadata(metadata or {}, self.path(f"nav_{solution}"))

    def _errors(self, solution: str) -> list[Array]:
        """Return the errors of a solution, by `ERROR_COLUMNS`."""
        rule = self._rule(solution)
        assert rule is not None
        truth = self._stored("truth", ("time_s", *STATE_COLUMNS))
        solved = self._stored(f"nav_{solution}", ("time_s", *STATE_COLUMNS))
        if not np.array_equal(truth[0], solved[0]):
            raise InputError(
                f"{self.path(f'nav_{solution}')} and {self.path('truth')} have different times: one of them was "
                "changed after the run. Run its scenario.toml again."
            )
        return errors_by(rule, truth, solved)


def first_line(error: Exception) -> str:
    """Return what an error says in its first line, shortened, without the quotes of a `KeyError` and the full stop.
    `error`: what was raised while a stream was read."""
    text = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
    return text.split("\n", 1)[0][:200].rstrip(".")


AXES = ("forward", "right", "down")
_IMU = ("ideal", "measured", "compensated")


@dataclass(frozen=True)
class RecordedRun:
    """A finished run, read from its directory."""

    path: Path  # the run directory

    def __post_init__(self) -> None:
        if self.of_log:
            if not self.streams("nav_"):
                raise InputError(f"{self.path} has no solution: streams/nav_*.parquet are missing.")
            warn_of_version(self.path)
            return
        if not (self.path / "streams" / "truth.parquet").is_file():
            what = "does not exist" if not self.path.exists() else "holds no run: streams/truth.parquet is missing"
            raise InputError(f"{self.path} {what}. Give the directory of a run, for example runs/first_flight.")
        names = self._names("truth")
        if "coordinate_rad" in names and "latitude_rad" not in names:
            raise InputError(f"{self.path} is a run of the one-component system, which has no position on the Earth.")
        warn_of_version(self.path)

    @property
    def name(self) -> str:
        """Name of the directory."""
        return self.path.resolve().name

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Contents of summary.json."""
        try:
            summary = json.loads((self.path / "summary.json").read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(f"{self.path / 'summary.json'} cannot be read: {error}.") from error
        if not isinstance(summary, dict):
            raise InputError(f"{self.path / 'summary.json'} is not the summary of a run.")
        return summary

    @cached_property
    def _stored(self) -> StoredStreams:
        return StoredStreams(self.path / "streams")

    @cached_property
    def of_log(self) -> bool:
        """Whether it is a run on recorded sensors, which has no true motion."""
        if (self.path / "streams" / "truth.parquet").is_file() or not (self.path / "summary.json").is_file():
            return False
        return "log" in self.summary

    @cached_property
    def motion(self) -> str:
        """Name of the solution that stands for the motion: the truth; of a log the reference, if it is whole, or else
        the best solution."""
        if not self.of_log:
            return "truth"
        solutions = self.solutions
        return next((name for name in ("reference", "smoothed", "aided") if name in solutions), solutions[0])

    @property
    def start_gps_s(self) -> float | None:
        """GPS time of the run's time 0 to the microsecond; None if its clock has no date, as a simulation's."""
        if not self.of_log:
            return None
        zero = self.summary["log"].get("time_0_gps_s")
        return None if zero is None else float(zero)

    @cached_property
    def scenario(self) -> dict[str, Any]:
        """Contents of scenario.toml."""
        from sinssim.toml_mistakes import read_toml

        return read_toml(self.path / "scenario.toml")[1]

    @property
    def ellipsoid(self) -> str:
        """Name of the ellipsoid of its coordinates."""
        return str(self.scenario.get("truth", {}).get("ellipsoid", "wgs84"))

    def streams(self, begin: str) -> list[str]:
        """Return the names of the streams that begin with a word, without it.

        Args:
            begin: for example "nav_".
        """
        names = (name for name in self._stored.names if name.startswith(begin))
        return [name.removeprefix(begin) for name in names]

    @property
    def solutions(self) -> list[str]:
        """Names of the solutions: "truth", or a log's "reference", then the algorithms in the order of the summary."""
        return [*(["reference"] if self._whole_reference else [] if self.of_log else ["truth"]), *self.algorithms]

    @property
    def algorithms(self) -> list[str]:
        """Names of the computed solutions, in the order of the summary."""
        solutions = self.streams("nav_")
        order = [*self.summary.get("algorithms", {}), "aided", "backward", "smoothed"]
        return sorted(solutions, key=lambda name: (order.index(name) if name in order else len(order), name))

    @cached_property
    def _whole_reference(self) -> bool:
        """Whether it is a run of a log whose reference has velocity and attitude."""
        if not {"velocity", "attitude"} <= set(self.knows):
            return False
        return not self.scenario["log"]["reference"].get("velocity_delay_s", 0.0)  # all at the same instants

    @property
    def knows(self) -> list[str]:
        """What the reference of a log's run has: "position", "velocity", "attitude"; nothing without a reference."""
        about = self.summary.get("log", {})
        return [] if about.get("reference_file") is None else list(about["knows"])

    @cached_property
    def inertial(self) -> list[str]:
        """Kinds of inertial readings with three gyros: "ideal", "measured", "compensated"."""
        return [k for k in self.streams("imu_") if k in _IMU and "dtheta_x_rad" in self._names(f"imu_{k}")]

    @property
    def fixes(self) -> list[str]:
        """Names of the satellite receivers."""
        return [name.removesuffix("_position") for name in self.streams("aiding_") if name.endswith("_position")]

    def solution(self, name: str) -> SolutionStream:
        """Return a solution, or the truth.

        Args:
            name: one of `solutions`.
        """
        if name not in self.solutions:
            raise unknown_name(f"solution of {self.path}", name, self.solutions)
        derived = name in ("truth", "reference") and name not in self.streams("nav_")
        rows = self._table(name if derived else f"nav_{name}", ("time_s", *STATE_COLUMNS))
        if derived and name == "reference":
            whole = np.isfinite(rows[1:]).all(axis=0)  # velocities have instants of their own, and end before
            rows = [values[whole] for values in rows]
        return SolutionStream(
            rows[0], rows[1], rows[2], rows[3], "ellipsoid", np.stack(rows[4:7], 1), np.stack(rows[7:11], 1)
        )

    def increments(self, kind: str) -> InertialStream:
        """Return inertial readings, increments over the intervals that end at the stamps.

        Args:
            kind: one of `inertial`.
        """
        if kind not in self.inertial:
            raise unknown_name(f"inertial data of {self.path}", kind, self.inertial)
        if (self.path / "streams" / "rotation.parquet").exists():
            raise InputError(
                f"the sensor block of {self.path} rotates in the vehicle, and no format contains its angles, without "
                f"which the data cannot be used. The data are in streams/imu_*.parquet, and the angles in "
                f"streams/rotation.parquet; --solution exports solutions in formats without inertial data."
            )
        columns = ("dtheta_x_rad", "dtheta_y_rad", "dtheta_z_rad", "dvel_x_mps", "dvel_y_mps", "dvel_z_mps")
        rows = self._table(f"imu_{kind}", ("time_s", *columns))
        if self.of_log:
            start = min(float(self._table(f"nav_{name}", ("time_s",))[0][0]) for name in self.algorithms)
        else:
            start = float(self._table("truth", ("time_s",))[0][0])
        edges = np.concatenate(([start], rows[0]))
        interval = np.diff(edges)
        return InertialStream(
            rows[0],
            np.stack(rows[1:4], 1),
            np.stack(rows[4:7], 1),
            "increments",
            np.stack((interval, interval), 1),
            AXES,
        )

    def fix(self, name: str) -> FixStream:
        """Return the fixes of one of the receivers in `fixes`, of its antenna, with the velocity where it is measured
        with them."""
        if name not in self.fixes:
            raise unknown_name(f"GNSS receiver of {self.path}", name, self.fixes)
        sigma = ("sigma_n_m", "sigma_e_m", "sigma_d_m")
        rows = self._table(f"aiding_{name}_position", ("time_s", "latitude_rad", "longitude_rad", "height_m", *sigma))
        velocity = velocity_sigma = None
        if f"{name}_velocity" in self.streams("aiding_"):
            names = [f"{what}_{axis}_mps" for what in ("velocity", "sigma") for axis in "ned"]
            measured = self._table(f"aiding_{name}_velocity", ("time_s", *names))
            if np.array_equal(measured[0], rows[0]):
                velocity, velocity_sigma = np.stack(measured[1:4], 1), np.stack(measured[4:7], 1)
        return FixStream(
            rows[0], rows[1], rows[2], rows[3], "ellipsoid", np.stack(rows[4:7], 1), velocity, velocity_sigma
        )

    def lever_arm(self, name: str) -> tuple[float, float, float]:
        """Return the place of the antenna of one of the receivers in `fixes` from the sensor block: forward, right,
        down, m."""
        receivers = self.scenario.get("log" if self.of_log else "aiding", {})
        arm = receivers.get(name, {}).get("lever_arm_m", (0.0, 0.0, 0.0))
        return float(arm[0]), float(arm[1]), float(arm[2])

    def errors(self, name: str) -> Array:
        """Return the columns of a stream of errors.

        Returns:
            (10, N): time, position, velocity, attitude.
        """
        return np.stack(self._table(f"error_{name}", ERROR_COLUMNS))

    def table(self, name: str) -> dict[str, Array]:
        """Return all columns of a stream."""
        names = self._names(name)
        return dict(zip(names, self._table(name, tuple(names)), strict=True))

    def _names(self, name: str) -> list[str]:
        """Return the names of a stream's columns."""
        from pyarrow import ArrowException

        try:
            return self._stored.columns(name)
        except (OSError, ArrowException) as error:
            raise InputError(f"{self._stored.path(name)} cannot be read: {first_line(error)}.") from error

    def _table(self, name: str, columns: tuple[str, ...]) -> list[Array]:
        """Return columns of a stream."""
        from pyarrow import ArrowException

        known = self._names(name)
        missing = [column for column in columns if column not in known]
        if missing:
            raise InputError(f"{self._stored.path(name)} has no column {missing[0]}. {reason_of(self.path)}")
        try:
            return self._stored.read(name, columns)
        except (OSError, KeyError, ArrowException) as error:
            raise InputError(
                f"{self._stored.source(name)} cannot be read: {first_line(error)}. {reason_of(self.path)}"
            ) from error
