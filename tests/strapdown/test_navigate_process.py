"""What `navigate` costs a process: memory, compilation in the second start, and the same bits every time."""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

from sinssim import ImuData, NavState, navigate
from tests.slow import slow

ROOT = Path(__file__).parents[2]

RUN = """
    import hashlib, sys
    import numpy as np
    import sinssim
    n = 20_000
    k = np.arange(n)[:, None] + np.array([[0.0, 1.0, 2.0]])
    imu = sinssim.ImuData(np.arange(n + 1) / 100, 1e-3 * np.sin(k * 0.01), 0.01 * np.cos(k * 0.02) - [0, 0, 0.098])
    first = sinssim.NavState(0.9, 0.5, 1e3, np.array([100.0, 20.0, 0.0]), np.array([0.8, 0.0, 0.6, 0.0]))
    for algorithm in sys.argv[1:]:
        s = sinssim.navigate(imu, first, algorithm=algorithm)
        digest = hashlib.sha256()
        for array in (s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb, s.defect):
            digest.update(array.tobytes())
        print(algorithm, digest.hexdigest())
"""


def in_a_process(code, *arguments, root=ROOT, cache=None, **variables):
    environment = {**os.environ, "PYTHONPATH": str(root), **variables}
    if cache is not None:
        environment["SINSSIM_CACHE"] = str(cache)
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code), *arguments],
        env=environment, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def listing(folder):
    return {path.name: path.stat().st_mtime_ns for path in Path(folder).rglob("*.nb?")}


def test_second_process_compiles_nothing_and_gives_the_same_bits():
    """By the kernels that all tests share; `tests/test_jit.py` starts from an empty folder, with a small kernel."""
    here = io.StringIO()
    with contextlib.redirect_stdout(here), pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["-c", "quaternion"])
        exec(textwrap.dedent(RUN), {})  # compiles them if nothing has before
    first = here.getvalue()
    second = in_a_process(RUN, "quaternion", NUMBA_DEBUG_CACHE="1")
    assert "data saved" not in second
    assert "index saved" not in second
    assert "data loaded" in second
    assert [line for line in second.splitlines() if line.startswith("quaternion ")] == first.splitlines()


@pytest.mark.slow
def test_second_process_loads_what_the_first_compiled(tmp_path):
    # a copy of the package: an edit of the checkout between the two starts would rightly compile anew
    shutil.copytree(ROOT / "sinssim", tmp_path / "sinssim", ignore=shutil.ignore_patterns("__pycache__"))
    place = {"root": tmp_path, "cache": tmp_path / "cache"}
    cold = in_a_process(RUN, "quaternion", **place)
    compiled = listing(tmp_path / "cache")
    assert compiled  # something was put there
    warm = in_a_process(RUN, "quaternion", **place, NUMBA_DEBUG_CACHE="1")
    assert "data saved" not in warm
    assert "index saved" not in warm
    assert "data loaded" in warm
    assert listing(tmp_path / "cache") == compiled
    assert [line for line in warm.splitlines() if line.startswith("quaternion ")] == cold.splitlines()


@pytest.mark.slow
def test_every_algorithm_gives_the_same_bits_in_every_process():
    algorithms = ("quaternion", "poisson", "euler")
    assert in_a_process(RUN, *algorithms) == in_a_process(RUN, *algorithms)


def test_twice_in_one_process_gives_the_same_bits():
    rng = np.random.default_rng(0)
    imu = ImuData(np.arange(5001) / 100, rng.normal(0, 1e-3, (5000, 3)), rng.normal(0, 1e-2, (5000, 3)) - [0, 0, 0.098])
    first = NavState(0.9, 0.5, 1e3, np.array([100.0, 20.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0]))
    one, two = (navigate(imu, first) for _ in range(2))
    for name in ("latitude", "longitude", "height", "velocity_ned", "q_nb", "defect"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="resident memory is read from Linux' /proc")
@pytest.mark.parametrize("algorithm", slow("quaternion", "euler"))
def test_memory_stays_within_two_and_a_half_solutions(algorithm):
    """Growth of the process's resident peak during the call, over the bytes of the solution it returns."""
    code = """
        import sys
        import numpy as np
        import sinssim

        def status(key):
            with open("/proc/self/status") as file:
                return next(int(line.split()[1]) * 1024 for line in file if line.startswith(key))

        def data(n):
            return sinssim.ImuData(np.arange(n + 1) / 100, np.full((n, 3), 1e-6), np.full((n, 3), [0, 0, -0.0981]))

        first = sinssim.NavState(0.9, 0.5, 1e3, np.array([0.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0]))
        sinssim.navigate(data(1000), first, algorithm=sys.argv[1])  # everything is compiled and imported
        imu = data(720_000)
        with open("/proc/self/clear_refs", "w") as file:
            file.write("5")  # the peak starts anew
        before = status("VmRSS")
        s = sinssim.navigate(imu, first, algorithm=sys.argv[1])
        size = sum(a.nbytes for a in (s.time, s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb, s.defect))
        print((status("VmHWM") - before) / size)
    """
    assert float(in_a_process(code, algorithm)) < 2.5
