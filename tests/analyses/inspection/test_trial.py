"""What a suggested scenario shows without the fixes of outages: the recorded drive, whole and with spoilt settings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.analyses.inspection import suggestion_trial
from sinssim.analyses.inspection.inspected_files import Inspected, _after_trial, inspect
from sinssim.analyses.inspection.stream_inspection import Inspection
from sinssim.analyses.inspection.suggestion_trial import Outcome, Trial, _moving, _robust_size, try_suggestion
from sinssim.errors import SinssimError
from sinssim.estimation.filter_result import Innovations
from sinssim.progress import silent
from sinssim.simulation import navigation_stage, recorded_filter_run, truth_and_sensors
from sinssim.simulation.recorded_filter_run import Prepared
from tests.analyses.inspection import worlds

DRIVE = Path(__file__).parent.parent.parent / "data" / "drive"


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Inspected:
    """The inspection of the recorded drive."""
    return inspect([DRIVE / "imu.csv", DRIVE / "gnss.pos"], tmp_path_factory.mktemp("drive"))


@pytest.fixture(autouse=True)
def _one_minute(monkeypatch: pytest.MonkeyPatch) -> None:
    """The trials are of one minute: two outages in a pass of the filter."""
    monkeypatch.setattr(suggestion_trial, "_LONGEST_S", 62.0)
    monkeypatch.setattr(suggestion_trial, "_PASSES", 1)


def tried(drive: Inspected, text: str) -> Trial:
    """Return the trial of a text, which is one."""
    trial = try_suggestion(text, Path("/nowhere"), drive.inspection)
    assert isinstance(trial, Trial)
    return trial


@pytest.mark.slow
def test_a_good_scenario_stays_and_says_what_it_was_tried_for(
    drive: Inspected, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(suggestion_trial, "_PASSES", 2)
    assert drive.scenario is not None
    trial = tried(drive, drive.scenario)
    assert trial.settings == ()
    assert trial.plain.outages == 4
    assert trial.chosen.error < 0.3 * trial.chosen.alone
    assert trial.written(drive.scenario) == f"# {trial.finding.sentence}\n{drive.scenario}"
    assert trial.finding.grade == "fact"


@pytest.mark.slow
def test_a_clock_that_the_motion_does_not_prove_is_tried(drive: Inspected, monkeypatch: pytest.MonkeyPatch) -> None:
    """The fixes are stamped 0.6 s late; the match suggests it without a proof, and the outages prove it."""
    assert drive.scenario is not None
    text = drive.scenario.replace("[log.gnss]\n", "[log.gnss]\ntime_offset_s = 0.6\n")
    monkeypatch.setattr(drive.inspection, "unproven_late", -0.6)
    trial = tried(drive, text)
    assert trial.settings == (("log.imu", "time_offset_s", 0.6),)
    assert trial.chosen.error < 0.3 * trial.plain.error
    lines = trial.written(text).splitlines()
    assert lines[lines.index("[log.imu]") + 1].startswith("time_offset_s = 0.6  # by trial: without it, the error in")


@pytest.mark.slow
def test_a_filter_that_refuses_the_fixes_gets_the_least_noise_with_which_it_follows_them(drive: Inspected) -> None:
    """With a tenth of the noise and no vibration the filter trusts its prediction; a larger noise mends it."""
    assert drive.scenario is not None
    lines = []
    for line in drive.scenario.splitlines():
        key, _, value = line.partition(" = ")
        spoilt = key.startswith(("gyro_arw", "accel_vrw"))
        lines.append(f"{key} = {0.1 * float(value.split()[0]):g}" if spoilt else line.replace("vibration_noise", "# "))
    trial = tried(drive, "\n".join(lines))
    assert trial.plain.refused > 0.1
    assert trial.chosen.good
    ((table, key, _),) = trial.settings
    assert (table, key) == ("filter", "inertial_noise_factor")


def test_fixes_that_are_better_than_described_get_smaller_sigmas(drive: Inspected) -> None:
    """RTK fixes of centimetres with the 1σ of code positions; with it the filter hardly uses them."""
    assert drive.scenario is not None
    stated = "position_sigma_m = [5.0, 5.0, 9.0]\nvelocity_sigma_mps = [5.0, 5.0, 5.0]\n"
    trial = tried(drive, drive.scenario.replace("[log.gnss]\n", f"[log.gnss]\n{stated}"))
    assert [key for _, key, _ in trial.settings] == ["sigma_factor", "velocity_sigma_factor"]
    assert all(0.0 < value < 0.1 for _, _, value in trial.settings)
    assert trial.chosen.error < 0.5 * trial.plain.error


def test_the_size_of_innovations_in_units_of_their_sigma() -> None:
    """Two axes with 1σ of 2 and 3 and a tenth of that noise; a third one without information, and a wild value."""
    rng = np.random.default_rng(4)
    value = rng.normal(0.0, (0.2, 0.3, 50.0), (4000, 3))
    value[7] = 1e6
    lower = np.tile((4.0, 1.0, 9.0, 0.0, 0.0, 1.0), (4000, 1))
    some = np.arange(4000.0)
    one = Innovations("gnss", "gnss-position", some, value, lower, some, some > 0.0, ("",) * 4000, 20.0)
    # the median of 8000 values of |x| has a 1σ of 0.0013
    assert _robust_size([one], "gnss-position") == pytest.approx(0.1, abs=0.006)
    assert _robust_size([one], "gnss-velocity") == np.inf


def test_a_part_with_motion_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """The vehicle stands for 30 s, and reaches 10 m/s within 10 s; a longer part has nearly the same way at first."""
    inspection = Inspection(inertial=worlds.readings(20.0), fixes=worlds.fixes(), offset=0.0)
    monkeypatch.setattr(suggestion_trial, "_LONGEST_S", 40.0)
    begin = _moving(inspection, 0.0, worlds.DURATION)
    way = np.linalg.norm(worlds.drive().state(np.arange(begin, begin + 40.0)).velocity_ned, axis=1).sum()
    assert way > 400.0
    monkeypatch.setattr(suggestion_trial, "_LONGEST_S", 100.0)
    assert _moving(inspection, 0.0, worlds.DURATION) == 0.0
    assert _moving(replace(inspection, fixes=None), 5.0, worlds.DURATION) == 5.0


def test_a_log_that_is_too_short_for_an_outage_says_so(drive: Inspected, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(suggestion_trial, "try_suggestion", lambda *_: None)
    whole = replace(drive.inspection, findings=[])
    assert _after_trial(whole, "name", Path(), silent) == "name"
    (told,) = whole.findings
    assert told.text == "No outage of 5 s can be judged: the suggested scenario is not compared with the fixes alone."
    without = replace(whole, findings=[], fixes=None)
    assert (_after_trial(without, "name", Path(), silent), without.findings) == ("name", [])


def test_a_scenario_that_does_not_run_is_told(drive: Inspected) -> None:
    assert drive.scenario is not None
    error = try_suggestion(drive.scenario.replace("imu.csv", "none.csv"), Path("/nowhere"), drive.inspection)
    assert isinstance(error, SinssimError)
    assert "none.csv" in str(error)


def test_the_result_in_words() -> None:
    """Settings stand in their tables with their reason; a good result replaces the doubts before the name."""
    one = (1.0, 1.0)
    plain = Outcome(error=37.5, sigma=20.0, alone=14.25, outages=27, refused=0.463, before=4.0, innovations=one)
    good = Outcome(error=7.5, sigma=7.0, alone=14.25, outages=27, refused=0.0, before=4.0, innovations=one)
    text = '# Doubtful.\nname = "x"\n\n[filter]\nsmooth = true\n'
    trial = Trial(plain, good, (("filter", "inertial_noise_factor", 3.0),))
    assert trial.written(text) == (
        "# The suggested scenario was run without the fixes of 27 outages of 5 s. The median horizontal error at their "
        "ends is 7.50 m; that of a straight line through the last fixes is 14.2 m.\n"
        'name = "x"\n\n[filter]\ninertial_noise_factor = 3.0  # by trial: without it, the error in outages of 5 s was '
        "37.5 m, with 46 % of the positions refused\nsmooth = true\n"
    )
    poor = Trial(plain, plain)
    assert poor.finding.grade == "doubt"
    assert poor.finding.fix == ("The filter states a 1σ of 20.0 m there. Without fixes, a straight line is better.")
    assert poor.written(text) == f"# {poor.finding.sentence}\n{text}"
    apart = replace(plain, before=20.0, refused=0.0, innovations=(0.4, 1.0))
    assert Trial(apart, apart).finding.text.endswith(
        " is 14.2 m. The filter is 20.0 m from the last fix already: the errors of the fixes last, and their 1σ is "
        "larger than what changes from fix to fix."
    )
    for other in (replace(apart, refused=0.463), replace(apart, before=14.0), replace(apart, innovations=one)):
        assert "from the last fix already" not in Trial(other, other).finding.text
    assert [plain.overconfident, good.overconfident] == [True, False]
    assert plain.badness == pytest.approx(375.0 / 14.25)


def outcome(error: float, **more: Any) -> Outcome:
    """Return an outcome beside 10 m of the fixes alone."""
    usual = {"sigma": 1.0, "alone": 10.0, "outages": 9, "refused": 0.0, "before": 1.0, "innovations": (1.0, 1.0)}
    return Outcome(error=error, **{**usual, **more})


OFFSET = ("log.imu", "time_offset_s", 0.61)
FINER = ("log.gnss", "sigma_factor", 0.12)
NOISE = [("filter", "inertial_noise_factor", factor) for factor in (3.0, 10.0, 30.0, 100.0)]


@pytest.mark.parametrize(
    ("late", "outcomes", "settings", "asked"),
    [
        # good at once: neither the offset, which is not suggested, nor noises are tried
        (0.05, {(): outcome(9.0)}, (), 1),
        # an offset that is clearly better, factors that are not, and the first noise with which it is good
        (-0.613, {(): outcome(60.0, refused=0.3), (OFFSET,): outcome(50.0, innovations=(0.123, 1.0)),
                  (OFFSET, FINER): outcome(40.0), (OFFSET, NOISE[0]): outcome(30.0), (OFFSET, NOISE[1]): outcome(9.0)},
         (OFFSET, NOISE[1]), 5),
        # noises of which none is good; the second is not clearly better than the first, the third does not run
        (0.0, {(): outcome(100.0), (NOISE[0],): outcome(40.0), (NOISE[1],): outcome(30.0),
               (NOISE[2],): SinssimError("none"), (NOISE[3],): outcome(20.0)}, (NOISE[3],), 5),
        # a good one takes the place of a bad one although it is hardly better, and not that of a good one
        (0.613, {(): outcome(11.0), (("log.imu", "time_offset_s", -0.61),): outcome(9.9, innovations=(0.123, 1.0)),
                 (("log.imu", "time_offset_s", -0.61), FINER): outcome(8.0)},
         (("log.imu", "time_offset_s", -0.61),), 3),
    ],
)  # fmt: skip
def test_what_is_tried_in_turn(
    late: float, outcomes: dict[Any, Any], settings: Any, asked: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried_settings: list[Any] = []

    def found(self: Any, some: Any) -> Any:
        tried_settings.append(some)
        one = outcomes[some]
        if isinstance(one, SinssimError):
            raise one
        return one

    monkeypatch.setattr(suggestion_trial._Attempts, "outcome", found)
    trial = try_suggestion("text", Path("/nowhere"), Inspection(inertial=None, fixes=None, unproven_late=late))
    assert isinstance(trial, Trial)
    assert (trial.settings, len(tried_settings)) == (settings, asked)
    assert (trial.plain, trial.chosen) == (outcomes[()], outcomes[settings])


def test_factors_of_fixes_that_the_text_does_not_give() -> None:
    """Innovations of 0 tell nothing, those of half of their 1σ and more need no factor."""

    def factors(text: str, *sizes: float) -> Any:
        attempts = suggestion_trial._Attempts(text, Path(), Inspection(inertial=None, fixes=None), silent)
        return attempts.better_fixes(outcome(9.0, innovations=sizes))

    assert factors("", 0.123, 0.456) == (FINER, ("log.gnss", "velocity_sigma_factor", 0.46))
    assert factors("\nsigma_factor = 2", 0.123, 0.5) == ()
    assert factors("", 0.0, 0.49) == (("log.gnss", "velocity_sigma_factor", 0.49),)


def test_an_attempt_reads_the_log_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Settings go to the scenario; those of the log need the files anew. Of the six attempts it tells the share."""
    asked: list[Any] = []
    scenario = SimpleNamespace(log=SimpleNamespace(gnss=1), filter=2)
    monkeypatch.setattr("sinssim.scenario.load.scenario_of_text", lambda *given: asked.append(given) or scenario)
    monkeypatch.setattr(suggestion_trial, "_short", lambda scenario, inspection: "short")
    monkeypatch.setattr(suggestion_trial, "_outcome", lambda *given: asked.append(given) or (9.0, "log"))
    inspection = Inspection(inertial=None, fixes=None)
    attempts = suggestion_trial._Attempts("text", Path("/a"), inspection, lambda *told: asked.append(told))
    words = "Trying the scenario in outages"
    assert [attempts.outcome(some) for some in ((), (NOISE[0],), (OFFSET,))] == [9.0] * 3
    assert asked == [
        (words, 0.0), ("text", Path("/a"), []), ("short", None),
        (words, 1.0 / 6.0), ("text", Path("/a"), ["filter.inertial_noise_factor=3.0"]), ("short", "log"),
        (words, 2.0 / 6.0), ("text", Path("/a"), ["log.imu.time_offset_s=0.61"]), ("short", None),
    ]  # fmt: skip
    scenario.log.gnss = None
    assert attempts.outcome(()) is None


