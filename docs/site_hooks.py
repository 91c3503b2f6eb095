"""Hooks of the site.

They fill the marks of the pages that are partly generated, take in CONTRIBUTING.md, CHANGELOG.md, the pages of a
scenario's tables and live reports, and list pages that mkdocs.yml does not name at the end of its how-to section.
"""

from __future__ import annotations

import ast
import csv
import importlib.util
import re
import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
ABOVE = {"contributing.md": "CONTRIBUTING.md", "changelog.md": "CHANGELOG.md"}
"""Pages of the site by their file in the root of the checkout."""

TABLES = ROOT / "build" / "scenario"
"""Folder of the generated pages of a scenario's tables."""

REPORTS = ROOT / "build" / "reports"
"""Folder of the reports that docs/gallery.py writes."""

SHOWN = {
    "first-steps.md": ("images/report.png", "first_flight"),
    "ensembles.md": ("images/ensemble.png", "ensemble"),
    "budgets.md": ("images/budget.png", "budget"),
    "trades.md": ("images/gyro_trade.png", "gyro_trade"),
    "in-the-loop.md": ("images/gallery/spoofed_airliner.png", "spoofed_airliner"),
    "one-component.md": ("images/one_component.png", "one_component"),
}
"""By page: the picture in whose place the site shows a report."""

OPENED = {
    "gallery/errors_of_a_flight": "first_flight", "gallery/ensemble": "ensemble", "gallery/budget": "budget",
    "gallery/aided_uav": "mems_uav", "gallery/gravity": "gravity_disturbance", "gallery/rotating_unit": "rotating_unit",
    "gallery/spoofed_airliner": "spoofed_airliner", "gyro_trade": "gyro_trade", "figure_8_4": "one_component",
}  # fmt: skip
"""By picture of the gallery: the report that a click on it opens."""

_FENCE_OF_A_FILE = re.compile(r"^```(\w+) +(\S+)$", re.MULTILINE)
"""A block of code with the path of its file, which the site shows as its title."""

PACKAGES = (
    "sinssim",
    "sinssim.alignment",
    "sinssim.earth",
    "sinssim.rotation",
    "sinssim.sensors",
    "sinssim.estimation",
    "sinssim.statistics",
)


def public_names(package: str) -> dict[str, str]:
    """Return the public names of a package, each with the full name of the module that defines it.

    Args:
        package: full name, for example "sinssim.earth".

    Returns:
        Modules by name, in alphabetical order.
    """
    tree = ast.parse((ROOT / package.replace(".", "/") / "__init__.py").read_text(encoding="utf-8"))
    homes = {
        alias.name: str(node.module)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname == alias.name
    }
    return dict(sorted(homes.items(), key=lambda item: item[0].lower()))


def reference() -> str:
    """Return the part of the page that takes the mark's place: one heading a package, one entry a name."""
    parts = []
    for package in PACKAGES:
        parts.append(f"## {package}\n")
        parts += [f"::: {module}.{name}\n" for name, module in public_names(package).items()]
    return "\n".join(parts)


def public_logs() -> str:
    """Return the table of the public logs that sinssim was tried on."""
    logs = tomllib.loads((ROOT / "tests" / "data" / "public_logs.toml").read_text(encoding="utf-8"))["log"]
    lines = [
        "| log | device | known of it | inspect | run: error after 5 s without fixes; straight line |",
        "|---|---|---|---|---|",
    ]
    for log in logs:
        results = log.get("inspected", "right"), log.get("without_fixes", "–")
        lines.append("| " + " | ".join((f"`{log['name']}`", log["device"], log["known"], *results)) + " |")
    return "\n".join(lines)


def datasheet_lines() -> str:
    """Return the table of lines of datasheets as keys of a scenario."""
    with Path(__file__).with_name("datasheet_lines.csv").open(encoding="utf-8", newline="") as file:
        _, *rows = csv.reader(file)
    lines = ["| line of a data sheet | key | value in SI units |", "|---|---|---|"]
    lines += [f"| {line} | `{key} = {number}` | {float(si):g} |" for line, key, number, si in rows]
    return "\n".join(lines)


