"""The page of the workbench in a real browser: by the keyboard alone, with hostile names, narrow and dark."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest

from sinssim.cli import workbench_commands
from sinssim.system.files import MARK
from tests.browser import CHROMIUM, Page
from tests.cli.workbench.served import Served, served
from tests.cli.workbench.test_workbench_commands import STAND_IN, exists, until
from tests.scenario.examples import FLIGHT, PARKED

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium on this machine")]

EVIL = "<img src=x onerror=alert(1)>"
VERDICT = "document.getElementById('verdict').textContent"


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A folder with scenarios and finished runs, some with hostile names, and a hostile report."""
    folder = tmp_path_factory.mktemp("bench")
    (folder / "mine.toml").write_text(PARKED)
    (folder / "flight.toml").write_text(FLIGHT)
    (folder / f"{EVIL}.toml").write_text(PARKED + f'"{EVIL}" = 1\n')
    for name in (*(f"run {k}" for k in range(499)), EVIL):
        run = folder / "runs" / name
        run.mkdir(parents=True)
        (run / MARK).write_text('{"files": []}')
        (run / "scenario.toml").write_text(PARKED)
        (run / "summary.json").write_text(json.dumps({"scenario": EVIL, "versions": {}, "message": EVIL}))
    with served(folder) as bench:
        yield bench


@pytest.fixture
def page(bench: Served, request: pytest.FixtureRequest) -> Iterator[Page]:
    """The page of the workbench, which asks nobody else and has no errors."""
    with Page(**getattr(request, "param", {})) as page:
        page.open(address(bench), "document.querySelectorAll('#finished tbody tr').length === 500")
        yield page
        assert page.problems == []
        assert all(asked.startswith((address(bench), "data:")) for asked in page.requests)


def address(bench: Served) -> str:
    return f"http://127.0.0.1:{bench.port}/{bench.workbench.token}/"


def tab_to(page: Page, expression: str) -> None:
    """Press Tab until the element in the focus, `e`, is the wanted one; each has a visible focus."""
    for _ in range(200):
        page.key("Tab")
        if page.value(f"(e => Boolean({expression}))(document.activeElement)"):
            style = "getComputedStyle(e.id === 'text' ? document.getElementById('editor') : e)"
            assert page.value(f"(e => {style}.outlineStyle)(document.activeElement)") != "none"
            return
    raise AssertionError(expression)


def write(page: Page, before: str, *keys: str) -> None:
    """Put the cursor before a part of the text, and press keys."""
    page.value(f"(a => {{ const k = a.value.indexOf({before!r}); a.focus(); a.setSelectionRange(k, k); }})(text)")
    page.key(*keys)


def offered(page: Page) -> list[str]:
    return list(page.value("[...choices.children].map(entry => entry.firstChild.textContent)"))


def test_by_the_keyboard_alone(bench: Served, page: Page) -> None:
    tab_to(page, "e.textContent === 'mine.toml'")
    page.key("Enter")
    page.until(f"{VERDICT} === 'No mistakes' && drawn.querySelector('svg')")
    tab_to(page, "e.id === 'text'")
    write(page, "\n\n[imu]", "Enter", *"longi")
    page.until(f"{VERDICT} === '1 mistake'")
    assert offered(page) == ["longitude_deg"]
    assert page.value("document.querySelector('.choices li').textContent") == "longitude_deg°0.0"
    page.key("Enter")  # takes it, with its default chosen
    page.key(*"14.5")
    page.until(f"{VERDICT} === 'No mistakes'")
    page.key("x")
    page.until(f"{VERDICT} === '1 mistake'")
    remark = page.value("document.querySelector('.bad .remark').textContent")
    assert remark in page.value("mistakes.textContent")
    assert page.value("[...document.querySelectorAll('.back > div')].findIndex(row => row.className === 'bad')") == 5
    tab_to(page, "e.closest('#mistakes')")
    page.key("Enter")
    assert page.value("document.activeElement.id") == "text"
    assert page.value("text.value.slice(0, text.selectionStart).split('\\n').length") == 6
    write(page, "x\n", "Delete")
    page.value("document.execCommand('forwardDelete')")
    page.until(f"{VERDICT} === 'No mistakes'")
    tab_to(page, "e.id === 'save'")
    page.key("Enter")
    page.until("saved.textContent === 'saved'")
    assert (bench.workbench.folder / "mine.toml").read_text() == PARKED.replace(
        "20.0\n\n", "20.0\nlongitude_deg = 14.5\n\n"
    )


