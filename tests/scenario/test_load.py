"""Scenario files: what is right loads to what it says, what is wrong is named with its place and its remedy."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from sinssim.errors import InputError
from sinssim.scenario import Scenario, list_content, load_scenario
from sinssim.toml_mistakes import key_lines, validate
from sinssim.truth.flight.legs import REGISTRY
from tests.scenario.examples import FLIGHT, PARKED


def write(folder: Path, text: str, name: str = "plan.toml") -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def mistake(folder: Path, text: str, *overrides: str) -> str:
    with pytest.raises(InputError) as caught:
        load_scenario(write(folder, text), overrides)
    assert caught.value.exit_code == 2
    return str(caught.value)


def test_values_arrive_as_written(tmp_path: Path) -> None:
    scenario = load_scenario(write(tmp_path, FLIGHT))
    assert scenario.name == "short"
    assert scenario.seed == 7
    assert scenario.flight is not None
    assert scenario.flight.start.altitude_m == 3000.0
    assert [leg.type for leg in scenario.flight.legs] == ["climb", "turn"]
    assert scenario.navigation.algorithms == ("quaternion", "euler")
    assert scenario.truth.gravity == "normal"


def test_name_is_the_files_by_default(tmp_path: Path) -> None:
    assert load_scenario(write(tmp_path, PARKED.split("\n", 1)[1], "evening.toml")).name == "evening"


def test_resolved_scenario_holds_every_default_and_loads_back(tmp_path: Path) -> None:
    scenario = load_scenario(write(tmp_path, FLIGHT))
    text = scenario.to_toml()
    resolved = tomllib.loads(text)
    assert resolved["navigation"]["frame"] == "level"
    assert resolved["truth"] == {"gravity": "normal", "ellipsoid": "wgs84"}
    assert resolved["flight"]["legs"][1]["heading_deg"] == 90.0
    assert load_scenario(write(tmp_path, text, "resolved.toml")) == scenario


def test_scenario_cannot_be_changed(tmp_path: Path) -> None:
    scenario = load_scenario(write(tmp_path, PARKED))
    with pytest.raises(ValueError, match="frozen"):
        scenario.seed = 3  # type: ignore[misc]


@pytest.mark.parametrize(
    ("setting", "path", "value"),
    [
        ("imu.rate_hz=200", ("imu", "rate_hz"), 200.0),
        ("imu.grade=tactical", ("imu", "grade"), "tactical"),
        ('imu.grade="laser-navigation"', ("imu", "grade"), "laser-navigation"),
        ("flight.legs.2.heading_deg = 45.0", ("flight", "legs", 1, "heading_deg"), 45.0),
        ('navigation.algorithms=["poisson"]', ("navigation", "algorithms"), ("poisson",)),
        ("navigation.initial_error.north_m=100.0", ("navigation", "initial_error", "north_m"), 100.0),
        ("imu.lever_arm_m=[1, 0, -0.5]", ("imu", "lever_arm_m"), (1.0, 0.0, -0.5)),
        ("seed=12", ("seed",), 12),
    ],
)
def test_override(tmp_path: Path, setting: str, path: tuple[str | int, ...], value: object) -> None:
    here: object = load_scenario(write(tmp_path, FLIGHT), [setting])
    for part in path:
        here = here[part] if isinstance(part, int) else getattr(here, part)  # type: ignore[index]
    assert here == value


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("nonsense", "write key.path=value"),
        ("=3", "write key.path=value"),
        ("imu.rate_hz=", "write key.path=value"),
        ("imu.lever_arm_m=[1, 2", "not a TOML value"),
        ("flight.legs.3.heading_deg=1.0", "flight.legs has entries 1 to 2; '3' is not one of them"),
        ("flight.legs.0.heading_deg=1.0", "'0' is not one of them"),
        ("seed.value=1", "seed is a value, not a table"),
        ("imu.rate_hz=-1", "imu.rate_hz = -1 must be greater than 0 (set from outside the file)"),
    ],
)
def test_bad_override(tmp_path: Path, setting: str, said: str) -> None:
    assert said in mistake(tmp_path, FLIGHT, setting)


@pytest.mark.parametrize(
    ("old", "new", "below", "said"),
    [
        # Syntax: the line, the column and the line's own text.
        ("rate_hz = 100.0", "rate_hz =", 0, "column 10: TOML syntax: Invalid value, in:  rate_hz ="),
        ("[imu]", "[imu", 0, "TOML syntax"),
        ("rate_hz = 100.0", "rate_hz = 100.0\nrate_hz = 50.0", 1, "TOML syntax: Cannot overwrite a value"),
        # Keys.
        ("rate_hz", "rate_hs", 0, "unknown key 'imu.rate_hs'. Did you mean 'imu.rate_hz'?"),
        ("[imu]", "[imi]", 0, "unknown key 'imi'. Did you mean 'imu'?"),
        ("rate_hz = 100.0", "zzz = 1", 0, "unknown key 'imu.zzz'. [imu] may have"),
        ("heading_deg = 90.0", "headin_deg = 90.0", 0, "Did you mean 'flight.legs.2.heading_deg'?"),
        ("latitude_deg = 51.0\n", "", -2, "flight.start.latitude_deg is missing (latitude of the start)"),
        # Units, with the value in the right one.
        (
            "altitude_m = 3000",
            "altitude_ft = 30000",
            0,
            "unknown key 'flight.start.altitude_ft': the unit is part of the name, use 'altitude_m' "
            "(altitude_m = 9144)",
        ),
        ("altitude_m = 3000", "altitude = 3000", 0, "the unit is part of the name, use 'altitude_m'"),
        ("airspeed_kt = 280.0", "airspeed_mps = 144.04", 0, "use 'airspeed_kt' (airspeed_kt = 279.9913"),
        ("rate_hz = 100.0", "rate_khz = 0.1", 0, "use 'rate_hz' (rate_hz = 100)"),
        # Types.
        ("altitude_m = 3000", 'altitude_m = "3000 m"', 0, "altitude_m must be a number, not the text '3000 m'"),
        ("altitude_m = 3000", "altitude_m = true", 0, "altitude_m must be a number, not true"),
        ("rate_hz = 100.0", "rate_hz = nan", 0, "imu.rate_hz must be a finite number, not nan"),
        ("rate_hz = 100.0", "lever_arm_m = 1.0", 0, "imu.lever_arm_m must be an array"),
        ("seed = 7", "seed = 7.5", 0, "seed must be a whole number, not 7.5"),
        ("seed = 7", "seed = -7", 0, "seed = -7 must be at least 0"),
        ('name = "short"', "name = 3", 0, 'name must be text in quotes, like "this", not 3'),
        ('name = "short"', 'name = "a/b"', 0, "only letters, digits"),
        # Values.
        ("rate_hz = 100.0", "rate_hz = -100.0", 0, "imu.rate_hz = -100.0 must be greater than 0"),
        ("rate_hz = 100.0", "rate_hz = 0", 0, "imu.rate_hz = 0 must be greater than 0"),
        ("latitude_deg = 51.0", "latitude_deg = 91.0", 0, "latitude_deg = 91.0 must be at most 90"),
        ("latitude_deg = 51.0", "latitude_deg = -90.5", 0, "latitude_deg = -90.5 must be at least -90"),
        # Names, with the nearest and the list.
        ('"737"', '"739"', 0, "unknown aircraft '739'. Did you mean '737'? Known: 737"),
        ('"turn"', '"trun"', 0, "flight.legs.2.type = 'trun' is not known. Did you mean 'turn'? Known: "),
        ('"turn"', '"trun"', 0, f"Known: {', '.join(REGISTRY)}."),
        ('on = "air"\n', "", -1, "flight.start lacks the key on; it must be one of: air, runway"),
        (
            'type = "turn"\n',
            "",
            -1,
            f"flight.legs.2 lacks the key type; it must be one of: {', '.join(REGISTRY)}",
        ),
        ('on = "air"', 'on = "water"', 0, "flight.start.on = 'water' is not known. Known: air, runway"),
        ('"euler"', '"eulr"', 0, "unknown algorithm 'eulr'. Did you mean 'euler'? Known: "),
        ("[imu]", '[truth]\ngravity = "jj2"\n[imu]', 1, "unknown gravity model 'jj2'. Did you mean 'j2'?"),
        ("[imu]", '[truth]\nellipsoid = "wgs72"\n[imu]', 1, "unknown ellipsoid 'wgs72'. Did you mean 'wgs84'?"),
        ("rate_hz = 100.0", 'grade = "laser-standart"', 0, "Did you mean 'laser-standard'? Known: consumer, ideal,"),
        ('"euler"]', '"euler"]\nframe = "levl"', 1, "unknown frame 'levl'. Did you mean 'level'? Known: "),
        ('"euler"]', '"euler"]\nvertical = "baro"', 1, "unknown vertical channel 'baro'. Did you mean"),
        (
            '"euler"]',
            '"euler"]\ncurvature = "round"',
            1,
            "unknown curvature 'round'. Known: exact, no-height, simplified",
        ),
        ('"euler"', '"quaternion"', 0, "algorithms: 'quaternion' stands 2 times; give each algorithm once"),
        ('["quaternion", "euler"]', "[]", 0, "navigation.algorithms must have at least 1 entry, and has 0"),
    ],
)
def test_mistake(tmp_path: Path, old: str, new: str, below: int, said: str) -> None:
    """The line that is named lies so many lines below the beginning of what was replaced."""
    line = FLIGHT[: FLIGHT.index(old)].count("\n") + 1 + below
    message = mistake(tmp_path, FLIGHT.replace(old, new, 1))
    assert said in message
    assert f"plan.toml, line {line}" in message
    assert "\n" not in message


def test_flight_without_legs(tmp_path: Path) -> None:
    head = FLIGHT[: FLIGHT.index("[[flight.legs]]")]
    assert "flight.legs is missing" in mistake(tmp_path, head)
    assert "at least" in mistake(tmp_path, head.replace("aircraft", "legs=[]\naircraft"))


def test_array_with_nothing_but_bad_legs_is_not_called_short(tmp_path: Path) -> None:
    """A leg of another type than its keys are of: what it lacks and what it has too much, and no more."""
    first, _ = FLIGHT.split('[[flight.legs]]\ntype = "turn"')
    lines = mistake(tmp_path, first.replace("altitude_m = 4000.0", "duration_s = 60.0")).split("\n  - ")
    assert lines[1] == "line 14: flight.legs.1.altitude_m is missing (target height above the ellipsoid)."
    assert lines[2].startswith("line 16: unknown key 'flight.legs.1.duration_s'. [flight.legs.1] may have: altitude_m,")
    assert len(lines) == 3


def test_zero_length(tmp_path: Path) -> None:
    assert "parked.duration_s = 0.0 must be greater than 0" in mistake(tmp_path, PARKED.replace("20.0", "0.0", 1))


def test_sources_of_truth(tmp_path: Path) -> None:
    assert "here all of them are missing" in mistake(tmp_path, 'name = "nothing"\n')
    both = FLIGHT + PARKED.split("\n", 2)[2].split("[imu]")[0]
    assert "here there are [flight] and [parked]" in mistake(tmp_path, both)


def test_every_mistake_is_listed(tmp_path: Path) -> None:
    text = FLIGHT.replace("51.0", "99.0").replace("rate_hz = 100.0", "rate_hz = -1.0\nrat_hz = 2.0").replace("737", "7")
    lines = mistake(tmp_path, text).split("\n  - ")
    assert lines[0].endswith("plan.toml: 4 mistakes:")
    assert lines[1].startswith("line 5: flight.aircraft: unknown aircraft '7'.")
    assert lines[2] == "line 9: flight.start.latitude_deg = 99.0 must be at most 90."
    assert lines[3] == "line 23: imu.rate_hz = -1.0 must be greater than 0."
    assert lines[4] == "line 24: unknown key 'imu.rat_hz'. Did you mean 'imu.rate_hz'?"


def test_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no scenario file '.*absent.toml' in .*\. Known names: "):
        load_scenario(tmp_path / "absent.toml")
    with pytest.raises(InputError, match="unknown scenario 'frist_flight'"):
        load_scenario("frist_flight")
    latin = tmp_path / "latin.toml"
    latin.write_bytes('name = "Zürich"'.encode("latin-1"))
    with pytest.raises(InputError, match="not a text file in UTF-8: byte 9"):
        load_scenario(latin)


def test_lines_of_keys() -> None:
    text = "\n".join(
        [
            "a = 1",
            "[b.c]  # comment",
            '"d" = """',
            "not_a_key = 2",
            '"""',
            "[[e]]",
            "f = 3",
            "[[e]]",
            "f = 4",
            "[e.g]",
            "h.i = 5",
        ]
    )
    tomllib.loads(text)
    assert key_lines(text) == {
        ("a",): 1,
        ("b", "c"): 2,
        ("b", "c", "d"): 3,
        ("e", "1"): 6,
        ("e", "1", "f"): 7,
        ("e", "2"): 8,
        ("e", "2", "f"): 9,
        ("e", "2", "g"): 10,
        ("e", "2", "g", "h", "i"): 11,
    }


