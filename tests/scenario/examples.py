"""Small scenario files that the tests start from."""

from __future__ import annotations

FLIGHT = """\
name = "short"
seed = 7

[flight]
aircraft = "737"

[flight.start]
on = "air"
latitude_deg = 51.0
longitude_deg = -0.5
altitude_m = 3000
airspeed_kt = 280.0

[[flight.legs]]
type = "climb"
altitude_m = 4000.0

[[flight.legs]]
type = "turn"
heading_deg = 90.0

[imu]
rate_hz = 100.0

[navigation]
algorithms = ["quaternion", "euler"]
"""

PARKED = """\
name = "standing"

[parked]
latitude_deg = 56.0
duration_s = 20.0

[imu]
rate_hz = 20.0
"""
