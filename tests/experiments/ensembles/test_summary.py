"""The numbers of an ensemble of seven given runs, each worked out from its definition."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.stats import binom, chi2

from sinssim.data import Array
from sinssim.experiments.ensembles.ensemble_errors import COMPONENTS, empty
from sinssim.experiments.ensembles.ensemble_plan import Plan, make_plan
from sinssim.experiments.ensembles.ensemble_result import EnsembleResult
from sinssim.experiments.ensembles.ensemble_run import EnsembleMedia
from sinssim.experiments.ensembles.ensemble_summary import DEFINITIONS, ensemble_numbers, part_121, summary_of
from sinssim.experiments.ensembles.ensemble_verdicts import judge
from sinssim.statistics import circle_radius
from sinssim.statistics.requirements import parse_requirement
from tests.experiments.ensembles.examples import scenario

NAN, INF = math.nan, math.inf
TIME = np.array([10.0, 13.0, 20.0, 26.0, 40.0])  # s; that at 20 s is of a requirement alone
ELAPSED = [0.0, 3.0, 10.0, 16.0, 30.0]
NORTH = [3.0, -5.0, NAN, 8.0, -7.0, 20.0, 9.0]  # at the end of each run, m
EAST = [-4.0, 12.0, NAN, 15.0, -24.0, 21.0, -40.0]
RADIAL = [5.0, 13.0, INF, 17.0, 25.0, 29.0, 41.0]
LASTS = [30.0, 30.0, 1.0, 16.0, 30.0, 30.0, 30.0]  # run 2 failed, run 3 ended at 26 s
NMI_H = 3600.0 / 1852.0


def course(run: int, epoch: int, axis: int) -> float:
    """Return a component of the position error, m: six sevenths and five fourths of the final one on the way."""
    if run == 2 or (run == 3 and epoch > 3):
        return NAN
    last = 3 if run == 3 else 4
    final = (NORTH[run], EAST[run], 2.0 * run - 5.0)[axis]
    return final if epoch == last else final * (0.0, 6.0 / 7.0, 50.0, 1.25)[epoch]


@cache
def plan_of_seven() -> Plan:
    return make_plan(scenario(name="seven", seed=31))


def seven() -> EnsembleResult:
    plan = replace(plan_of_seven(), epochs=TIME, start=10.0, extra=(20.0,), solution="quaternion", course=0.7)
    errors = empty(7, 5, (), ("position", "heading"), ("gnss",))
    errors.number[:], errors.seed[:], errors.end[:] = range(3, 10), range(40, 47), 40.0
    errors.end[2], errors.end[3] = NAN, 26.0
    errors.failure[2] = "it went away."
    for k in range(5):
        errors.position_ned[:, k] = [[course(i, k, axis) for axis in range(3)] for i in range(7)]
    errors.velocity_ned[:] = 0.01 * errors.position_ned + np.array([0.2, 0.3, 0.5])
    errors.attitude[:] = 1e-4 * errors.position_ned - np.array([2e-3, 3e-3, 5e-3])
    errors.final[:, :3] = np.column_stack([NORTH, EAST, 2.0 * np.arange(7.0) - 5.0])
    errors.final[2] = NAN
    errors.final[:, 3:6] = 0.01 * errors.final[:, :3] + np.array([0.2, 0.3, 0.5])
    errors.final[:, 6:] = 1e-4 * errors.final[:, :3] - np.array([2e-3, 3e-3, 5e-3])
    assert errors.sigma is not None
    errors.sigma[:] = np.arange(1.0, 10.0) * np.arange(1.0, 8.0)[:, None, None]  # (run + 1)(component + 1)
    errors.sigma[2] = NAN
    for name, size in (("position", 3.0), ("heading", 1.0)):
        errors.nees_freedom[name][[0, 1, 3, 4, 5, 6], 1:] = size
        errors.nees[name][[0, 1, 3, 4, 5, 6], 1:] = size * np.array([[0.2], [0.6], [1.1], [0.9], [1.7], [1.2]])
        errors.nees[name][5, 3] *= 2.0
    errors.nis["gnss"][:], errors.nis_freedom["gnss"][:] = [2.0, 3.0, 5.0, 0.0, 7.0], [3.0, 3.0, 6.0, 0.0, 3.0]
    errors.nis["gnss"][2], errors.nis_freedom["gnss"][2] = NAN, NAN
    return EnsembleResult(
        plan,
        errors,
        seconds=1.23456,
        computed=5,
        notes=["Aha."],
        looks=(4, 7),
        times=(30.0, 3.0),
        media=EnsembleMedia(),
    )


def percentile(values: list[float], share: float) -> dict[str, float]:
    """Return a percentile and its band; a number between two places belongs to both in proportion."""
    x = [-INF, *sorted(v for v in values if not np.isnan(v)), INF]
    n = len(x) - 2

    def at(place: float) -> float:
        k = min(int(place), n)
        return x[k] if place == k else INF if np.isinf(x[k + 1]) else x[k] + (place - k) * (x[k + 1] - x[k])

    below = [float(binom.cdf(k - 1, n, share)) for k in range(n + 2)]  # P(B < k)
    low = max((k for k in range(n + 1) if below[k] <= 0.025), default=0)
    part = (0.025 - below[low]) / (below[low + 1] - below[low]) if low else 0.0
    high = next((k for k in range(1, n + 1) if 1.0 - below[k] <= 0.025), n + 1)
    back = (0.025 - 1.0 + below[high]) / (below[high] - below[high - 1]) if high <= n else 0.0
    return {
        "value": at(min(max((n + 1.0 / 3.0) * share + 1.0 / 3.0, 1.0), float(n))),
        "low": max(at(low + part), 0.0),
        "high": at(high - back),
        "runs": n,
    }


def close(found: Any, wanted: Any) -> None:
    """Compare nested numbers to rounding."""
    if isinstance(wanted, dict):
        assert list(found) == list(wanted)
        for name, value in wanted.items():
            close(found[name], value)
    elif isinstance(wanted, list):
        assert len(found) == len(wanted)
        for one, other in zip(found, wanted, strict=True):
            close(one, other)
    else:
        assert found == (pytest.approx(wanted, rel=1e-12, nan_ok=True) if isinstance(wanted, float) else wanted)


def line_rates() -> list[float]:
    """Return Σtr/Σt² over the regular epochs of each run, nmi/h."""
    found = []
    for run in range(7):
        t = [ELAPSED[k] for k in (0, 1, 3, 4) if not (run == 3 and k == 4)]
        r = [math.hypot(course(run, k, 0), course(run, k, 1)) for k in (0, 1, 3, 4)]
        found.append(INF if run == 2 else NMI_H * sum(map(math.prod, zip(t, r, strict=False))) / sum(x * x for x in t))
    return found


def test_percentiles_by_hand() -> None:
    """The helper above: median of seven, with P(B < 1) and P(B < 2) of 1 and 8 in 128."""
    found = percentile([5.0, 13.0, 17.0, 25.0, 29.0, 41.0, 50.0], 0.5)
    close(found, {"value": 25.0, "low": 5.0 + 8.0 * 2.2 / 7.0, "high": 50.0 - 9.0 * 2.2 / 7.0, "runs": 7})


def test_errors_at_the_end_and_at_times() -> None:
    found = summary_of(seven())
    close(found["final_horizontal_m"], {"cep": percentile(RADIAL, 0.5), "r95": percentile(RADIAL, 0.95)})
    assert found["final_horizontal_m"]["cep"]["value"] == 25.0
    at = []
    for k in (1, 4):
        r = [INF if i == 2 else math.hypot(course(i, k, 0), course(i, k, 1)) for i in range(7)]
        at.append({"time_s": ELAPSED[k], "cep_m": percentile(r, 0.5), "r95_m": percentile(r, 0.95)})
    assert at[1]["cep_m"]["runs"] == 6  # run 3 has ended
    close(found["at"], at)


def test_what_the_runs_are() -> None:
    found = summary_of(seven(), ensemble_numbers(seven(), "interrupted"))
    told = {
        "scenario": "seven", "status": "interrupted", "seed": 31, "solution": "quaternion", "runs": 7, "failed": 1,
        "start_s": 10.0, "end_s": 40.0, "epochs": 5, "varied": [], "looks": [4, 7],
        "failures": {"5": "it went away."}, "notes": ["Aha."], "computed": 5, "seconds": 1.235,
    }  # fmt: skip
    assert {name: found[name] for name in told} == told
    assert found["definitions"] == DEFINITIONS
    assert "own_content" not in found


def test_rates_in_both_definitions() -> None:
    found = summary_of(seven())["rate_nmi_h"]
    end = [NMI_H * r / t for r, t in zip(RADIAL, LASTS, strict=True)]
    wanted = {"line": line_rates(), "end": end}
    words = {"line": "least-squares line through the origin, Σ t r / Σ t²",
             "end": "error at the end over the time, r(T) / T"}  # fmt: skip
    close(found, {
        name: {"definition": words[name], "cep": percentile(rates, 0.5), "r95": percentile(rates, 0.95)}
        for name, rates in wanted.items()
    })  # fmt: skip
    assert part_121(seven(), 30.0).contents["quantities"] == {
        "R95 of r(T)/T, nmi/h": {**found["end"]["r95"], "limit": 2.0}
    }


def test_components_over_six_runs() -> None:
    """Mean, σ about it with five degrees of freedom, σ/√12; the mean square over 23 regular epochs of the runs."""
    found = summary_of(seven())["components"]
    assert tuple(found) == COMPONENTS
    assert [name.split("_")[-1] for name in found] == ["m"] * 3 + ["mps"] * 3 + ["rad"] * 3
    runs = [i for i in range(7) if i != 2]
    for number, one in enumerate(found.values()):
        kind, axis = divmod(number, 3)

        def error(position: float, kind: int = kind, axis: int = axis) -> float:
            shift = (0.2, 0.3, 0.5)[axis], -1e-3 * (2.0, 3.0, 5.0)[axis]
            return (position, 0.01 * position + shift[0], 1e-4 * position + shift[1])[kind]

        final = [error((NORTH[i], EAST[i], 2.0 * i - 5.0)[axis]) for i in runs]
        mean = sum(final) / 6.0
        sigma = math.sqrt(sum((x - mean) ** 2 for x in final) / 5.0)
        squares = [error(course(i, k, axis)) ** 2 for i in runs for k in (0, 1, 3, 4) if not (i == 3 and k == 4)]
        assert len(squares) == 23
        wanted = {"final_mean": mean, "final_sigma": sigma, "final_sigma_standard_error": sigma / math.sqrt(12.0),
                  "rms": math.sqrt(sum(squares) / 23.0)}  # fmt: skip
        close(one, wanted)


def test_circles_of_the_second_moments() -> None:
    """Σn² = 628, Σe² = 3002, Σne = 276 m² over six runs."""
    second = np.array([[628.0, 276.0], [276.0, 3002.0]]) / 6.0
    found = summary_of(seven())["circles_of_covariance_m"]
    close(found, {"cep": float(circle_radius(second, 0.5)), "r95": float(circle_radius(second, 0.95))})


def test_named_runs() -> None:
    """By the rate of the line: the failed one, then run 3 with its short time, then the radial errors' order."""
    found = summary_of(seven())["named_runs"]
    rates = line_rates()
    rows = sorted(range(7), key=lambda i: -rates[i])
    assert rows[0] == 2
    ranks = ["worst", "worst 2", "worst 3", "worst 4", "median", "best"]
    rows = [*rows[:5], rows[6]]  # of six that worked, the fourth is the median; it is the fifth of all
    close(found, [
        {"rank": rank, "run": i + 3, "seed": i + 40, "rate_nmi_h": rates[i], "final_horizontal_m": RADIAL[i],
         "settings": seven().member(i + 3).settings, "failure": "it went away." if i == 2 else ""}
        for rank, i in zip(ranks, rows, strict=True)
    ])  # fmt: skip


