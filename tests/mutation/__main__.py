"""Mutation testing: one small fault at a time is planted into the kernels, the filter and the error theory, and the
tests that stand for the file must fail.

    python -m tests.mutation                              # every mutant: days on one core
    python -m tests.mutation --sample 200 --seed 1        # a sample spread over all targets
    python -m tests.mutation sinssim/earth.py --sample 40 # of one target, or of several
    python -m tests.mutation --sample 200 --again         # survivors once more, after a test was written
    python -m tests.mutation --sample 200 --report        # only what is known so far

cosmic-ray makes the mutants, each in a temporary copy of the checkout. The results stay in runs/mutation (--out): what
was begun goes on where it stopped, and a larger sample of the same seed contains the smaller one. survivors.toml there
lists what no test found. Such a mutant calls for a test; one that changes nothing that could be observed goes, with the
reason, into tests/mutation/equivalent.toml. targets.toml says what is mutated and which tests judge it.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import time
import tomllib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from cosmic_ray.work_db import WorkDB
from cosmic_ray.work_item import TestOutcome, WorkItem, WorkResult

from tests.mutation.judge import judged, unchanged_s
from tests.mutation.mutants import HERE, ROOT, Mutant, Target, change, digest, sample, targets

KILLED, TIMED_OUT, SURVIVED, EQUIVALENT = "killed", "timed out", "survived", "equivalent"


@dataclass(frozen=True)
class Verdict:
    """What became of a mutant.

    Attributes:
        mutant: which.
        outcome: killed, timed out, survived, or equivalent: survived and listed with a reason.
        before, after: the changed lines.
    """

    mutant: Mutant
    outcome: str
    before: str
    after: str


class Session:
    """Mutants and their results, kept in a folder.

    Args:
        folder: where they are kept.
        chosen: the mutants.
    """

    def __init__(self, folder: Path, chosen: list[Mutant]) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self.chosen = folder, chosen
        self.cache = folder / "cache"
        self._kept = WorkDB(str(folder / "session.sqlite"), WorkDB.Mode.create)
        there = {item.job_id for item in self._kept.work_items}
        self._kept.add_work_items(
            WorkItem.single(m.job, m.specification()) for m in {m.job: m for m in chosen}.values() if m.job not in there
        )
        self.results: dict[str, WorkResult] = dict(self._kept.results)

    def waiting(self, again: bool) -> list[Mutant]:
        """Return the mutants without a result, and the survivors too if they are to be judged again."""
        done = {job for job, r in self.results.items() if not (again and r.test_outcome == TestOutcome.SURVIVED)}
        return [m for m in self.chosen if m.job not in done]

    def judge(self, waiting: list[Mutant], workers: int) -> None:
        """Judge mutants, and keep each result as it comes."""
        unchanged = self._unchanged({m.target.file: m.target for m in waiting})
        begin = time.perf_counter()
        for number, (mutant, result, took_s) in enumerate(judged(waiting, unchanged, self.cache, workers), 1):
            self._kept.set_result(mutant.job, result)
            self.results[mutant.job] = result
            left_s = (time.perf_counter() - begin) / number * (len(waiting) - number)
            outcome = "?" if result.test_outcome is None else result.test_outcome.value
            place = f"{mutant.target.file}:{mutant.start[0]}"
            name = mutant.operator.removeprefix("core/").removeprefix("Replace")
            progress = f"{number}/{len(waiting)}  {outcome:9} {took_s:5.1f} s"
            print(f"{progress}  {place} {name}  ({left_s / 60.0:.0f} min left)", flush=True)

    def _unchanged(self, chosen: dict[str, Target]) -> dict[str, float]:
        """Return how long the tests of each target take without a mutation; measured if anything has changed."""
        path = self.folder / "unchanged.json"
        known = json.loads(path.read_text()) if path.exists() else {}
        package = sorted(p.relative_to(ROOT).as_posix() for p in (ROOT / "sinssim").rglob("*.py"))
        content = {file: digest(file) for file in package}
        out = {}
        for file, target in chosen.items():
            content |= {f: digest(f) for f in (test.split("::")[0] for test in target.tests)}
            now = hashlib.sha256(f"{target.tests} {target.plain} {content}".encode()).hexdigest()
            if now not in known:
                print(f"{file} without a mutation ...", end=" ", flush=True)
                known[now] = unchanged_s(target, self.cache)
                print(f"{known[now]:.0f} s")
                path.write_text(json.dumps(known))
            out[file] = known[now]
        return out

    def verdicts(self) -> list[Verdict]:
        """Return what became of the chosen mutants that have a result."""
        listed = {(e["file"], e["before"], e["after"]) for e in equivalents()}
        return [_verdict(m, self.results[m.job], listed) for m in self.chosen if m.job in self.results]


def equivalents() -> list[dict[str, str]]:
    """Return the mutants of equivalent.toml: file, before, after and reason of each."""
    entries = tomllib.loads((HERE / "equivalent.toml").read_text(encoding="utf-8"))["mutant"]
    return [
        {**entry, "after": after}
        for entry in entries
        for after in ([entry["after"]] if isinstance(entry["after"], str) else entry["after"])
    ]


def _verdict(mutant: Mutant, result: WorkResult, listed: set[tuple[str, str, str]]) -> Verdict:
    before, after = change(result.diff or "")
    if result.test_outcome != TestOutcome.SURVIVED:
        outcome = TIMED_OUT if result.output == "timeout" else KILLED
    else:
        outcome = EQUIVALENT if (mutant.target.file, before, after) in listed else SURVIVED
    return Verdict(mutant, outcome, before, after)


def score(verdicts: list[Verdict]) -> float:
    """Return the share of the mutants that were killed, or never ended, among those that are not equivalent."""
    count = Counter(v.outcome for v in verdicts)
    found = count[KILLED] + count[TIMED_OUT]
    return found / max(found + count[SURVIVED], 1)


def table(verdicts: list[Verdict]) -> str:
    """Return the counts and scores of each group and target."""
    outcomes = (KILLED, TIMED_OUT, SURVIVED, EQUIVALENT)
    lines = [f"{'':40}" + "".join(f"{name:>12}" for name in (*outcomes, "score"))]

    def line(name: str, part: list[Verdict]) -> None:
        count = Counter(v.outcome for v in part)
        lines.append(f"{name:40}" + "".join(f"{count[o]:12}" for o in outcomes) + f"{100.0 * score(part):10.1f} %")

    for group in dict.fromkeys(v.mutant.target.group for v in verdicts):
        of_group = [v for v in verdicts if v.mutant.target.group == group]
        for file in dict.fromkeys(v.mutant.target.file for v in of_group):
            line(file.removeprefix("sinssim/"), [v for v in of_group if v.mutant.target.file == file])
        line(group.upper(), of_group)
    line("ALL", verdicts)
    return "\n".join(lines)


def survivors(verdicts: list[Verdict]) -> str:
    """Return the survivors in the form of equivalent.toml, the reason to be filled in."""
    entries = []
    for v in sorted(verdicts, key=lambda v: (v.mutant.target.file, v.mutant.start)):
        if v.outcome == SURVIVED:
            fields = {"file": v.mutant.target.file, "before": v.before, "after": v.after, "reason": ""}
            written = "\n".join(f"{name} = {json.dumps(value, ensure_ascii=False)}" for name, value in fields.items())
            entries.append(f"# line {v.mutant.start[0]}, {v.mutant.operator}\n[[mutant]]\n{written}\n")
    return "\n".join(entries)


def main() -> None:
    """Run the command."""
    assert __doc__ is not None
    parser = argparse.ArgumentParser("python -m tests.mutation", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    known = {target.file: target for target in targets()}
    parser.add_argument("target", nargs="*", help="files to mutate; all of targets.toml by default")
    parser.add_argument("--sample", type=int, metavar="N", help="number of mutants; all by default")
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="of the sample (1)")
    parser.add_argument("--workers", type=int, default=2, metavar="W", help="mutants at once (2)")
    parser.add_argument("--out", type=Path, default=ROOT / "runs" / "mutation", help="folder of the results")
    parser.add_argument("--again", action="store_true", help="judge the survivors again")
    parser.add_argument("--report", action="store_true", help="judge nothing, report what is known")
    options = parser.parse_args()
    for file in options.target:
        if file not in known:
            parser.error(f"{file} is not a target; targets.toml has {', '.join(known)}")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    chosen = sample([known[f] for f in options.target] or list(known.values()), options.sample, options.seed)
    session = Session(options.out.resolve(), chosen)
    if not options.report and (waiting := session.waiting(options.again)):
        print(f"{len(chosen)} mutants, {len(waiting)} to be judged")
        session.judge(waiting, options.workers)
    verdicts = session.verdicts()
    (session.folder / "survivors.toml").write_text(survivors(verdicts), encoding="utf-8")
    print(table(verdicts))
    print(f"{len(verdicts)} of {len(chosen)} mutants judged; survivors: {session.folder / 'survivors.toml'}")


if __name__ == "__main__":
    main()
