"""The server of the workbench: who may ask, what lies outside its folder, what it writes, and what it lists."""

from __future__ import annotations

import contextlib
import json
import os
import re
from collections.abc import Iterator
from urllib.parse import quote

import pytest

from sinssim.system.files import MARK
from tests.cli.workbench.served import Served, served
from tests.scenario.examples import PARKED

SECRET = "secret = true\n[parked]\n"


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A folder with a scenario, a finished run and a link that leads out of it."""
    place = tmp_path_factory.mktemp("bench")
    folder = place / "project"
    run = folder / "runs" / "one run <b>"
    run.mkdir(parents=True)
    (place / "outside.toml").write_text(SECRET)
    (place / "outside").mkdir()
    (place / "outside" / "report.html").write_text("secret")
    (folder / "mine.toml").write_text(PARKED)
    (folder / "link.toml").symlink_to(place / "outside.toml")
    (folder / "scenarios").mkdir()
    (folder / "scenarios" / "by_name.toml").symlink_to(place / "outside.toml")
    (folder / "other.toml").write_text('title = "no scenario"\n')
    (folder / "study.toml").write_text('[[parts]]\ntitle = "one"\n')
    (run / "report.html").write_text("<script>1</script>")
    (run / "scenario.toml").write_text(PARKED)
    (run / "summary.json").write_text(
        json.dumps({"scenario": "standing", "versions": {}, "algorithms": {"euler": {"rms_horizontal_error_m": 12.5}}})
    )
    (run / "elsewhere.html").symlink_to(place / "outside" / "report.html")
    (run / MARK).write_text('{"files": ["report.html"]}')
    (folder / "runs" / "away").symlink_to(place / "outside")
    with served(folder) as bench:
        yield bench


def everything(bench: Served) -> dict[str, str]:
    return {
        str(file): file.read_text() for file in sorted(bench.workbench.folder.parent.rglob("*.*")) if file.is_file()
    }


SAVE = {"path": "new.toml", "text": PARKED, "digest": ""}


@pytest.mark.parametrize("token", ["", "x", "é", "..", "%00"])
@pytest.mark.parametrize("path", ["", "scenarios", "files/runs/one%20run%20%3Cb%3E/report.html"])
def test_nothing_without_the_token(bench: Served, token: str, path: str) -> None:
    answer = bench.ask(path, token=quote(token, safe="%."))
    assert answer.status == 404
    assert b"mine" not in answer.body
    assert b"<script" not in answer.body


@pytest.mark.parametrize("host", ["evil.example:{}", "127.0.0.1.evil.example", "", "localhost.:{}", "[::2]:{}"])
def test_another_machine_s_name_is_refused(bench: Served, host: str) -> None:
    before = everything(bench)
    name = host.format(bench.port)
    statuses = [bench.ask("runs", Host=name).status]
    with contextlib.suppress(ConnectionResetError):  # the server need not read the body before it answers and hangs up
        statuses.append(bench.ask("save", SAVE, Host=name).status)
    assert set(statuses) == ({421} if host else {400})  # without a name, it is no request
    assert everything(bench) == before


@pytest.mark.parametrize(
    "headers",
    [{"Origin": "http://evil.example"}, {"Origin": "null"}, {"Origin": ""}, {"Origin": "https://127.0.0.1"},
     {"Content_Type": "text/plain"}, {"Content_Type": "application/x-www-form-urlencoded"}, {"Content_Type": ""}],
)  # fmt: skip
@pytest.mark.parametrize("what", ["save", "start", "cancel", "check"])
def test_another_page_changes_nothing(bench: Served, headers: dict[str, str], what: str) -> None:
    before = everything(bench)
    assert bench.ask(what, {**SAVE, "command": "run", "paths": ["mine.toml"]}, **headers).status == 403
    assert everything(bench) == before
    assert list(bench.children) == []


@pytest.mark.parametrize("what", ["save", "start", "cancel", "check", "plan"])
def test_reading_an_address_changes_nothing(bench: Served, what: str) -> None:
    assert bench.ask(f"{what}?path=new.toml&text=&digest=").status == 405


def test_the_page_asks_nobody_else(bench: Served) -> None:
    answer = bench.ask("")
    page = answer.body.decode()
    assert answer.status == 200
    assert answer.headers["referrer-policy"] == "no-referrer"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["content-security-policy"] == "frame-ancestors 'none'"
    (policy,) = re.findall('http-equiv="Content-Security-Policy" content="(.*?)"', page)
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert "connect-src 'self';" in policy
    assert not re.search(r"""(src|href)=["']?(https?:)?//""", page)
    assert bench.workbench.token not in page


OUTSIDE = [
    "../outside.toml",
    "link.toml",
    "by_name",
    "scenarios/by_name.toml",
    "runs/../../outside.toml",
    "{place}/outside.toml",
    "a\0b",
    "",
    ".",
    "x" * 5000,
]


@pytest.mark.parametrize("path", OUTSIDE)
def test_nothing_outside_the_folder_is_read(bench: Served, path: str) -> None:
    path = path.format(place=bench.workbench.folder.parent)
    for answer in (
        bench.ask(f"scenario?path={quote(path, safe='')}"), bench.ask("check", {"path": path, "text": ""}),
        bench.ask("plan", {"path": path, "text": PARKED, "width": 500}),
        bench.ask("start", {"command": "run", "paths": [path]}),
        bench.ask("start", {"command": "view", "paths": [path]}),
    ):  # fmt: skip
        assert answer.status == 400
        assert "secret" not in str(answer.json)
    assert list(bench.children) == []