def test_nees_and_nis_over_the_runs() -> None:
    """The sum of squares over the sum of freedoms: 5.7/6 of six runs, and 7.4/6 at 26 s; bands of χ²."""
    found = summary_of(seven())
    for name, size in (("position", 3.0), ("heading", 1.0)):
        low, high = chi2.ppf(0.025, 6.0 * size) / (6.0 * size), chi2.ppf(0.975, 6.0 * size) / (6.0 * size)
        assert low < 5.7 / 6.0 < 7.4 / 6.0 < high
        mean = (3.0 * 5.7 + 7.4) / 24.0
        wanted = {"mean": mean, "share_in_band": 1.0, "end": 0.95, "low": float(low), "high": float(high)}
        close(found["nees"][name], wanted)
    low, high = (float(chi2.ppf(p, 18.0)) / 18.0 for p in (0.025, 0.975))
    wanted = {"mean": 17.0 / 15.0, "share_in_band": 0.75, "end": 7.0 / 3.0, "low": low, "high": high}
    close(found["nis"], {"gnss": wanted})
    result = seven()
    assert result.nis["gnss"].freedom.tolist() == [18.0, 18.0, 36.0, 0.0, 18.0]
    close(result.nis["gnss"].value.tolist(), [2.0 / 3.0, 1.0, 5.0 / 6.0, NAN, 7.0 / 3.0])
    # 9 tests: NIS on two sides is the least probable: 102 of 90 degrees of freedom, or an ANEES of 7.4 of 6 or 22.2 of
    # 18 on one side
    single = {"NIS": 2.0 * chi2.sf(102.0, 90.0), "position": chi2.sf(22.2, 18.0), "heading": chi2.sf(7.4, 6.0)}
    assert min(single, key=lambda name: float(single[name])) == "position"
    close(found["consistency"], {
        "verdict": "consistent", "runs": 6, "diverged": 0,
        "worst": {"test": "ANEES", "name": "position", "time_s": 26.0, "value": 7.4 / 6.0,
                  "limit": float(chi2.isf(0.01 / 9.0, 18.0)) / 18.0,
                  "probability": min(9.0 * float(single["position"]), 1.0), "tests": 9, "level": 0.01},
        "hints": [],
    })  # fmt: skip


