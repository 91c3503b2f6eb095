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

CURVATURES: dict[str, str] = {
    "exact": "exact radii of curvature",
    "simplified": "first order in e² and H/a, eq. (8.16)",
}

VERTICALS: dict[str, str] = {
    "free": "pure inertial height (diverges)",
    "baro-loop": "third-order loop on a height reference",
    "truth": "height held at the height reference",
}
