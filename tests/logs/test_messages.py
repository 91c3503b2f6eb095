"""Messages about files that contain anything: of bounded length, and printable, whatever the file quotes."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

from sinssim.analyses.inspection.inspected_files import inspect
from sinssim.earth.harmonic_coefficients import read_icgem
from sinssim.errors import InputError, RunError, SinssimError, printable
from sinssim.logs.formats import FORMATS, read_file
from sinssim.logs.imu_samples import read_log
from sinssim.logs.track import track_format

_MOST = 6100  # characters of a message, with the word that some are left out
_ESCAPE = b"\x1b[31m\x1b]0;title\x07\x08\x7f"
_LONG = b"n" * 30_000
_NAMES = b",".join(b"name_%d" % k for k in range(1_000))

FILES = {
    "one line": b"a" * 100_000,
    "zero bytes": b"\0" * 5000,
    "binary": bytes(range(256)) * 400,
    "escapes": (_ESCAPE + b",") * 20 + b"\n" + b"1,2,3,4,5,6,7\n" * 5,
    "escapes in a track": b"time_s,lat,lon," + _ESCAPE + b"\n0,50," + _ESCAPE + b",1\n1,50,8,1\n",
    "names of a track": b"time_s,latitude_deg," + _NAMES + b"\n" + b"1,2,3\n" * 3,
    "names of columns": b"time_s,latitude_deg,longitude_deg,height_m," + _NAMES + b"\n1,2,3\n2,3,4\n4,5,6\n",
    "one name twice": b"time_s,latitude_deg,longitude_deg," + _LONG + b"," + _LONG + b"\n1,2,3,4,5\n",
    "a long field": b"time_s,lat,lon,alt\n0,50,8," + _LONG + b"\n1,50,8,1\n2,50,8,1\n",
    "numbers then words": b"1 2 3 4 5 6 7\n2 2 3 " + _LONG + _ESCAPE + b" 5 6 7\n3 2 3 4 5 6 7\n",
    "gpx": b'<?xml version="1.0"?><gpx><trk><trkseg><trkpt lat="' + _LONG + b'" lon="8"/></trkseg></trk></gpx>',
    "kml": b'<kml><Placemark><gx:Track xmlns:gx="x"><when>' + _LONG + b"</when><gx:coord>1 2</gx:coord></gx:Track>"
    b"</Placemark></kml>",
    "ardupilot": b"FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\nFMT, 1, 9, IMU, f, " + _NAMES
    + b"\nIMU, " + b"1, " * 999 + b"1\n",
    "ardupilot word": b"FMT, 1, 9, IMU, f, a\nIMU, " + _LONG + _ESCAPE + b"\n",
    "rtklib": b"%  GPST latitude(deg) longitude(deg) height(m) Q ns\n2024/01/01 " + _LONG + _ESCAPE + b"\n",
    "gnss-logger": b"# UncalGyro," + _NAMES + b"\nUncalGyro," + _LONG + b",1,2\n",
    "vbox": b"[header]\n[column names]\nsats time lat long " + _NAMES.replace(b",", b" ") + b"\n[data]\n1 2 3\n",
    "explorer": b"Latitude Longitude H-Ell " + _NAMES.replace(b",", b" ") + b"\n(D M S) (D M S) (m)\n1 2 3\n4 5 6\n",
    "icgem": b"max_degree " + _LONG + _ESCAPE + b"\nend_of_head\ngfc 2 0 1 1\n",
    "icgem line": b"earth_gravity_constant 3.986e14\nradius 6.378e6\nmax_degree 2\nend_of_head\n" + _LONG + _ESCAPE,
}  # fmt: skip


def _fine(text: str) -> bool:
    return len(text) <= _MOST and all(c.isprintable() or c == "\n" for c in text)


@pytest.mark.parametrize("name", FILES)
def test_every_reader_of_every_odd_file(tmp_path: Path, name: str) -> None:
    """No reader fails in another way, and none quotes more than three screens."""
    path = tmp_path / "odd.csv"
    path.write_bytes(FILES[name])
    uses = {
        "inspect": lambda: inspect([path]),
        "track": lambda: track_format(path, None),
        "icgem": lambda: read_icgem(path),
        "log": lambda: read_log(path),
        **{form: (lambda form=form: read_file(path, form)) for form in FORMATS},
    }
    said, texts = 0, list[tuple[str, str]]()
    for use, read in uses.items():
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = read()
        except SinssimError as error:
            said += 1
            texts.append((use, str(error)))
        else:
            texts += [(use, note) for note in getattr(found, "notes", ())]
    assert [(use, len(text), text[:200]) for use, text in texts if not _fine(text)] == []
    assert said > 5


def test_the_beginning_and_the_end_of_a_long_message_stay() -> None:
    """What is wrong stands at the beginning, and what would be right at its end."""
    text = str(InputError(f"log.csv is wrong: {'x' * 50_000}\x1b[2J\x00. Rename the column."))
    assert text.startswith("log.csv is wrong: xxx")
    assert text.endswith(r"\x1b[2J\x00. Rename the column.")
    assert _fine(text)
    assert str(RunError("σ of √2 µg: 1°\nsecond line", time=3.0)) == "σ of √2 µg: 1°\nsecond line"
    assert printable("a\tb\rc") == r"a\tb\rc"