def _script(name: str) -> Any:
    """Return a script of this folder as a module."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


MARKS = {
    "reference.md": ("<!-- every public name -->", reference),
    "theory.md": ("<!-- formulas -->", lambda: _script("theory_page").tables()),
    "architecture.md": ("<!-- tree -->", lambda: f"```\n{_script('architecture_tree').tree()}```"),
    "sensor-errors.md": ("<!-- lines of datasheets -->", datasheet_lines),
    "validation.md": ("<!-- public logs -->", public_logs),
    "questions.md": ("<!-- answers -->", (ROOT / "build" / "questions.md").read_text),
}
"""By page: the mark in it, and the function that returns what stands in its place."""


def unlisted(navigation: Any) -> list[str]:
    """Return the pages of the folder that the navigation does not name.

    Args:
        navigation: of mkdocs.yml, nested lists and dictionaries whose leaves are pages.

    Returns:
        Their paths below the folder.
    """
    parts, named = [navigation], set()
    while parts:
        part = parts.pop()
        if isinstance(part, str):
            named.add(part)
        else:
            parts += list(part.values() if isinstance(part, dict) else part)
    folder = Path(__file__).parent
    return [
        path
        for path in sorted(page.relative_to(folder).as_posix() for page in folder.rglob("*.md"))
        if path not in named
    ]


def on_config(config: Any, **_: Any) -> Any:
    """List the pages that the navigation does not name.

    Args:
        config: of the site.

    Returns:
        The same.
    """
    section = next(entry["How-to"] for entry in config["nav"] if "How-to" in entry)
    section += unlisted(config["nav"])
    reference = next(entry["Reference"] for entry in config["nav"] if "Reference" in entry)
    tables = sorted(page.stem for page in TABLES.glob("*.md"))
    reference += [{"Tables of a scenario": [{f"[{name}]": f"scenario/{name}.md"} for name in tables]}]
    return config


def on_files(files: Any, *, config: Any, **_: Any) -> Any:
    """Add the files that lie outside the folder of the pages.

    Args:
        files: of the site.
        config: of the site.

    Returns:
        The same with the added pages.
    """
    from mkdocs.structure.files import File

    for name, source in ABOVE.items():
        files.append(File.generated(config, name, abs_src_path=str(ROOT / source)))
    for page in TABLES.glob("*.md"):
        files.append(File.generated(config, f"scenario/{page.name}", abs_src_path=str(page)))
    for report in REPORTS.glob("*.html"):
        files.append(File.generated(config, f"reports/{report.name}", abs_src_path=str(report)))
    return files


def with_reports(markdown: str, name: str) -> str:
    """Return a page with live reports in place of a picture, or behind those of the gallery, where they were written.

    Args:
        markdown: text of the page.
        name: its file.
    """
    picture, report = SHOWN.get(name, ("", ""))
    if (file := REPORTS / f"{report}.html").is_file():
        frame = (
            f'<iframe class="report" src="reports/{report}.html" title="Report of {report}" loading="lazy"></iframe>'
            f"\n\n[The report alone](reports/{report}.html), {file.stat().st_size / 1e6:.1f} MB"
        )
        markdown = re.sub(rf"!\[[^\]]*\]\({re.escape(picture)}\)", lambda _: frame, markdown)
    if name == "gallery.md":
        for picture, report in OPENED.items():
            if (file := REPORTS / f"{report}.html").is_file():
                link = rf"[\1](reports/{report}.html)\n\nA click opens its report, {file.stat().st_size / 1e6:.1f} MB."
                markdown = re.sub(rf"(!\[[^\]]*\]\(images/{re.escape(picture)}\.png\))", link, markdown)
    return markdown


_BOOST = {"logs.md": 2, "reference.md": 0.2}
"""Weights of the search: who looks for a log has one, and begins there; the reference names what pages explain."""


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Fill the page of the reference, and change the links to and from the files above the folder.

    Args:
        markdown: text of a page.
        page: the page.

    Returns:
        The text to render.
    """
    name = page.file.src_uri
    markdown = with_reports(markdown, name)
    if name in MARKS:
        mark, contents = MARKS[name]
        markdown = markdown.replace(mark, contents())
    if name == "scenario.md":
        return re.sub(r"^\| `\[(\w+)\]` \|", r"| [`[\1]`](scenario/\1.md) |", markdown, flags=re.MULTILINE)
    if name == "changelog.md":
        page.meta["search"] = {"exclude": True}  # what was added is found at the page that describes it
    if name in _BOOST:
        page.meta["search"] = {"boost": _BOOST[name]}
    if name in ABOVE:
        return markdown.replace("](docs/", "](")
    up = "../" * (name.count("/") + 1)
    markdown = _FENCE_OF_A_FILE.sub(r'```\1 title="\2"', markdown)
    for here, source in ABOVE.items():
        markdown = markdown.replace(f"]({up}{source})", f"]({up[3:]}{here})")
    return markdown
