"""Samples small faults in the engine's code, one at a time, and counts how many the tests notice.

A fault is one operator, comparison, constant or sign changed. Each runs in a process of its own, on a copy of the
repository, with only the tests that call its function, those of its module's own test files before others, for as long
as `ENOUGH` allows. Where none is recorded to call it, the test files run that import its module, then those of its
room. The first test that fails ends it. In the end the tests that failed run once more without a fault: one that
fails all the same has noticed nothing, and its mutants are undecided.

Which faults are chosen depends on each alone, so that a change of the code moves those in it and no others.
``--state`` keeps one line of JSON for each, and it is taken from there as long as its function's code is the same,
whatever else has changed. Survivors that no test can or need tell from the code are listed with the reason in
mutants.toml, by module, code and change.

usage: python scripts/mutants.py [--count 300] [--seed 0] [--state benchmarks/counted/mutants.jsonl]
                                 [--rooms solve,circuit,fit,arms] [--calls calls_of_tests.jsonl, from calls_of_tests.py]
                                 [--again] [--report]
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import tomllib
import traceback
from collections import Counter
from contextlib import chdir
from pathlib import Path

import numba
import pytest
from calls_of_tests import Calls, read
from faults import Mutant, mutants_of, mutated

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("solve", "circuit", "fit", "arms")
#: Processor time [s] of the tests that a mutant is tried on, where it is known which ones call its function.
ENOUGH = 60
#: Processor time [s] that the tests of a mutant may take. Those known to take less than `ENOUGH` are endless by then,
#: which is noticed; of others, and of those for which kernels were compiled anew, this is not said.
LONGEST = 150
#: Time [s] after which a mutant is left undecided, whatever its tests wait for.
LATEST = 900
#: How a mutant can end. What is undecided counts as not noticed.
OUTCOMES = ("killed", "endless", "survived", "undecided")
#: What tells a line of the state from the others.
_NAMES = ("module", "function", "change", "nth", "tree")
#: Tests of the compiled kernels alone, which are run first, and as plain Python: to compile them takes half a minute.
_KERNEL_TESTS = [f"tests/arms/test_{name}.py" for name in ("forces", "explicit_kernels", "steps")]
#: What tests need besides the package.
_COPIED = (
    *("ilg_circuit", "tests", "data", "netlists", "pyproject.toml", "examples", "docs", "README.md", "scripts"),
    *("benchmarks", "CHANGELOG.md", "Makefile"),
)


def sample(rooms: tuple[str, ...], count: int, seed: int) -> list[Mutant]:
    """Return ``count`` mutants of the rooms, each as likely as any other.

    Those of modules with compiled kernels come last: after each they are compiled anew.
    """
    found = []
    for room in rooms:
        for path in sorted((ROOT / "ilg_circuit" / room).rglob("*.py")):
            found += mutants_of(path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8"))
    found.sort(key=lambda one: one.order(seed))
    return sorted(found[:count], key=lambda one: has_kernels(ROOT / one.module))


def has_kernels(path: Path) -> bool:
    """Tell whether a module has compiled kernels."""
    return "\n@compiled" in path.read_text(encoding="utf-8")


def tests_of(module: str) -> list[str]:
    """Return the test files that concern a module: those that import it, then those of its room."""
    _, room, *parts = Path(module).with_suffix("").parts
    dotted = re.compile(rf"ilg_circuit\.{room}\.{'.'.join(parts)}\b")
    near, far = [], []
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        direct = dotted.search(path.read_text(encoding="utf-8")) or parts[-1] in path.stem
        if direct:
            near.append(path)
        elif path.parent.name == room:
            far.append(path)
    near.sort(key=lambda path: (path.parent.name != room, parts[-1] not in path.stem))
    return [path.relative_to(ROOT).as_posix() for path in near + far]


def callers(mutant: Mutant, calls: Calls) -> list[str]:
    """Return the tests that call a mutant's function, or any of its module where it is in none: for `ENOUGH`.

    They are chosen from its module's own test files first, and the shortest run first. Those of a compiled kernel are
    not known: it is tried on the tests of `tests_of`, file by file.
    """
    name = mutant.function.rpartition(".")[2]
    if name.lstrip("_")[:1].isupper():  # the body of a class
        name = ""
    called = f"{mutant.module}:{name}"
    found = []
    for test, one in calls.items():
        if called in one["functions"] or (not name and any(f.startswith(called) for f in one["functions"])):
            own = Path(mutant.module).stem in Path(test.partition("::")[0]).stem
            found.append((0 if own else 1, float(one["seconds"]), test))
    if not found:
        place = {file: k for k, file in enumerate(tests_of(mutant.module))}
        files = {test: test.partition("::")[0] for test in calls}
        found = [(place[files[t]], float(one["seconds"]), t) for t, one in calls.items() if files[t] in place]
    chosen: list[tuple[float, str]] = []
    spent = 0.0
    for _, seconds, test in sorted(found):
        spent += seconds
        if chosen and spent > ENOUGH:
            break
        chosen.append((seconds, test))
    return [test for _, test in sorted(chosen)]


class _Failed:
    """Plugin of pytest: writes the names of what fails into a file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.path.write_text("", encoding="utf-8")

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._note(report)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        self._note(report)

    def _note(self, report: pytest.TestReport | pytest.CollectReport) -> None:
        if report.failed:
            with self.path.open("a", encoding="utf-8") as file:
                file.write(report.nodeid + "\n")


