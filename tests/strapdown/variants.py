"""Algorithms that are one another's series cut at another order, with or without restoration.

Each takes the compiler 1.6 s in each frame. Their steps are tested uncompiled, all of them; navigation by those of
them that are not in `COMPILED` is tested by slow tests.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest

VARIANTS = tuple(
    f"{kind}-{order}{end}"
    for kind, restored in (("quaternion", "-norm"), ("poisson", "-ortho"))
    for order in (1, 2, 3, 4)
    for end in ("", restored)
)
COMPILED = ("quaternion-1-norm", "quaternion-4", "poisson-1", "poisson-2-ortho")


def with_slow_variants(algorithms: Iterable[str]) -> list[Any]:
    """Return parameters of a test by algorithm, some of the variants of which are slow."""
    return [
        pytest.param(name, marks=pytest.mark.slow) if name in VARIANTS and name not in COMPILED else name
        for name in algorithms
    ]
