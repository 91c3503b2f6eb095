"""What a study may decide: the textbook chapter's claims, laws beyond it, the sensor-set variants; a sentence each."""

from __future__ import annotations

CLAIMS: dict[str, str] = {
    "velocity-rate": "10–20 Hz is enough for velocity and position",
    "attitude-rate": (
        "attitude wants 50–80 Hz and a high-order algorithm to stay within a few tenths of a minute of arc"
    ),
    "cheapest": "quaternions are the cheapest at equal accuracy",
    "orthogonality": "the two quaternions of (8.19) guarantee orthogonality",
    "euler-limit": "the integration of Euler angles has no ±90° limit",
    "simplified-radii": "the simplified radii (8.16) can cost as much as a high-quality gyro",
    "latitude-rate": "1100 km/h to the north is 10 deg/h of latitude",
    "gyro-free": "without gyros the position error grows with the square of time and worse",
    "coning-drift": (
        "under coning by α at Ω, rotation vectors from n samples at a distance h drift by α²Ω(Ωh)²ⁿ n!/(2ⁿ⁺¹(2n+1)!!), "
        "from one and the one before by α²Ω(Ωh)⁴/60"
    ),
}

VARIANTS: dict[str, str] = {
    "rate-gyros": "three accelerometers and three rate gyros",
    "attitude-sensor": "three accelerometers and a sensor of the attitude in inertial space",
    "six-accelerometers-0.1m": "six accelerometers on the faces of a cube, 0.1 m from its centre, and no gyro",
    "six-accelerometers-1m": "six accelerometers on the faces of a cube, 1 m from its centre, and no gyro",
}