def test_the_part_that_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """A minute from where the vehicle moves, unless the start is given; forwards only, without outages."""
    monkeypatch.setattr(suggestion_trial, "_moving", lambda inspection, begin, end: begin + 0.5 * (end - begin))
    inspection: Any = SimpleNamespace(inertial=SimpleNamespace(time=np.array([5.0, 205.0])))

    def part(given: bool = False, aiding: Any = None, **times: Any) -> tuple[Any, Any, Any]:
        spans = {"from_s": None, "to_s": None, **times}
        log = SimpleNamespace(**spans, start=SimpleNamespace(is_given=given), model_copy=lambda update: update)
        scenario = SimpleNamespace(log=log, filter=SimpleNamespace(model_copy=lambda update: update), aiding=aiding)
        scenario.model_copy = lambda update: update
        found: Any = suggestion_trial._short(scenario, inspection)  # type: ignore[arg-type]
        assert found["filter"] == {"smooth": False, "backward": False, "diagnose": False}
        return found["log"].pop("outages"), found["log"].get("from_s"), found["log"].get("to_s")

    assert part() == (None, 100.0, 162.0)
    assert part(from_s=20.0, to_s=100.0) == (None, 60.0, 122.0)
    assert part(given=True) == part(aiding="some") == (None, None, 62.0)
    assert part(from_s=20.0, to_s=82.0) == part(to_s=62.0) == (None, None, None)


