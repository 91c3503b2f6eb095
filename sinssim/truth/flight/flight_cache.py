"""The cache of flown flights on disk.

A flight is stored under a digest of everything that determines it, in a file that begins with the digest of its own
contents. An edited aircraft, plan or autopilot gives another flight, and a damaged file is replaced by flying again.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import logging
import math
import platform
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.content import find_content
from sinssim.system.extensions import source_of
from sinssim.system.files import draft, read_bytes
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.flight_log import FlightLog
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.guidance import SolutionErrors
from sinssim.truth.motion import Progress
from sinssim.truth.sampling import Channel, FlightEvent

if TYPE_CHECKING:
    pass


logger = logging.getLogger(__name__)


_KEPT = 100  # maximum number of flights; the least recently used ones are removed first


_DIGEST = hashlib.sha256().digest_size


_PACKAGE = Path(__file__).parents[2]


_SOURCES = ("earth", "rotation", "jit.py", "units.py", "truth/flight", "truth/curve.py")
"""Files and folders of the package that determine a flight; after an edit there, it is flown again."""


def cached_flight(
    flight: FlightPlan,
    seed: int = 0,
    progress: Progress | None = None,
    meanwhile: Callable[[], None] | None = None,
    errors: SolutionErrors | None = None,
) -> FlightLog:
    """Return a flight from the cache, or fly it and store it there; `meanwhile` is called once while another process
    flies. With `errors` the autopilot sees those of a navigator."""
    file = _file(flight, seed, errors)
    log = _read(file)
    if log is None:
        from sinssim.truth.curve import checked_knots, knot_derivatives  # needs the compiler
        from sinssim.truth.flight.flight_process import fly_apart

        log = fly_apart(flight, seed, progress, meanwhile, errors)
        time, position, q_eb = checked_knots(log.time, log.position_ecef, log.q_eb)
        log = replace(log, derivatives=knot_derivatives(time, position - position[0], q_eb))
        _write(file, log)
    elif progress is not None:
        progress(1.0)
    return log


@cache
def _sources() -> tuple[Path, ...]:
    """Return the source files of `_SOURCES`, sorted."""
    paths = [path for pattern in _SOURCES for path in _PACKAGE.glob(pattern)]
    return tuple(sorted({file for path in paths for file in (path.rglob("*.py") if path.is_dir() else (path,))}))


def is_cached(flight: FlightPlan, seed: int = 0) -> bool:
    """Return whether a flight is in the cache: whether `cached_flight` would not need to fly it."""
    return _file(flight, seed).is_file()


def _file(flight: FlightPlan, seed: int, errors: SolutionErrors | None = None) -> Path:
    from sinssim.jit import cache_root  # needs the compiler

    return cache_root() / "flights" / f"{flight_key(flight, seed, errors)}.flight"


def flight_key(flight: FlightPlan, seed: int, errors: SolutionErrors | None = None) -> str:
    """Return the digest of everything that determines a flight: SHA-256 over the versions, the files of the aircraft,
    the plan, the seed of a turbulence, the errors that the autopilot sees and the code, in hexadecimal."""
    import jsbsim
    import scipy

    from sinssim.truth.flight.jsbsim_model import model_folder

    digest = hashlib.sha256()

    def add(name: str, content: bytes) -> None:
        digest.update(f"{name}\0{len(content)}\0".encode())
        digest.update(content)

    add("versions", f"{jsbsim.__version__} {np.__version__} {scipy.__version__} {platform.machine()}".encode())
    judged: Any = {"aircraft": True, "guidance": True, "rnp": True, "legs": {"__all__": {"rnp"}}}
    add("flight", flight.model_dump_json(exclude=judged).encode())
    if errors is not None:
        add("guidance", errors.guidance.model_dump_json().encode())
        add("errors", np.ascontiguousarray(errors.values).tobytes())
        for name, of in (("airspeed", errors.airspeed), ("height", errors.height)):
            if of is not None:
                add(name, np.concatenate([of.time, of.arrival, of.errors]).tobytes())
    add("seed", str(seed if flight.turbulence else 0).encode())
    add("aircraft", read_bytes(find_content("aircraft", flight.aircraft)))
    model = model_folder(flight.aircraft, load_aircraft(flight.aircraft).jsbsim_model)
    for path in sorted(model.rglob("*")):
        if path.is_file():
            add(path.relative_to(model).as_posix(), read_bytes(path))
    for item in flight.user_items():
        add(item.name, source_of(item))
    for source in _sources():
        add(source.relative_to(_PACKAGE).as_posix(), source.read_bytes())
    return digest.hexdigest()


def _write(file: Path, log: FlightLog) -> None:
    """Store a flight with the derivatives of its curve; a folder that cannot be written causes only a warning.

    A line of JSON, which ends at a multiple of 64 bytes, describes the arrays of doubles that follow it.
    """
    arrays = {"time": log.time, "position_ecef": log.position_ecef, "q_eb": log.q_eb}
    if log.derivatives is not None:
        arrays |= {f"derivatives_{name}": values for name, values in log.derivatives._asdict().items()}
    for name, channel in log.channels.items():
        arrays[f"channel_time_{name}"], arrays[f"channel_{name}"] = channel.time, channel.values
    text = json.dumps(
        {
            "units": {name: channel.unit for name, channel in log.channels.items()},
            "events": [[event.time, event.text] for event in log.events],
            "shapes": {name: values.shape for name, values in arrays.items()},
        }
    ).encode()
    text += b" " * (-(len(text) + 1) % 64) + b"\n"
    content = b"".join([text, *(np.ascontiguousarray(values, np.float64).tobytes() for values in arrays.values())])
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with draft(file) as beside:
            beside.write_bytes(hashlib.sha256(content).digest() + content)
        for old in sorted(file.parent.glob("*.flight"), key=lambda path: path.stat().st_mtime)[:-_KEPT]:
            old.unlink(missing_ok=True)
    except OSError as error:
        logger.warning("the flight cannot be stored in %s (%s): it will be flown again next time.", file.parent, error)


def _read(file: Path) -> FlightLog | None:
    """Return a stored flight, or None if it is missing or damaged."""
    try:
        payload = bytearray(max(0, file.stat().st_size - _DIGEST))  # arrays of it can be written, as those of a flight
        with file.open("rb") as stored:
            digest = stored.read(_DIGEST)
            del payload[stored.readinto(payload) :]
    except FileNotFoundError:
        return None
    except OSError as error:
        logger.warning("the flight stored in %s cannot be read (%s): it is flown again.", file, error)
        return None
    if hashlib.sha256(payload).digest() != digest:
        logger.warning("the flight stored in %s is damaged: it is flown again.", file)
        return None
    from sinssim.truth.curve import KnotDerivatives  # needs the compiler

    # A file that passes the check was written by the same code, whose source is part of the file's name.
    end = payload.index(b"\n") + 1
    text, arrays = json.loads(payload[:end]), {}
    for name, shape in text["shapes"].items():
        count = math.prod(shape)
        arrays[name] = np.frombuffer(payload, np.float64, count, end).reshape(shape)
        end += 8 * count
    log = FlightLog(
        time=arrays["time"],
        position_ecef=arrays["position_ecef"],
        q_eb=arrays["q_eb"],
        channels={
            name: Channel(arrays[f"channel_time_{name}"], arrays[f"channel_{name}"], unit)
            for name, unit in text["units"].items()
        },
        events=tuple(FlightEvent(time, event) for time, event in text["events"]),
        derivatives=KnotDerivatives(*(arrays[f"derivatives_{name}"] for name in KnotDerivatives._fields)),
    )
    with contextlib.suppress(OSError):  # a read-only cache can be read
        file.touch()  # the least recently used are removed first
    return log