def test_spread_and_stated_sigma_at_an_epoch() -> None:
    result = seven()
    found = result.spread("velocity_ned")
    east = [0.01 * course(i, 4, 1) + 0.3 for i in (0, 1, 4, 5, 6)]
    mean = sum(east) / 5.0
    sigma = math.sqrt(sum((x - mean) ** 2 for x in east) / 4.0)
    got = [float(x[4, 1]) for x in (found.mean, found.sigma, found.standard_error, found.runs)]
    close(got, [mean, sigma, sigma / math.sqrt(10.0), 5.0])
    stated = result.stated("attitude")
    assert stated is not None
    rms = math.sqrt((1 + 4 + 16 + 25 + 36 + 49) / 6.0)  # over the runs 0, 1, 3, 4, 5, 6
    assert stated == pytest.approx(np.tile([7.0 * rms, 8.0 * rms, 9.0 * rms], (5, 1)), rel=1e-12)


def test_verdicts_in_the_units_as_written() -> None:
    """The failed run is beyond each limit; run 3 counts with its own end and until it."""
    result = seven()
    texts = ["cep(end) <= 0.02 nmi", "heading(16 s) <= 12 arcmin", "rate(end) <= 30 nmi/h", "cep(10 s) <= 3 km"]
    result.verdicts = tuple(judge(result, parse_requirement(text)) for text in texts)
    found = summary_of(result)["requirements"]
    assert [one["requirement"] for one in found] == texts
    assert [one["unit"] for one in found] == ["nmi", "arcmin", "nmi/h", "km"]
    assert [one["limit"] for one in found] == pytest.approx([0.02, 12.0, 30.0, 3.0], rel=1e-12)
    assert [one["time_s"] for one in found] == pytest.approx([30.0, 16.0, 30.0, 10.0])
    assert [one["runs"] for one in found] == [7] * 4
    on_way = sorted(50.0 * r for r in (5.0, 13.0, 17.0, 25.0, 29.0, 41.0))[3]
    assert [one["value"] for one in found] == pytest.approx([25.0 / 1852.0, INF, INF, on_way / 1000.0], rel=1e-12)
    assert {one["confidence"] for one in found} == {0.95}