@pytest.mark.parametrize("name", list_content("scenarios"))
def test_scenarios_of_the_package_load(name: str) -> None:
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.description


def test_schema_explains_every_key() -> None:
    """Each key has a sentence, in the field itself or among its model's attributes."""
    schema = Scenario.model_json_schema()
    for name, model in {**schema["$defs"], "Scenario": schema}.items():
        for key, field in model.get("properties", {}).items():
            table = "$ref" in field or "oneOf" in field or "anyOf" in field
            explained = "description" in field or key in model.get("description", "") or key in ("type", "on")
            assert explained or table or "_sigma_" in key, f"{name}.{key}"


def test_loading_needs_no_compiler(tmp_path: Path) -> None:
    code = (
        "import sys; from sinssim.scenario import load_scenario; load_scenario(sys.argv[1]);"
        "print([m for m in ('numba', 'scipy', 'rerun', 'jsbsim', 'pyarrow') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(write(tmp_path, FLIGHT))], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_an_aircrafts_name_may_be_a_number(tmp_path: Path) -> None:
    """On a command line there is no other way to write it: the shell takes the quotes away."""
    file = write(tmp_path, FLIGHT.replace("737", "f16"))
    scenario = load_scenario(file, ["flight.aircraft=737"])
    assert scenario.flight is not None
    assert scenario.flight.aircraft == "737"
    assert "unknown aircraft '747'. Did you mean 'B747'?" in mistake(tmp_path, FLIGHT, "flight.aircraft=747")
    assert "must be text" in mistake(tmp_path, FLIGHT, "flight.aircraft=true")


def test_one_setting_needs_no_list(tmp_path: Path) -> None:
    assert load_scenario(write(tmp_path, PARKED), "seed=3").seed == 3


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = " + "[" * 1000 + "]" * 1000, "are nested more than 20 deep; a scenario needs six"),
        ("[" + "a." * 1000 + "a]\nb = 1", "are nested more than 20 deep"),
        (PARKED + "seed = " + "9" * 5000, "cannot be read: Exceeds the limit"),
        (PARKED.replace('"standing"', f'"{"x" * 100_000}"'), "name must have at most 60 characters, and has 100000"),
        (PARKED.replace("56.0", f'"{"x" * 100_000}"'), "latitude_deg must be a number, not the text 'xxxxx"),
        (PARKED.replace("56.0", "9" * 300), "99999… (300 characters) must be at most 90"),
        (PARKED.replace("latitude_deg", "latitude" * 10_000), "unknown key 'parked.latitudelatitude"),
        (FLIGHT.replace('"737"', f'"{"7" * 100_000}"'), "unknown aircraft '777777"),
        (FLIGHT.replace('"737"', '"' + "../" * 3000 + '737"'), "no aircraft file '../../"),
        (FLIGHT.replace('"quaternion", "euler"', f'"{"q" * 100_000}"'), "unknown algorithm 'qqqqqq"),
        (FLIGHT.replace('"quaternion", "euler"', "1.5, " * 20_000), "20000 mistakes:"),
        (f'views = ["{"x" * 100_000}.py"]\n{PARKED}', "xxxxx… (100"),
        (f'views = ["{"../" * 3000}x.py"]\n{PARKED}', "there is no view '/"),
    ],
    ids=[
        "arrays",
        "tables",
        "digits",
        "name",
        "value",
        "number",
        "key",
        "aircraft",
        "path",
        "algorithm",
        "array",
        "view",
        "views",
    ],
)
def test_what_is_absurdly_large_is_named_and_not_echoed(tmp_path: Path, text: str, said: str) -> None:
    message = mistake(tmp_path, text)
    assert said in message
    assert len(message) < 3000


