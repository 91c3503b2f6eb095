"""A new view is one file."""

from __future__ import annotations

import re
from pathlib import Path

from tests.extending.pages import Copy, read_page


def test_the_view_of_the_page(tmp_path: Path) -> None:
    page, copy = read_page("view"), Copy(tmp_path)
    copy.apply(page)
    assert [block.path for block in page.files] == ["viz/speed.py"]
    assert copy.touched == []
    assert re.search(r"^speed +Ground speed and vertical speed\.$", copy.command("list", "views"), re.M)
    assert copy.run(page.snippets[0]) == "speed\n"
    source = (copy.root / "sinssim" / "experiments" / "run" / "motion_exhibits.py").read_text(encoding="utf-8")
    for key in ("speed", "vertical_speed"):
        assert f"flight/{key}" in page.files[0].code
        assert f'"{key}"' in source
