"""A filter of a project is one file, which runs in a scenario, an ensemble and a study."""

from __future__ import annotations

import re
from pathlib import Path

from tests.extending.pages import ROOT, Copy, read_page


def test_the_filter_of_the_page(tmp_path: Path) -> None:
    page, copy = read_page("filter"), Copy(tmp_path)
    assert page.files[0].code == (ROOT / "scenarios/new_project/filters/complementary.py").read_text(encoding="utf-8")
    copy.apply(page)
    assert copy.touched == []
    commands = next(block.code for block in page.blocks if block.language == "sh").splitlines()
    run, ensemble, study = copy.commands(*(tuple(line.split()[1:]) for line in commands))
    rows = re.findall(r"^ (aided|mine) +([\w-]+) +\S+ +(\S+) ", run.partition("side by side")[2], re.M)
    assert [(name, kind) for name, kind, _ in rows] == [
        ("aided", "error-state"), ("mine", "complementary"),
    ]  # fmt: skip
    assert 0.1 < float(rows[0][2]) < float(rows[1][2]) < 1.5  # m: fixes of 1.5 m, averaged
    assert "Solution: mine." in ensemble
    cells = [float(cep) for cep in re.findall(r"^ \d +(?:1|10) +(\S+)", study, re.M)]
    assert len(cells) == 2
    assert cells[1] > 4.0 * cells[0]  # its gain is fixed, so that its error follows that of the fixes