def test_no_more_mistakes_are_put_into_words_than_are_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Twenty thousand wrong numbers in one array took two seconds to describe."""
    described = []
    monkeypatch.setattr("sinssim.toml_mistakes._sentence", lambda error, *_: described.append(error) or str(error))
    message = mistake(tmp_path, FLIGHT.replace('"quaternion", "euler"', "1.5, " * 20_000))
    assert len(described) == 200
    assert "20000 mistakes:" in message
    assert "… and 19988 more." in message


def test_views_of_ones_own_are_named_from_the_scenarios_own_folder(tmp_path, monkeypatch):
    (tmp_path / "plans" / "views").mkdir(parents=True)
    view = tmp_path / "plans" / "views" / "mine.py"
    view.touch()
    plan = tmp_path / "plans" / "plan.toml"
    plan.write_text('views = ["views/mine.py"]\n' + PARKED)
    monkeypatch.chdir(tmp_path)
    scenario = load_scenario("plans/plan.toml")
    assert scenario.views == (str(view),)
    (tmp_path / "resolved.toml").write_text(scenario.to_toml())
    assert load_scenario("resolved.toml").views == (str(view),)
    (tmp_path / "here.py").touch()
    assert load_scenario("plans/plan.toml", 'views=["here.py"]').views == (str(tmp_path / "here.py"),)
    for wrong in ('["views/none.py"]', '["views"]', '["plan.toml"]'):
        plan.write_text(f"views = {wrong}\n" + PARKED)
        with pytest.raises(
            InputError, match=r"plan\.toml, line 1: views.*there is no view '.*; .* with the ending \.py"
        ):
            load_scenario(plan)
    plan.write_text('views = "mine.py"\n' + PARKED)
    with pytest.raises(InputError, match=r"plan\.toml, line 1: views"):
        load_scenario(plan)


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        (["a"], r"x\.toml: log\.imu\.gyro\.columns must have 3 entries, and has 1\."),
        (["a", "b", "c", "d"], r"x\.toml: log\.imu\.gyro\.columns must have at most 3 entries, and has 4\."),
    ],
)
def test_an_array_or_a_text_is_named_without_the_names_of_types(columns, says):
    gyro, accel = {"columns": columns, "unit": "rad/s"}, {"columns": "a", "unit": "m/s²"}
    log = {"imu": {"file": "a.csv", "time": "t", "gyro": gyro, "accel": accel}}
    with pytest.raises(InputError, match=f"^{says}$"):
        validate(Scenario, {"name": "x", "log": log, "imu": {"grade": "tactical"}}, "", "x.toml")


@pytest.mark.parametrize(
    ("contents", "said"),
    [
        ("gyro_bias_sigma_deg_s = 1" + "0" * 309, "imu.gyro_bias_sigma_deg_h"),
        ("gyro_bias_sigma_deg_s = -1" + "0" * 309, "imu.gyro_bias_sigma_deg_h"),
        (f"{'a.' * 200_000}a = 1", "nested more than 20 deep"),
        (f"x = {{{'a . ' * 200_000}a = 1}}", "nested more than 20 deep"),
        (f"[{'a.' * 200_000}a]", "nested more than 20 deep"),
    ],
)
def test_huge_numbers_and_keys_are_refused(tmp_path: Path, contents: str, said: str) -> None:
    """Unlike tomllib, which takes hours for a key of so many parts."""
    file = tmp_path / "huge.toml"
    file.write_text(f"name = 'x'\n[parked]\nlatitude_deg = 1.0\nduration_s = 9.0\n[imu]\n{contents}\n")
    with pytest.raises(InputError) as refused:
        load_scenario(file)
    assert said in str(refused.value)
    assert len(str(refused.value)) < 1000


@pytest.mark.parametrize("text", [f"x = {'-' * 200_000}1", f"x = {'1+' * 200_000}1", f"x = {'a.' * 200_000}b"])
def test_an_own_file_that_python_cannot_parse_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "own.py").write_text(text)
    file = tmp_path / "s.toml"
    file.write_text("use = ['own.py']\n[parked]\nlatitude_deg = 1.0\nduration_s = 9.0\n")
    with pytest.raises(InputError, match=r"own\.py cannot be read: its expressions are nested too deep"):
        load_scenario(file)