@pytest.mark.parametrize(("track", "verdict"), [(0.7, "undecided"), (NAN, "does not apply")])
def test_along_and_across_the_track(track: float, verdict: str) -> None:
    """The projections on the unit vector (cos c, sin c) and on that 90° to its right."""
    result = seven()
    result.plan = replace(result.plan, course=track)
    found = part_121(result, 36_001.0).contents
    assert found["rule"].endswith("beyond 10 h, ±20 nmi across the track and ±25 nmi along it in 95 % of flights")
    assert found["verdict"] == verdict
    if verdict == "does not apply":
        assert found["quantities"] == {}
        return
    ahead, right = (math.cos(track), math.sin(track)), (-math.sin(track), math.cos(track))
    wanted = {}
    for name, unit, limit in (("across", right, 20.0), ("along", ahead, 25.0)):
        miles = [INF if i == 2 else abs(NORTH[i] * unit[0] + EAST[i] * unit[1]) / 1852.0 for i in range(7)]
        wanted[f"95 % {name} the track, nmi"] = {**percentile(miles, 0.95), "limit": limit}
    close(found["quantities"], wanted)
    rule = part_121(result, 36_000.0).rule
    assert rule.endswith("up to 10 h, at most 2 nmi/h of circular error in 95 % of flights, r(T)/T")


