"""Compares every field of a stream with what the file was written to mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING, fields
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from sinssim.data import Array
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, OtherStream, SolutionStream, Streams


def attitude(rows: Sequence[Sequence[float]]) -> Array:
    """Return quaternions of roll, pitch, heading in degrees, by another library, scalar first, (N, 4)."""
    angles = np.asarray(rows, dtype=float)
    return np.asarray(Rotation.from_euler("ZYX", angles[:, ::-1], degrees=True).as_quat(scalar_first=True))


def whole(stream: Any, *, digits: float = 1e-12, **expected: Any) -> None:
    """Every field of a stream is the expected one; one that is not named has the value of a file without it.

    `attitude_deg` stands for the quaternions: roll, pitch, heading, (N, 3). Directions in degrees are `latitude_deg`,
    `longitude_deg`, `heading_deg`.
    """
    for name in ("latitude", "longitude", "heading", "heading_sigma", "attitude_sigma"):
        if f"{name}_deg" in expected:
            expected[name] = np.radians(expected.pop(f"{name}_deg"))
    turned = expected.pop("attitude_deg", None)
    if turned is not None:
        q = attitude(turned)
        alike = np.abs(np.sum(q * stream.q_nb, axis=1, keepdims=True))
        np.testing.assert_allclose(alike, 1.0, atol=1e-14)
        np.testing.assert_allclose(stream.q_nb * np.sign(np.sum(q * stream.q_nb, axis=1, keepdims=True)), q, atol=1e-12)
        expected["q_nb"] = stream.q_nb
    names = [field.name for field in fields(stream)]
    assert set(expected) <= set(names)
    for field in fields(stream):
        found = getattr(stream, field.name)
        if field.name not in expected:
            factory = field.default_factory
            assert found == (factory() if factory is not MISSING else field.default), field.name
        elif isinstance(found, np.ndarray):
            wanted = np.asarray(expected[field.name])
            assert found.shape == wanted.shape, field.name
            np.testing.assert_allclose(found, wanted, rtol=digits, atol=digits * 1e-3, err_msg=field.name)
        else:
            assert found == expected[field.name], field.name


def only(
    streams: Streams,
    origin: int | None,
    kind: str,
    note: str,
    *,
    notes: Sequence[str] = (),
) -> dict[str, InertialStream | FixStream | SolutionStream | OtherStream]:
    """Return the streams of a file by name; its clock and its notes are the expected ones."""
    assert streams.clock == Clock(kind, origin, note)  # type: ignore[arg-type]
    assert list(streams.notes) == list(notes)
    return {**streams.inertial, **streams.fixes, **streams.solutions, **{one.name: one for one in streams.others}}