@dataclass
class Log:
    """What is read of a log."""

    imu: Any
    fixes: Any
    reference: Any


def test_what_outages_show(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two passes from 130 s on, 5 s apart. Of each outage the error, its 1σ, the straight line and the error of the
    last row before; the second has diverged, the third has no fixes for a line. Medians are those of three."""
    monkeypatch.setattr(suggestion_trial, "_PASSES", 2)
    log = Log(SimpleNamespace(time=np.array([110.0, 170.0])), "fixes", "reference")
    prepared = Prepared("scenario", log, None, None)  # type: ignore[arg-type]
    asked: list[Any] = []
    monkeypatch.setattr(recorded_filter_run, "prepare", lambda *given: asked.append(given) or prepared)
    error = SimpleNamespace(time=np.array([125.0, 130.0, 134.0, 150.0]), horizontal=np.array([1.0, 3.0, np.nan, 7.0]))
    reference = SimpleNamespace(error_of=lambda solution: error)
    monkeypatch.setattr(recorded_filter_run, "outage_reference", lambda of: asked.append(of.log.reference) or reference)
    monkeypatch.setattr(truth_and_sensors, "sense_recorded", lambda *given: SimpleNamespace(imu=given))

    monkeypatch.setattr(navigation_stage, "recorded_start", lambda scenario, sensed: (scenario, "start"))

    def passed(imu: Any, of: Any, start: Any, spans: Any) -> Any:
        assert start == ("scenario", "start")
        scenario, motion = imu
        asked.append(((scenario, motion.reference), spans))
        some = [SimpleNamespace(kind="gnss-position", accepted=np.array([True, True, False, True]))]
        return SimpleNamespace(
            solution=None, time=np.array([151.0 if spans[0][0] < 135.0 else 165.0]), innovations=some
        )

    def errors(estimate: Any, error: Any, sigma: Any, spans: Any) -> Any:
        for begin, end in spans:
            if end < estimate.time[-1]:
                yield {"from_s": begin, "at_s": end, "horizontal_error_m": begin - 100.0, "horizontal_sigma_m": 2.0}

    monkeypatch.setattr(recorded_filter_run, "outage_pass", passed)
    monkeypatch.setattr(recorded_filter_run, "outage_errors", errors)
    line = {130.0: 50.0, 135.0: np.nan, 150.0: 70.0, 155.0: 90.0}
    monkeypatch.setattr(recorded_filter_run, "straight_line_error", lambda fixes, begin, end: line[begin] + end - begin)
    monkeypatch.setattr(suggestion_trial, "_robust_size", lambda some, kind: {"gnss-position": 0.3}.get(kind, 0.7))
    found, kept = suggestion_trial._outcome("scenario", None)  # type: ignore[arg-type]
    assert kept is log
    assert asked == [
        ("scenario", None), None, (("scenario", "reference"), ((130.0, 135.0), (150.0, 155.0))),
        (("scenario", "reference"), ((135.0, 140.0), (155.0, 160.0))),
    ]  # fmt: skip
    # errors 30, ∞ and 55 m; 1σ of 2, ∞, 2; lines 55, 75, 95; before 3, ∞, 7
    assert found == Outcome(55.0, 2.0, 75.0, 3, 0.25, 7.0, (0.3, 0.7))
    log.fixes = None
    assert suggestion_trial._outcome("scenario", None) == (None, log)  # type: ignore[arg-type]