def test_the_rule_is_that_of_the_duration_and_not_of_the_clock() -> None:
    """30 s of a run that begins ten hours after the zero of its time."""
    result = seven()
    result.plan = replace(result.plan, epochs=TIME + 36_000.0, start=36_010.0, extra=(36_020.0,))
    result.errors.end += 36_000.0
    found = summary_of(result)
    assert "up to 10 h" in found["part_121"]["rule"]
    assert (found["start_s"], found["end_s"]) == (36_010.0, 36_040.0)
    close(found["rate_nmi_h"], summary_of(seven())["rate_nmi_h"])


def test_every_column_of_the_tables(tmp_path) -> None:
    result = seven()
    epochs, runs = (pq.read_table(file).to_pydict() for file in result.to_parquet(tmp_path))

    def same(found: list[float], wanted: Array) -> None:
        np.testing.assert_array_equal(found, wanted)

    same(epochs.pop("run"), np.repeat(np.arange(3, 10), 5))
    same(epochs.pop("time_s"), np.tile(TIME, 7))
    blocks = {
        f"{kind} {name}": values
        for kind in ("nees", "nees_freedom", "nis", "nis_freedom")
        for name, values in getattr(result.errors, kind).items()
    }
    for number, name in enumerate(COMPONENTS):
        vectors = (result.errors.position_ned, result.errors.velocity_ned, result.errors.attitude)[number // 3]
        same(epochs.pop(name), vectors[:, :, number % 3].ravel())
        sigma = np.repeat((number + 1.0) * np.arange(1.0, 8.0), 5)
        sigma[10:15] = NAN
        same(epochs.pop(f"sigma_{name}"), sigma)
        same(runs.pop(f"final_{name}"), result.errors.final[:, number])
    for name, values in blocks.items():
        same(epochs.pop(name), values.ravel())
    assert not epochs
    same(runs.pop("run"), np.arange(3, 10))
    same(runs.pop("seed"), np.arange(40, 47))
    same(runs.pop("end_s"), np.array([40.0, 40.0, NAN, 26.0, 40.0, 40.0, 40.0]))
    assert runs.pop("failure") == ["", "", "it went away.", "", "", "", ""]
    close(runs.pop("mean_rate_nmi_h"), line_rates())
    close(runs.pop("end_rate_nmi_h"), [NMI_H * r / t for r, t in zip(RADIAL, LASTS, strict=True)])
    assert not runs
