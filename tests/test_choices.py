"""The choices of algorithms, frames and rates, what they state, and what kernels allow the compiler."""

from __future__ import annotations

from math import inf, pi, sqrt

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.strapdown import attitude, frames, mechanization
from sinssim.strapdown.mechanization import Mechanization
from sinssim.units import listed


def test_words_and_lists() -> None:
    assert [listed(["a"]), listed(["a", "b"]), listed(["a", "b", "c"], "or")] == ["a", "a and b", "a, b or c"]
    assert frames.frames_that(lambda frame: frame.takes_azimuth) == ["wander", "free-azimuth"]
    assert frames.frames_that(lambda frame: not frame.passes_poles) == ["level"]
    assert frames.frames_that(lambda frame: frame.takes_route) == ["transverse"]
    assert frames.frames_that(lambda frame: not frame.has_radii) == ["inertial"]
    Mechanization(frame="inertial", curvature="exact")
    with pytest.raises(InputError, match="level, wander, free-azimuth and transverse have them"):
        Mechanization(frame="inertial", curvature="simplified")
    for fine in ("quaternion", "unknown"):
        frames.check_correctable(fine)
    with pytest.raises(InputError, match="windows of samples"):
        frames.check_correctable(next(name for name, entry in attitude.REGISTRY.items() if entry.windowed))
    assert mechanization.BARO_TIME_CONSTANT == 50.0


def test_rates_that_divide() -> None:
    """33.3333 Hz is a third of 100 Hz as people write it; 100.001 Hz is not 100 Hz, and a slower rate none."""
    ratio = attitude.whole_ratio
    assert [ratio(100.0, slow) for slow in (100.0, 33.3333, 7.0, 150.0)] == [1, 3, None, None]
    assert ratio(300.0005, 100.0) == 3
    assert ratio(300.0007, 100.0) is None  # 2e-6 of the ratio
    assert (ratio(99_999.991, 1.0), ratio(99_999.985, 1.0)) == (100_000, None)  # 0.01
    assert attitude.three_rates([200, 50, 10]) == (200.0, 50.0, 10.0)
    assert attitude.three_rates((200.0, 10.0)) == (200.0, 10.0, 10.0)
    for wrong in ([200.0], [200.0, 50.0, 10.0, 5.0], "200", [200.0, inf], 5.0):
        with pytest.raises(InputError, match="must be three finite numbers, Hz"):
            attitude.three_rates(wrong)
    assert attitude.schedule((200.0, 50.0, 10.0), 400.0) == (2, 4, 5)
    for rates, said in (
        (
            (300.0, 50.0, 10.0),
            "the fast rate, 300 Hz, does not divide the data's rate, 400 Hz, a whole number of times; "
            "use 400 or 200 Hz.",
        ),
        (
            (200.0, 30.0, 10.0),
            "the medium rate, 30 Hz, does not divide the fast rate, 200 Hz, a whole number of times; "
            "use 33.3333333 or 28.5714286 Hz.",
        ),
        (
            (200.0, 50.0, 60.0),
            "the slow rate, 60 Hz, does not divide the medium rate, 50 Hz, a whole number of times; use 50 Hz.",
        ),
        ((200.0, 50.0, 0.0), "the slow rate, 0.0 Hz, must be positive."),
    ):
        with pytest.raises(InputError) as error:
            attitude.schedule(rates, 400.0)
        assert str(error.value) == f"rates_hz: {said}"


def test_what_an_algorithm_is() -> None:
    """Each name tells order, normalisation and number of samples; only these differ within a family."""
    registry = attitude.REGISTRY
    word = {"1": "first", "2": "second", "3": "third", "4": "fourth"}
    for name, entry in list(registry.items())[:27]:
        family, _, rest = name.partition("-")
        assert attitude.family(name) == {"rotation": "rotation-vector", "two": name, "functional": name}.get(
            family, family
        )
        order, _, end = rest.partition("-")
        if order in word and family in ("poisson", "quaternion"):
            normal = {"poisson": "ORTHONORMAL", "quaternion": "NORMALIZED"}[family]
            assert (entry.variant["ORDER"], entry.variant[normal]) == (int(order), bool(end))
            assert f"{word[order]}-order" in entry.sentence
            assert entry.sentence.endswith("after each step") == bool(end)
    vectors = {name: entry for name, entry in registry.items() if name.startswith("rotation-vector")}
    about = {name[16:]: (e.samples, e.sample_by_sample, e.needs_equal_intervals) for name, e in vectors.items()}
    assert about == {
        "1": (1, True, False),
        "1p": (1, True, True),
        "2": (2, False, True),
        "3": (3, False, True),
        "4": (4, False, True),
    }
    windowed = registry["functional-iteration"]
    assert (windowed.windowed, windowed.sample_by_sample, windowed.samples) == (True, False, 1)
    one, two = registry["euler"], registry["poisson-2"]
    twice = attitude.by_name(one, two, attitude.replace(two, name="euler"))
    assert list(twice) == ["euler", "poisson-2"]
    assert "has the name twice, for the files attitude.euler and attitude.poisson" in twice["euler"].problem


def stated(sentence: str, pattern: str) -> float:
    """Return the number that a sentence states, where the pattern has a group."""
    import re

    found = re.search(pattern, sentence)
    assert found, sentence
    return float(found[1])


def test_numbers_in_the_descriptions_of_choices() -> None:
    """WGS-84: e² = 0.00669438; R₁ is off most at the equator, by e⁴. The height diverges as cosh √(2g/R) t."""
    e2, a = 6.69437999e-3, 6378137.0
    latitude = np.linspace(0.0, pi / 2.0, 91)
    exact = (1.0 - e2 * np.sin(latitude) ** 2) ** 1.5 / (1.0 - e2)
    simple = 1.0 + e2 * (1.0 - 1.5 * np.sin(latitude) ** 2)
    number_ = r"([\d.]+e-\d)"
    words = mechanization.CURVATURES
    assert stated(words["simplified"], f"up to {number_}") == pytest.approx(
        np.abs(simple / exact - 1.0).max(), rel=0.02
    )
    assert stated(words["spherical"], f"up to {number_}") == pytest.approx(e2, rel=0.01)
    assert stated(words["no-height"], f"h/a, {number_}") == pytest.approx(11_000.0 / a, rel=0.02)
    growth = np.cosh(sqrt(2.0 * 9.81 / 6.371e6) * 3600.0)
    assert stated(mechanization.VERTICALS["free"], r"(\d+)-fold in an hour") == pytest.approx(growth, rel=0.005)


def test_what_a_decorator_of_kernels_allows_the_compiler() -> None:
    """Only kernels whose numbers are finite, and whose order of operations is free or kept."""
    from sinssim import jit

    ordered = {"nnan", "ninf", "nsz", "arcp", "contract"}  # without "reassoc", the order of sums and products
    for decorate, fast, inlined in (
        (jit.kernel, True, False), (jit.strict_kernel, False, False), (jit.inline, ordered, True),
        (jit.strict_inline, False, True),
    ):  # fmt: skip
        options = decorate(lambda x: x + 1.0).targetoptions
        shown = options["fastmath"]
        assert (set(shown) if isinstance(fast, set) else bool(shown)) == fast, decorate.__name__
        assert bool(options.get("forceinline", False)) == inlined, decorate.__name__
