"""Joins a triad of another file, or of other rows of a file, to the main one, and gravity to accelerations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.log import LogImu
from sinssim.logs.streams import Clock
from sinssim.logs.text.description import TriadColumns, TriadName
from sinssim.logs.text.samples import Samples, read_samples


def joined(unit: LogImu, samples: Samples, name: TriadName) -> tuple[Array, dict[TriadName, Array], tuple[str, ...]]:
    """Return the samples of the main file with the triad of another one, where both have some.

    Args:
        name: of the triad with a file or rows of its own.

    Returns:
        Times, (N,) s; the triads, (N, 3) each; a sentence.

    Raises:
        InputError: the other file cannot be read, has gaps, or does not overlap with the main one.
    """
    triad = unit.triad(name)
    assert triad is not None
    time = samples.time[1:]
    both, read, notes = _at(unit, unit, triad, name, (time, samples.clock))
    triads: dict[TriadName, Array] = {key: value[both] for key, value in samples.triads.items()}
    main = "the gyros" if name == "accel" else "the accelerometers"
    note = f"The data of {_place(unit, triad)} are interpolated linearly to the times of {main}."
    return time[both], {**triads, name: read}, (*notes, note)


def with_gravity(
    unit: LogImu, time: Array, triads: dict[TriadName, Array], clock: Clock | None
) -> tuple[Array, dict[TriadName, Array], tuple[str, ...]]:
    """Return the samples with the recorded gravity vector added to the accelerations, where both are known.

    Args:
        time: of the samples, (N,) s.
        triads: (N, 3) each.
        clock: of the main file, if it has dates.

    Returns:
        As `joined`.

    Raises:
        InputError: as for `joined`.
    """
    triad = unit.gravity
    assert triad is not None
    layout = unit.model_copy(update={"accel": triad, "gravity": None})
    both, gravity, notes = _at(unit, layout, triad, "accel", (time, clock))
    found = {key: value[both] for key, value in triads.items()}
    found["accel"] = found["accel"] + gravity
    columns = triad.columns if isinstance(triad.columns, str) else ", ".join(map(str, triad.columns))
    note = f"The specific force is the sum of the accelerations and the gravity of {_place(unit, triad)} ({columns})."
    return time[both], found, (*notes, note)


def _place(unit: LogImu, triad: TriadColumns) -> str:
    """Return the name of the file of a triad, and its rows."""
    which = "" if triad.rows is None else f" with {', '.join(f'{k} = {v}' for k, v in triad.rows.items())}"
    return f"{Path(triad.file or unit.file).name}{which}"


def _at(
    unit: LogImu, described: LogImu, triad: TriadColumns, name: TriadName, to: tuple[Array, Clock | None]
) -> tuple[NDArray[np.bool_], Array, tuple[str, ...]]:
    """Return which times lie within a triad's samples, (N,), the triad interpolated to these, (M, 3), and notes."""
    other_file = triad.file or unit.file
    layout = described if triad.rows is None else described.model_copy(update={"rows": triad.rows})
    other = read_samples(Path(other_file), layout, [name])
    time, clock = to
    shift = 0.0
    if clock is not None and other.clock is not None:
        shift = float((other.clock.origin_gps_s or 0) - (clock.origin_gps_s or 0))
    at = other.time[1:] + shift
    both = (time >= at[0]) & (time <= at[-1])
    if int(both.sum()) < 2:
        raise InputError(
            f"{unit.file} and {other_file} do not overlap: {time[0]:.9g} to {time[-1]:.9g} s and {at[0]:.9g} to "
            f"{at[-1]:.9g} s."
        )
    longest = float(np.diff(at).max())
    if longest > unit.max_gap_s:
        k = int(np.diff(at).argmax())
        raise InputError(
            f"{other_file}: no samples for {longest:.6g} s from {at[k]:.9g} s on, more than max_gap_s = "
            f"{unit.max_gap_s:g}."
        )
    read = np.stack([np.interp(time[both], at, axis) for axis in other.triads[name].T], axis=1)
    return both, read, other.notes
