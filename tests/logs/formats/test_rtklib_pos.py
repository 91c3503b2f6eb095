"""RTKLIB's solution files, as its own documentation and its sample outputs have them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.logs.formats import read_file
from sinssim.logs.formats.rtklib import read_rtklib as read
from sinssim.logs.formats.rtklib import recognises_rtklib as recognises
from sinssim.logs.log_settings import LogGnss
from sinssim.logs.recorded_log import gnss_readings

HEAD = "%  {}                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)  sdne(m)  "
HEAD += "sdeu(m)  sdun(m) age(s)  ratio"
ROW = "35.5 139.7 80.25 1 8 0.0062 0.0084 0.0161 0.0004 -0.0027 0.0011 0.00 3.5"
MORE = " 1.5 -2.5 0.25 0.05 0.06 0.07 0 0 0"


def file(folder: Path, *lines: str) -> Path:
    path = folder / "solution.pos"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_dates_and_weeks_are_the_same_instants(tmp_path: Path) -> None:
    """GPS week 2200 began on 2022-03-06."""
    dated = read(file(tmp_path, HEAD.format("GPST"), f"2022/03/07 00:00:02.250 {ROW}"))
    weekly = read(file(tmp_path, HEAD.format("GPST"), f"2200 86402.250 {ROW}"))
    utc = read(file(tmp_path, HEAD.format("UTC "), f"2022/03/06 23:59:44.250 {ROW}"))
    for found in (dated, weekly, utc):
        assert found.clock.origin_gps_s == 2200 * 604800 + 86402
        np.testing.assert_allclose(found.fixes["gnss"].time, [0.25], atol=1e-12)
    assert utc.clock.kind == "utc"


def test_a_row_is_in_si_units_and_down(tmp_path: Path) -> None:
    fixes = read(file(tmp_path, HEAD.format("GPST"), f"2022/03/07 00:00:02.250 {ROW}{MORE}")).fixes["gnss"]
    assert float(fixes.latitude[0]) == pytest.approx(np.radians(35.5))
    assert float(fixes.longitude[0]) == pytest.approx(np.radians(139.7))
    assert fixes.height[0] == 80.25
    assert fixes.quality is not None
    assert fixes.quality[0] == 1
    assert fixes.quality_words == {1: "fixed"}
    np.testing.assert_allclose(fixes.position_sigma, [[0.0062, 0.0084, 0.0161]])
    np.testing.assert_allclose(fixes.velocity_ned, [[1.5, -2.5, -0.25]])
    np.testing.assert_allclose(fixes.velocity_sigma, [[0.05, 0.06, 0.07]])
    # sdeu = −0.0027: east and up are correlated negatively, east and down positively
    assert fixes.covariance is not None
    np.testing.assert_allclose(fixes.covariance[0], fixes.covariance[0].T)
    assert fixes.covariance[0][0, 1] == pytest.approx(0.0004**2)
    assert fixes.covariance[0][1, 2] == pytest.approx(0.0027**2)
    assert fixes.covariance[0][0, 2] == pytest.approx(-(0.0011**2))
    section = LogGnss(file="some.pos", sigma_factor=3.0)
    (place, *_) = gnss_readings(fixes, section, ())
    given = place.measurements
    assert given.correlation is not None
    whole = given.correlation[0] * np.outer(given.sigma[0], given.sigma[0])
    np.testing.assert_allclose(whole, 9.0 * fixes.covariance[0], rtol=1e-12)


def test_heights_refer_to_what_the_comments_say(tmp_path: Path) -> None:
    rows = (HEAD.format("GPST"), f"2022/03/07 00:00:02.250 {ROW}")
    ellipsoid = "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)"
    assert read(file(tmp_path, ellipsoid, *rows)).fixes["gnss"].datum == "ellipsoid"
    assert read(file(tmp_path, ellipsoid.replace("ellipsoidal", "geodetic"), *rows)).fixes["gnss"].datum == (
        "mean sea level"
    )
    assert read(file(tmp_path, *rows)).fixes["gnss"].datum == "unknown"


def test_the_file_is_recognised_by_itself(tmp_path: Path) -> None:
    path = file(tmp_path, HEAD.format("GPST"), f"2022/03/07 00:00:02.250 {ROW}")
    assert recognises(path, path.read_bytes())
    found = read_file(path)
    assert found is not None
    assert found.format == "rtklib-pos"


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ((HEAD.format("GPST"),), "it has no row of numbers"),
        (("% GPST e-baseline(m) n-baseline(m)",), r"no header line with latitude\(deg\)"),
        (
            (HEAD.format("GPST"), f"2022/03/07 00:00:02.250 {ROW}", "2022/03/07 00:00:03 what"),
            "line 3: this is not a row",
        ),
        ((HEAD.format("GPST"), f"2022/03/07 00:00:02.250 {ROW}", f"2200 5 {ROW} 1"), "line 3: it has 16 fields"),
        ((HEAD.format("GPST"), "2022/13/07 00:00:02.250 1 2"), "line 2: this is not a row"),
    ],
)
def test_what_cannot_be_read_names_the_line(tmp_path: Path, lines: tuple[str, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        read(file(tmp_path, *lines))