def test_a_file_that_changed_meanwhile(bench: Served, page: Page) -> None:
    page.value("[...own.querySelectorAll('button')].find(b => b.textContent === 'flight.toml').click()")
    page.until(f"{VERDICT} === 'No mistakes'")
    file = bench.workbench.folder / "flight.toml"
    file.write_text(FLIGHT + "# of another program\n")
    write(page, "seed", "#")
    tab_to(page, "e.id === 'save'")
    page.key("Enter")
    page.until("!trouble.hidden")
    assert "was changed by another program" in page.value("trouble.textContent")
    assert file.read_text() == FLIGHT + "# of another program\n"
    page.problems.clear()  # the answer 409 is one for the console
    page.value("text.value = ''; 1")


PLACES: list[tuple[str, list[str]]] = [
    ("[imu]\nrate_|", ["rate_hz"]),
    ("[imu]\nrate_hz = 1.0\nrate_|", []),
    ("[imu]\nrate_| = 1.0\n", ["rate_hz"]),
    ("imu.rate_h|", ["rate_hz"]),
    ("flight = { start = { on = \"runway\", engi|", ["engines"]),
    ("flight.legs = [{ type = \"turn\" }, { type = \"climb\", alt|", ["altitude_m"]),
    ("[[flight.legs]]\ntype = \"climb\"\nbank|", []),
    ("[[flight.legs]]\ntype = \"turn\"\nbank|", ["bank_deg"]),
    ("[navigation]\nalgorithms = [\"quaternion\", \"func|", ['"functional-iteration"']),
    ("[navigation]\nalgorithms = [\n  # \"pois|", []),
    ("[[flight.legs]]\ntype = \"clim|", ['"climb"']),
    ("[recording]\nkeep = \"rep|", ['"report"']),
    ("[navigation.ini|", ["navigation.initial_error"]),
    ("description = \"\"\"\n[imu]\nrate_|", []),
    ("[imu]\nrate_hz = 1|", []),
]  # fmt: skip


def test_what_can_stand_at_a_place(bench: Served, page: Page) -> None:
    tables = bench.ask("keys").json["tables"]
    page.value(f"window.tables = {json.dumps(tables)}; 1")
    for text, names in PLACES:
        place = text.index("|")
        call = f"editor.offers(tables, {json.dumps(text.replace('|', ''))}, {place}).items.map(item => item.label)"
        assert page.value(call) == names, text