@pytest.mark.parametrize(
    "path", [*OUTSIDE, "runs/away/new.toml", "runs/one run <b>/scenario.toml", "new.py", ".new.toml"]
)
def test_nothing_but_scenarios_of_the_folder_is_written(bench: Served, path: str) -> None:
    before = everything(bench)
    path = path.format(place=bench.workbench.folder.parent)
    assert bench.ask("save", {"path": path, "text": "x = 1\n", "digest": ""}).status == 400
    assert everything(bench) == before


@pytest.mark.parametrize(
    "path",
    ["mine.toml", "runs/away/report.html", "runs/one run <b>/elsewhere.html",
     "runs/one run <b>/../../../outside/report.html",
     "runs/one run <b>/missing.html", "runs/one run <b>", f"runs/one run <b>/{MARK}"],
)  # fmt: skip
def test_only_files_of_results_are_shown(bench: Served, path: str) -> None:
    for written in (quote(path), quote(path, safe=""), quote(path).replace("..", "%2e%2e")):
        answer = bench.ask(f"files/{written}")
        assert answer.status == 404
        assert b"secret" not in answer.body


def test_a_report_has_no_way_to_the_workbench(bench: Served) -> None:
    answer = bench.ask(f"files/{quote('runs/one run <b>/report.html')}")
    assert (answer.status, answer.body) == (200, b"<script>1</script>")
    policy = answer.headers["content-security-policy"]
    assert policy.startswith("sandbox allow-scripts allow-downloads allow-popups; default-src 'none'; ")
    assert "allow-same-origin" not in policy
    assert "connect-src" not in policy  # default-src counts


def test_the_lists(bench: Served) -> None:
    scenarios = bench.ask("scenarios").json["scenarios"]
    own = [(one["path"], one["study"]) for one in scenarios if not one["shipped"]]
    shipped = [(one["path"], one["study"]) for one in scenarios if one["shipped"]]
    assert own == [("mine.toml", False), ("study.toml", True)]  # neither the link nor the scenario of the run
    assert {("first_flight", False), ("parked", False), ("coning", True), ("gyro_trade", True)} <= set(shipped)
    assert "[[parts]]" in bench.ask("scenario?path=coning").json["text"]
    (run,) = bench.ask("runs").json["runs"]
    assert (run["path"], run["kind"], run["scenario"], run["solution"], run["error_m"]) == (
        "runs/one run <b>", "run", "standing", "euler", 12.5,
    )  # fmt: skip
    assert (run["report"], run["view"], run["text"]) == (True, False, "scenario.toml")


def test_a_text_is_saved_beside_and_renamed(bench: Served) -> None:
    folder = bench.workbench.folder
    file = folder / "below" / "saved.toml"
    digest = bench.ask("save", {"path": "below/saved.toml", "text": "a = 1\n", "digest": ""}).json["digest"]
    first = os.stat(file).st_ino
    with file.open(encoding="utf-8") as reader:  # who reads it goes on reading the old one
        assert bench.ask("save", {"path": "below/saved.toml", "text": "b = 2\n", "digest": digest}).status == 200
        assert reader.read() == "a = 1\n"
    assert os.stat(file).st_ino != first
    assert file.read_text() == "b = 2\n"
    assert [entry.name for entry in file.parent.iterdir()] == ["saved.toml"]


def test_a_file_that_has_changed_meanwhile_stays(bench: Served) -> None:
    file = bench.workbench.folder / "both.toml"
    file.write_text("a = 1\n")
    digest = bench.ask("scenario?path=both.toml").json["digest"]
    file.write_text("a = 2\n")
    for known in (digest, ""):
        answer = bench.ask("save", {"path": "both.toml", "text": "a = 3\n", "digest": known})
        assert answer.status == 409
        assert "Nothing was written" in answer.json["error"]
        assert file.read_text() == "a = 2\n"
    file.unlink()
    assert bench.ask("save", {"path": "both.toml", "text": "a = 3\n", "digest": digest}).status == 409
    assert not file.exists()


def test_line_ends_stay(bench: Served) -> None:
    file = bench.workbench.folder / "ends.toml"
    file.write_bytes(b"a = 1\r\nb = 2\r\n")
    found = bench.ask("scenario?path=ends.toml").json
    assert found["text"] == "a = 1\nb = 2\n"
    bench.ask("save", {"path": "ends.toml", "text": "a = 1\nb = 3\n", "digest": found["digest"]})
    assert file.read_bytes() == b"a = 1\r\nb = 3\r\n"


@pytest.mark.parametrize("body", [b"", b"[]", b"{", b'{"path": 1}', b'{"path": "mine.toml", "text": 1}', b"\xff",
                                  b"[" * 100_000, b" " * 4_000_001])  # fmt: skip
def test_a_request_that_is_none(bench: Served, body: bytes) -> None:
    for what in ("check", "plan", "save", "start", "cancel"):
        answer = bench.ask(what, body)
        assert answer.status == 400
        assert answer.json["error"]


def test_a_pipe_is_not_waited_for(bench: Served) -> None:
    os.mkfifo(bench.workbench.folder / "pipe.toml")
    assert "a named pipe" in bench.ask("scenario?path=pipe.toml").json["error"]
    assert bench.ask("runs").status == 200
