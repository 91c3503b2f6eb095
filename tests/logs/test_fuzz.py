"""Readers under damaged files: every one is read or refused with a message that names the file, and none hangs."""

from __future__ import annotations

import signal
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.logs.formats import candidates, read_file
from tests.fuzz.mangle import rewrite
from tests.logs.formats.samples import FILES, LIBRARIES, kitti, nmea_sentence

SECONDS = 20
"""No damaged file of a few kilobytes may take longer, on a loaded machine."""


class Hang(BaseException):
    """A reader took too long. It is no Exception, so that no reader takes it for a damaged file and refuses that."""


@contextmanager
def limited() -> Iterator[None]:
    """Raise after some seconds, so that a reader that hangs fails by name."""

    def stop(*_: object) -> None:
        raise Hang(f"the reader took more than {SECONDS} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(SECONDS)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def mutated(whole: bytes, rng: np.random.Generator) -> bytes:
    """Return a file with a random damage: bits, bytes, a cut, a part twice, a part left out, another number."""
    raw = bytearray(whole)
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(0, max(len(raw), 1)))
        length = int(rng.integers(1, 64))
        match int(rng.integers(0, 9)):
            case 0 if raw:
                raw[at] ^= 1 << int(rng.integers(0, 8))
            case 1:
                raw[at : at + length] = rng.bytes(length)
            case 2:
                del raw[at:]
            case 3:
                raw[at:at] = raw[at : at + length]
            case 4:
                del raw[at : at + length]
            case 5:
                raw[at : at + 4] = b"\xff\xff\xff\xff"
            case 6:
                raw[at:at] = rng.choice([b"nan", b"1e999", b"-", b",", b"\n", b"\r", b"\0", b"9" * 40, b"\xc3\x28"])
            case 7:
                raw[at : at + 8] = np.array([rng.choice([np.nan, np.inf, -1e300, 0.0])]).tobytes()
            case _:
                lines = bytes(raw).split(b"\n")
                rng.shuffle(lines)
                raw = bytearray(b"\n".join(lines))
    return bytes(raw)


def survives(path: Path, name: str, *, with_detection: bool) -> bool:
    """Return whether a file is read; if it is refused, check the message."""
    said = ""
    try:
        with limited():
            if with_detection:
                candidates(path)
            found = read_file(path, name)
    except InputError as error:
        said = str(error)
    if said:
        assert str(path) in said, "the message names the file"
        assert len(said) < 1500
        return False
    for stream in (*found.inertial.values(), *found.fixes.values(), *found.solutions.values()):
        assert np.isfinite(stream.time).all()
        assert len(stream) > 0
    return True


def damage(name: str, folder: Path, count: int, seed: int) -> int:
    """Read many damaged files, and return how many were refused."""
    if name in LIBRARIES:
        pytest.importorskip(LIBRARIES[name])
    make, file = FILES[name]
    path = make(folder / file)
    whole = path.read_bytes()
    rng = np.random.default_rng(seed)
    refused = 0
    for k in range(count):
        raw = mutated(whole, rng)
        rewrite(path, raw)
        try:
            refused += not survives(path, name, with_detection=k % 3 == 0)
        except BaseException:
            (folder / "failed").write_bytes(raw)
            print(f"mutation {k} of seed {seed}: {folder / 'failed'}")
            raise
    return refused


def test_definitions_of_a_ulog_that_claim_more_than_the_file_has(tmp_path: Path) -> None:
    """pyulog seeks back by the length that the last message claims, and would read the same messages for ever."""
    pytest.importorskip("pyulog")
    path = FILES["ulog"][0](tmp_path / "x.ulg")
    whole = path.read_bytes()
    definitions = whole[: whole.index(struct.pack("<HB", len(b"idvehicle_imu") + 1, ord("A")))]
    back = definitions.index(b"sensor_gps:") - 3  # the header of this definition
    claimed = len(definitions) + 3 + 40 - 2 - back
    rewrite(path, definitions + struct.pack("<HB", claimed, 0) + bytes(40))
    with limited(), pytest.raises(InputError, match="holds neither vehicle_imu"):
        read_file(path, "ulog")


def test_an_nmea_quality_of_forty_digits(tmp_path: Path) -> None:
    pytest.importorskip("pynmeagps")
    path = tmp_path / "x.nmea"
    sound = "GPGGA,235959.50,4807.038,N,01131.000,E,4,08,0.9,545.4,M,46.9,M,,"
    path.write_text(nmea_sentence(sound) + nmea_sentence(sound.replace("E,4,", f"E,{'9' * 40},")))
    assert len(read_file(path, "nmea").fixes["gnss"]) == 1


@pytest.mark.parametrize("name", FILES)
def test_damaged_files(name: str, tmp_path: Path) -> None:
    assert damage(name, tmp_path, 10 if name == "ros" else 40, 1) > 0


def test_damaged_kitti(tmp_path: Path) -> None:
    path = kitti(tmp_path / "oxts")
    rng = np.random.default_rng(2)
    files = [path / "timestamps.txt", path / "data" / "0000000000.txt"]
    wholes = [file.read_bytes() for file in files]
    for _ in range(150):
        for file, whole in zip(files, wholes, strict=True):
            rewrite(file, mutated(whole, rng) if rng.random() < 0.7 else whole)
        survives(path, "kitti-oxts", with_detection=True)


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_many_damaged_files(name: str, tmp_path: Path) -> None:
    """A hundred thousand of every format that is read quickly; a tenth of it where a library parses."""
    damage(name, tmp_path, 10_000 if name in LIBRARIES else 100_000, 3)
