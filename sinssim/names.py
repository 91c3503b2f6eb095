"""The names by which a scenario chooses among built-in parts, each with a sentence for a person.

They stand apart from what they name, so that checking a scenario and listing the choices needs no compiler.
"""

from __future__ import annotations

ALGORITHMS: dict[str, str] = {
    "quaternion": "attitude quaternion relative to the navigation frame, eq. (8.18)",
    "poisson": "direction cosine matrix by Poisson's equation",
    "euler": "Euler angles; singular at a pitch of ±90°, where it reports when and with what damage",
}

FRAMES: dict[str, str] = {
    "level": "local level, north orientation",
}

GRAVITY_MODELS: dict[str, str] = {
    "normal": "closed-form normal gravity at height, north and down components",
    "j2": "J2 gravitation plus centrifugal acceleration, as JSBSim flies under",
    "somigliana": "Somigliana on the ellipsoid times (1 − 2H/a), down only",
    "order-1e-5": "series with north and down components, relative error about 1e-5",
    "order-1e-4": "down only, latitude and height to first order, relative error about 1e-4",
    "order-1e-2": "down only, constant but for height, relative error about 1e-2",
}

ELLIPSOIDS: dict[str, str] = {
    "wgs84": "WGS-84: a = 6378137 m, f = 1/298.257223563",
    "krasovsky-1940": "Krasovsky 1940: a = 6378245 m, f = 1/298.3",
    "international-1924": "International 1924 (Hayford): a = 6378388 m, f = 1/297",
    "pz-90.11": "PZ-90.11: a = 6378136 m, f = 1/298.25784",
}

CURVATURES: dict[str, str] = {
    "exact": "exact radii of curvature",
    "simplified": "first order in e² and H/a, eq. (8.16)",
}

VERTICALS: dict[str, str] = {
    "free": "pure inertial height (diverges)",
    "baro-loop": "third-order loop on a height reference",
    "truth": "height held at the height reference",
}
