"""The tests themselves on trial: faults planted into kernels, filter and error theory are found."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

from sinssim import jit
from sinssim.rotation import cross_k
from tests.mutation.__main__ import Session, equivalents, score, survivors
from tests.mutation.mutants import ROOT, Mutant, Target, bare, change, mutants, sample, targets
from tests.mutation.plain_kernels import pytest_configure

SMALL, *_, LARGE = sorted(targets(), key=lambda target: (ROOT / target.file).stat().st_size)


def test_targets_and_their_tests_are_there() -> None:
    for target in targets():
        assert (ROOT / target.file).is_file(), target.file
        assert target.tests, target.file
        for test in target.tests:
            assert (ROOT / test.split("::")[0]).is_file(), test


def test_what_is_listed_as_equivalent_is_still_in_the_code_and_has_a_reason() -> None:
    known = {target.file for target in targets()}
    for entry in equivalents():
        assert set(entry) == {"file", "before", "after", "reason"}
        assert entry["file"] in known
        assert entry["before"] != entry["after"]
        assert entry["reason"].endswith(".")
        lines = {bare(line) for line in (ROOT / entry["file"]).read_text(encoding="utf-8").splitlines()}
        assert set(entry["before"].splitlines()) <= lines, entry["before"]


def test_a_sample_is_spread_and_a_larger_one_contains_it() -> None:
    few, many = (sample([SMALL, LARGE], size, 3) for size in (60, 120))
    assert many[:60] == few
    assert sample([SMALL, LARGE], 60, 4) != few
    whole = [len(list(mutants(target))) for target in (SMALL, LARGE)]
    count = Counter(m.target.file for m in many)
    assert abs(count[LARGE.file] - 120 * whole[1] / sum(whole)) <= 1.0
    assert len(set(many)) == 120
    assert len({m.job for m in many}) == 120


def test_annotations_signatures_and_decorators_are_left_alone(tmp_path: Path) -> None:
    source = tmp_path / "sample.py"
    source.write_text("@lru_cache(maxsize=4)\ndef f(a: int | None = 3, *, b: bytes | None) -> A | B:\n    x = a | 1\n")
    found = mutants(Target("", str(source), ()))
    assert sorted((m.operator.removeprefix("core/"), *m.start) for m in found) == [
        ("NumberReplacer", 2, 22),
        ("NumberReplacer", 2, 22),
        ("NumberReplacer", 3, 12),
        ("NumberReplacer", 3, 12),
        ("ReplaceBinaryOperator_BitOr_BitAnd", 3, 10),
    ]


def test_a_change_is_told_by_its_lines() -> None:
    diff = "--- mutation diff ---\n--- a/f\n+++ b/f\n@@ -1,3 +1,3 @@\n a\n-    x = - 1  # one\n+    x = + 1  # one\n b"
    assert change(diff) == ("x = - 1", "x = + 1")


def test_importing_the_tools_leaves_the_compiler_alone() -> None:
    """Where the import replaced it, the kernels of every later test of the process ran as plain Python."""
    assert jit._jit.__module__ == jit.__name__
    assert isinstance(cross_k, Dispatcher)


def part(x: float) -> float:
    return x


def twice(x: float) -> float:
    return 2.0 * x


def whole(x: float) -> float:
    return part(x) + 1.0


def test_as_a_plugin_it_leaves_kernels_plain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "_jit", jit._jit)
    pytest_configure()
    found = jit.bind(whole, "whole_of_two", part=jit.inline(twice))
    assert not isinstance(found, Dispatcher)
    assert found(2.0) == 5.0


@pytest.mark.slow
def test_planted_faults_are_found(tmp_path: Path) -> None:
    """Of a sample of all mutants at least 95 in a hundred, but for those that change nothing."""
    size, seed = 100, 2
    command = [sys.executable, "-m", "tests.mutation", "--sample", str(size), "--seed", str(seed)]
    subprocess.run([*command, "--out", str(tmp_path)], cwd=ROOT, check=True)
    chosen: list[Mutant] = sample(targets(), size, seed)
    verdicts = Session(tmp_path, chosen).verdicts()
    assert len(verdicts) == size
    assert score(verdicts) >= 0.95, survivors(verdicts)
