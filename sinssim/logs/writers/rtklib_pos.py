"""RTKLIB solution, .pos: GPST as date, latitude, longitude, height above the ellipsoid, quality, σ, velocity."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from sinssim.logs.writers.run_export import Content
from sinssim.units import DEG

SUFFIX = ".pos"
HOLDS = "solution"
_HEAD = (
    "%  GPST                      latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)  sdne(m)"
    "  sdeu(m)  sdun(m) age(s)  ratio    vn(m/s)    ve(m/s)    vu(m/s)\n"
)


def write(content: Content, place: Path) -> list[str]:
    """Write the file."""
    s = content.solution
    fixes = content.solution_name in content.run.fixes
    sigma = s.position_sigma if s.position_sigma is not None else np.zeros((len(s), 3))
    velocity = s.velocity_ned * np.array([1.0, 1.0, -1.0]) if s.velocity_ned is not None else np.zeros((len(s), 3))
    quality = 5 if fixes else 1
    seconds, ns = content.stamps(s.time)
    whole_ms = not (ns % 1_000_000).any()
    epoch = datetime(1980, 1, 6)  # GPST, which has no leap seconds
    with place.open("w", encoding="utf-8") as file:
        file.write(f"% program   : sinssim\n% inp file  : {content.run.name}, {content.solution_name}\n")
        file.write(
            "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)\n"
        )
        file.write(_HEAD)
        for second, part, latitude, longitude, height, sd, v in zip(
            seconds.tolist(), ns.tolist(), (s.latitude / DEG).tolist(), (s.longitude / DEG).tolist(),
            s.height.tolist(), sigma.tolist(), velocity.tolist(), strict=True,
        ):  # fmt: skip
            date = epoch + timedelta(seconds=second)
            decimals = f"{part // 1_000_000:03d}" if whole_ms else f"{part:09d}"
            file.write(
                f"{date:%Y/%m/%d %H:%M:%S}.{decimals} {latitude:14.9f} {longitude:14.9f} {height:10.4f} "
                f"{quality:3d}   0 "
                f"{sd[0]:8.4f} {sd[1]:8.4f} {sd[2]:8.4f}   0.0000   0.0000   0.0000   0.00    0.0 "
                f"{v[0]:10.5f} {v[1]:10.5f} {v[2]:10.5f}\n"
            )
    return [
        f"{content.solution_name}: latitude, longitude [°], height above the ellipsoid, σ north, east, up, velocity "
        f"north, east, up; quality {quality} ({'single' if fixes else 'fix'}).",
        "Times are GPST as dates.",
    ]