def run_tests(
    folder: Path, files: list[str], longest: int = LONGEST, *, compiles: bool = True
) -> tuple[str, list[str]]:
    """Run tests or test files in a process forked from this one, until one fails or the ``longest`` processor time.

    Return "killed", "survived", or "late", and the tests or files that failed; where there is no limit, to the end.
    Raises RuntimeError where they could not be run at all.
    """
    child = os.fork()
    if child == 0:
        os.setsid()
        quiet = os.open(folder / "output.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        if longest:
            resource.setrlimit(resource.RLIMIT_CPU, (longest, longest + 10))
        code = 99
        try:
            sys.path[:0] = [str(folder)]
            os.environ["PYTHONPATH"] = str(folder)
            numba.config.DISABLE_JIT = not compiles  # type: ignore[attr-defined]
            with chdir(folder):
                stop = ["-x"] if longest else []
                options = ["-q", *stop, "-p", "no:cacheprovider", *files]
                code = int(pytest.main(options, plugins=[_Failed(folder / "failed.txt")]))
        except BaseException:  # the child must end here, whatever happens
            traceback.print_exc()
        sys.stderr.flush()
        os._exit(code)
    begin = time.monotonic()
    while not (ended := os.waitpid(child, os.WNOHANG))[0]:
        if longest and time.monotonic() - begin > LATEST:
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return "late", []
        time.sleep(0.05)
    code = os.waitstatus_to_exitcode(ended[1])
    output = (folder / "output.txt").read_text(encoding="utf-8", errors="replace")
    if code == 4 and ("while loading conftest" in output or "ImportError" in output or "ERROR collecting" in output):
        return "killed", []  # as 2: a module cannot be imported any more
    if code not in (0, 1, 2) and code >= 0:  # below 0: a crash
        raise RuntimeError(f"pytest ended with {code}, see {folder / 'output.txt'}")
    outcome = "survived" if code == 0 else "late" if code in (-signal.SIGXCPU, -signal.SIGKILL) else "killed"
    return outcome, (folder / "failed.txt").read_text(encoding="utf-8").splitlines()


def reasons() -> dict[tuple[str, str, str], str]:
    """Return why survivors are none to mend, by module, code and change."""
    table = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    return {(s["module"], s["code"], s["change"]): s["reason"] for s in table.get("survivor", [])}


def report(results: list[tuple[Mutant, str]]) -> int:
    """Print how many were noticed, and the survivors; return 1 where too many survive, or one without a reason."""
    known = reasons()
    open_ends = 0
    for mutant, outcome in results:
        if outcome in ("survived", "undecided"):
            why = known.get((mutant.module, mutant.code, mutant.change))
            open_ends += why is None
            print(f"{outcome}  {mutant.module}:{mutant.line}: {mutant.change}    in: {mutant.code}")
            print(f"    {why or 'no reason given'}")
    count = Counter(outcome for _, outcome in results)
    share = (count["killed"] + count["endless"]) / max(len(results), 1)
    each = ", ".join(f"{count[outcome]} {outcome}" for outcome in OUTCOMES)
    print(f"{len(results)} mutants: {each}; {open_ends} without a reason; {100 * share:.1f} % noticed")
    return 0 if share >= 0.85 and not open_ends else 1


def read_state(path: Path) -> dict[tuple[object, ...], dict[str, str]]:
    """Return the outcomes kept and the tests that failed, by mutant and the hash of its code."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return {tuple(r[name] for name in _NAMES): {n: r[n] for n in ("outcome", "by")} for r in map(json.loads, lines)}


def write_state(path: Path, found: dict[tuple[object, ...], dict[str, str]]) -> None:
    """Keep what was found, besides what the file has, in an order that does not depend on when."""
    kept = read_state(path) | found
    lines = [json.dumps(dict(zip(_NAMES, name, strict=True)) | kept[name]) for name in kept]
    fresh = path.with_suffix(".new")
    fresh.write_text("".join(line + "\n" for line in sorted(lines)), encoding="utf-8")
    fresh.replace(path)


def copied(folder: Path) -> None:
    """Copy what tests need into a new folder, and have beside it what they find beside the repository."""
    folder.mkdir()
    if (ROOT.parent / "shared").exists():
        (folder.parent / "shared").symlink_to(ROOT.parent / "shared")
    for part in _COPIED:
        source = ROOT / part
        if source.is_dir():
            shutil.copytree(source, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
        elif source.exists():
            shutil.copy2(source, folder / part)


def outcome_of(mutant: Mutant, folder: Path, calls: Calls) -> dict[str, str]:
    """Make the fault in the copy of the repository in ``folder``, run the tests that concern it, and mend it."""
    path = folder / mutant.module
    source, kernels = path.read_text(encoding="utf-8"), has_kernels(path)
    then = path.stat().st_mtime
    path.write_text(mutated(source, mutant.site), encoding="utf-8")
    if not kernels:  # they stay compiled where no file beside theirs is new; no two faults have the same time
        os.utime(path, (then, then - 1 - mutant.site))
    known = callers(mutant, calls)
    try:
        outcome, failed = "survived", [""]
        if kernels:
            outcome, failed = run_tests(folder, _KERNEL_TESTS, compiles=False)
        if outcome == "survived":
            outcome, failed = run_tests(folder, known or tests_of(mutant.module))
    except RuntimeError:
        output = (folder / "output.txt").read_text()
        print(output[:2000], output[-2000:], sep="\n...\n")
        raise
    path.write_text(source, encoding="utf-8")
    if not kernels:
        os.utime(path, (then, then))
    spent = sum(float(calls[test]["seconds"]) for test in known)
    if outcome == "late":
        outcome = "endless" if known and spent <= ENOUGH and not kernels else "undecided"
    return {"outcome": outcome, "by": failed[0] if failed else ""}


def mistaken(folder: Path, found: list[dict[str, str]]) -> set[str]:
    """Return the tests among those that failed which fail without a fault too."""
    tests = sorted({one["by"] for one in found if one["by"]})
    return set(run_tests(folder, tests, longest=0)[1]) if tests else set()


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--count", type=int, default=300)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--state", type=Path, default=ROOT / "benchmarks" / "counted" / "mutants.jsonl")
    options.add_argument("--rooms", default=",".join(ROOMS))
    options.add_argument("--calls", type=Path, default=ROOT / "calls_of_tests.jsonl")
    options.add_argument("--again", action="store_true", help="run the survivors without a reason once more")
    options.add_argument("--report", action="store_true", help="say what the state has, and run none")
    given = options.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    import lmfit  # noqa: F401 - what every child would import
    import pint  # noqa: F401
    import scipy.interpolate
    import scipy.optimize
    import scipy.stats  # noqa: F401

    state = read_state(given.state)
    calls = {name: test for tests in read(given.calls).values() for name, test in tests.items()}
    chosen = [
        (mutant, (*mutant.key, mutant.tree))
        for mutant in sample(tuple(given.rooms.split(",")), given.count, given.seed)
    ]
    again = ("survived", "undecided") if given.again else ()
    explained = reasons()
    wanted = [
        (m, n)
        for m, n in chosen
        if n not in state or (state[n]["outcome"] in again and (m.module, m.code, m.change) not in explained)
    ]
    found = {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / ROOT.name
        copied(folder)
        for mutant, name in [] if given.report else wanted:
            begin = time.monotonic()
            found[name] = outcome_of(mutant, folder, calls)
            write_state(given.state, {name: found[name]})
            took = f"{found[name]['outcome']:<9}{time.monotonic() - begin:6.1f} s"
            print(f"{took}  {mutant.module}:{mutant.line}: {mutant.change[:100]}", flush=True)
        wrong = mistaken(folder, list(found.values()))
        for name in [name for name, one in found.items() if one["by"] in wrong]:
            print(f"{found[name]['by']} fails without a fault")
            write_state(given.state, {name: {"outcome": "undecided", "by": ""}})
    state = read_state(given.state)
    return report([(mutant, state[name]["outcome"]) for mutant, name in chosen if name in state])


if __name__ == "__main__":
    sys.exit(main())