def test_a_run_outlasts_a_reload(bench: Served, page: Page, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "program"
    program.write_text(STAND_IN.replace("Open", "Opens"))
    program.chmod(0o755)
    monkeypatch.setattr(workbench_commands.sys, "executable", str(program))
    page.value("[...own.querySelectorAll('button')].find(b => b.textContent === 'mine.toml').click()")
    page.until(f"{VERDICT} === 'No mistakes'")
    tab_to(page, "e.id === 'out'")
    page.key(*"new")
    assert page.value("line.textContent") == "sinssim run mine.toml --out=runs/new"
    tab_to(page, "e.id === 'start'")
    page.key("Enter")
    running = "document.querySelector('#commands .state')?.textContent.startsWith('Flying')"
    page.until(running)
    page.open(page.value("location.href").partition("#")[0] + "?again#mine.toml", running)
    page.until(f"{VERDICT} === 'No mistakes'")  # it opens the same scenario
    assert page.value("document.querySelector('#commands progress').value") == 0.25
    tab_to(page, "e.textContent === 'Cancel'")
    page.key("Enter")
    page.until("document.querySelector('#commands .state').textContent.startsWith('cancelled')")
    (child,) = bench.children
    assert child.code == 130
    until(lambda: not exists(int((bench.workbench.folder / "grandchild").read_text())))


def test_studies_and_alignments(tmp_path: Path) -> None:
    """A study is compared and nothing else, a scenario everything else; what has been aligned is in the list."""
    (tmp_path / "mine.toml").write_text(PARKED)
    with served(tmp_path) as bench, Page() as page:
        page.open(address(bench), "document.querySelectorAll('#shipped button').length > 3")
        choices = "[...command.options].filter(one => !one.disabled).map(one => one.value).join()"
        press = "[...document.querySelectorAll('nav button')].find(one => one.textContent === '{}').click()"
        page.value(press.format("coning"))
        page.until(f"{VERDICT} === 'No mistakes'")
        assert page.value(choices) == "compare"
        assert page.value("[line.textContent, out.placeholder]") == ["sinssim compare coning", "the study's name"]
        assert "navigations of each motion" in page.value("words.textContent")
        page.value(press.format("mine.toml"))
        page.until(f"{choices} === 'run,ensemble,budget,align,calibrate'")
        page.value("command.value = 'align', compute.dispatchEvent(new Event('input')), start.click()")
        assert page.value("line.textContent") == "sinssim align mine.toml --out=runs/mine-alignment"
        page.until("document.querySelector('#finished a')")
        cells = "[...document.querySelectorAll('#finished tbody td')].map(one => one.textContent).slice(1, 3)"
        assert page.value(cells) == ["runs/mine-alignment", "alignment"]
        assert page.problems == []


def test_names_are_texts(bench: Served, page: Page) -> None:
    page.value(f"[...own.querySelectorAll('button')].find(b => b.textContent.includes({EVIL!r})).click()")
    page.until(f"{VERDICT} === '1 mistake'")
    for part in ("own", "finished", "mistakes", "document.querySelector('.remark')", "document.getElementById('name')"):
        assert EVIL in page.value(f"{part}.textContent")
    assert page.value("document.querySelectorAll('img').length") == 0


HOSTILE = """<!DOCTYPE html><title>begins</title><script>
const body = JSON.stringify({path: "evil.toml", text: "x = 1", digest: ""}), found = [origin];
const tried = what => what.then(answer => found.push(answer.status), error => found.push(error.name));
const base = location.href.split("/files/")[0];
tried(fetch(`${base}/runs`)).then(() => tried(fetch(`${base}/save`, {method: "POST", body}))).then(() =>
  tried(fetch(`${base}/save`, {method: "POST", body, mode: "no-cors"}))).then(() => { document.title = found; });
</script>"""


def test_a_hostile_report(bench: Served, page: Page) -> None:
    folder = bench.workbench.folder
    (folder / "runs" / EVIL / "report.html").write_text(HOSTILE)
    page.open(f"{address(bench)}files/{quote(f'runs/{EVIL}/report.html')}", "document.title !== 'begins'")
    assert page.value("document.title") == "null,TypeError,TypeError,TypeError"
    assert not (folder / "evil.toml").exists()
    page.problems.clear()  # what the browser has refused


@pytest.mark.parametrize("page", [{"size": (360, 740)}, {"size": (900, 700), "dark": True}], indirect=True)
def test_narrow_and_dark(bench: Served, page: Page) -> None:
    page.value("[...own.querySelectorAll('button')].find(b => b.textContent === 'mine.toml').click()")
    page.until("drawn.querySelector('svg')")
    write(page, "rate_hz", "x")
    page.until(f"{VERDICT} === '1 mistake'")
    assert page.value("document.documentElement.scrollWidth <= innerWidth")
    rows = page.value("[...document.querySelectorAll('.back > div')].map(row => row.getBoundingClientRect().height)")
    assert set(rows) == {20}  # a remark breaks no line, so that the text stays above its picture
    assert page.serious() == []
    seen: Any = page.value("[getComputedStyle(document.body).backgroundColor, getComputedStyle(text).caretColor]")
    assert seen[0] != seen[1]
    page.value("text.value = ''; 1")
