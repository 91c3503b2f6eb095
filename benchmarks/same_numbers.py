"""Compares every number of every shipped scenario and study between two checkouts, bit for bit.

    python -m benchmarks.same_numbers make /path/to/checkout FOLDER     # once for each checkout
    python -m benchmarks.same_numbers compare FOLDER_BEFORE FOLDER_AFTER

`make` runs the scenarios, the studies, the alignments and the tables of the grades with the program of that checkout
and keeps what they write. It continues where it stopped. `compare` lists each column or number that differs, with the
largest difference, absolute and relative to the largest value of the column. It ends with exit code 1 if there is any.
Measured times, costs and versions are left out.

"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

MEASURED = re.compile(
    r"timing|version|seconds|_ns\b|time_ns|ns_per_step|python|platform|processor|cached|cost|recorded|operations"
)
"""Names of numbers that are measured on the machine and vary from run to run."""


def jobs(checkout: Path) -> dict[str, list[str]]:
    """Return the commands to run by name; "{out}" stands for the folder to write."""
    scenarios = sorted(path.stem for path in (checkout / "scenarios").glob("*.toml"))
    studies = sorted(path.stem for path in (checkout / "scenarios" / "studies").glob("*.toml"))
    grades = json.loads(program(checkout, ["list", "grades", "--json"]))
    names = [entry["name"] if isinstance(entry, dict) else entry for entry in grades]
    found = {f"run/{name}": ["run", name, "-o", "{out}"] for name in scenarios}
    found |= {f"compare/{name}": ["compare", name, "-o", "{out}"] for name in studies}
    found |= {f"grade/{name}": ["run", "trainer", "-o", "{out}", "--set", f"imu.grade={name}"] for name in names}
    found |= {f"sensors/{name}": ["sensors", name, "--json"] for name in names}
    found |= {f"align/{name}": ["align", name, "--json"] for name in ("parked", "gyrocompassing")}
    return found


def program(checkout: Path, arguments: list[str]) -> str:
    """Run the command line of a checkout and return what it prints."""
    ended = subprocess.run(
        [sys.executable, "-m", "sinssim", *arguments],
        env={**os.environ, "PYTHONPATH": str(checkout)},
        cwd=checkout,
        capture_output=True,
        text=True,
    )
    if ended.returncode:
        raise SystemExit(f"sinssim {' '.join(arguments)} in {checkout} ended with {ended.returncode}:\n{ended.stderr}")
    return ended.stdout


def make(checkout: Path, folder: Path, only: str) -> None:
    """Run everything with one checkout."""
    wanted = {name: command for name, command in jobs(checkout).items() if re.search(only, name)}
    for number, (name, command) in enumerate(wanted.items(), start=1):
        target = folder / name
        if target.exists():
            continue
        print(f"[{number}/{len(wanted)}] {name}", flush=True)
        target.parent.mkdir(parents=True, exist_ok=True)
        draft = target.with_name(f".{target.name}")
        shutil.rmtree(draft, ignore_errors=True)
        said = program(checkout, [part.replace("{out}", str(draft)) for part in command])
        draft.mkdir(exist_ok=True)
        if "--json" in command:
            (draft / "said.json").write_text(said, encoding="utf-8")
        for heavy in draft.glob("*.rrd"):
            heavy.unlink()
        draft.rename(target)


def numbers(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every leaf of a JSON document with its path."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from numbers(item, f"{path}.{key}")
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from numbers(item, f"{path}[{index}]")
    else:
        yield path, value


def json_differences(before: Path, after: Path) -> Iterator[str]:
    """Yield a line for each number of a JSON file that differs."""
    one = dict(numbers(json.loads(before.read_text(encoding="utf-8"))))
    two = dict(numbers(json.loads(after.read_text(encoding="utf-8"))))
    for path in sorted(one.keys() | two.keys()):
        if MEASURED.search(path):
            continue
        if path not in one or path not in two:
            yield f"{path}: only {'before' if path in one else 'after'}"
        elif one[path] != two[path] and not (one[path] != one[path] and two[path] != two[path]):
            yield f"{path}: {one[path]!r} -> {two[path]!r}"


def column_difference(before: Any, after: Any) -> str | None:
    """Return the difference of two columns in words, None if they are equal bit for bit."""
    if len(before) != len(after):
        return f"{len(before)} rows -> {len(after)} rows"
    one, two = before.to_numpy(zero_copy_only=False), after.to_numpy(zero_copy_only=False)
    if one.dtype.kind == "f":
        same = (one.view(f"i{one.itemsize}") == two.view(f"i{two.itemsize}")) | (np.isnan(one) & np.isnan(two))
        if same.all():
            return None
        apart = float(np.nanmax(np.abs(one - two)))
        largest = float(np.nanmax(np.abs(one))) or math.nan
        return f"{(~same).sum()} of {len(one)} rows, at most {apart:.3g} ({apart / largest:.1e} of the largest)"
    return None if (one == two).all() else f"{(one != two).sum()} of {len(one)} rows"


def parquet_differences(before: Path, after: Path) -> Iterator[str]:
    """Yield a line for each column of a table that differs."""
    one, two = pq.read_table(before), pq.read_table(after)
    for name in sorted(set(one.column_names) | set(two.column_names)):
        if MEASURED.search(name):
            continue
        if name not in one.column_names or name not in two.column_names:
            yield f"{name}: only {'before' if name in one.column_names else 'after'}"
        elif said := column_difference(one[name].combine_chunks(), two[name].combine_chunks()):
            yield f"{name}: {said}"


def compare(before: Path, after: Path) -> int:
    """Print every difference and return how many files have any."""
    kinds = {".parquet": parquet_differences, ".json": json_differences}
    files = sorted({f.relative_to(top) for top in (before, after) for f in top.rglob("*") if f.suffix in kinds})
    different = 0
    for file in files:
        if not (before / file).exists() or not (after / file).exists():
            said = ["only " + ("before" if (before / file).exists() else "after")]
        else:
            said = list(kinds[file.suffix](before / file, after / file))
        if said:
            different += 1
            print(file, *said[:20], *([f"... and {len(said) - 20} more"] if len(said) > 20 else []), sep="\n    ")
    print(f"{len(files)} files, {different} with a difference")
    return different


def main() -> None:
    """Make or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("make", help="run everything with one checkout")
    one.add_argument("checkout", type=Path)
    one.add_argument("folder", type=Path)
    one.add_argument("--only", default="", help="regular expression of the names to run")
    two = commands.add_parser("compare", help="compare what two checkouts made")
    two.add_argument("before", type=Path)
    two.add_argument("after", type=Path)
    options = parser.parse_args()
    if options.command == "make":
        make(options.checkout.resolve(), options.folder.resolve(), options.only)
    else:
        sys.exit(compare(options.before, options.after) > 0)


if __name__ == "__main__":
    main()
