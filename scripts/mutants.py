"""Samples small faults in the engine's code, one at a time, and counts how many the tests notice.

A fault is one operator, comparison, constant or sign changed. Each runs in a process of its own, on a copy of the
repository, with only the tests that call its function, the shortest first, for as long as `ENOUGH` allows. Where none
is recorded to call it, the test files run that import its module, then those of its room. The first test that fails
ends it. ``--state`` keeps one line of JSON a mutant, and a later run goes on from there. Survivors that no test can or
need tell from the code are listed with the reason in mutants.toml, by module and change.

usage: python scripts/mutants.py [--count 300] [--seed 0] [--state mutants.jsonl] [--rooms solve,circuit,fit,arms]
                                 [--calls calls_of_tests.jsonl, from calls_of_tests.py]
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import tomllib
import traceback
from collections.abc import Iterator
from contextlib import chdir
from dataclasses import asdict, dataclass
from pathlib import Path

from calls_of_tests import Calls, read

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("solve", "circuit", "fit", "arms")
#: Processor time [s] that the tests of a mutant may take; one that makes them endless is noticed.
LONGEST = 300
#: Processor time [s] of the tests that a mutant is tried on, where it is known which ones call its function.
ENOUGH = 100
#: What tests need besides the package.
_COPIED = (
    *("ilg_circuit", "tests", "data", "netlists", "pyproject.toml", "examples", "docs", "README.md", "scripts"),
    *("benchmarks", "CHANGELOG.md", "Makefile"),
)

_SWAPPED: dict[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult, ast.Mod: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.MatMult: ast.Sub, ast.And: ast.Or, ast.Or: ast.And, ast.Lt: ast.GtE, ast.LtE: ast.Gt,
    ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
    ast.In: ast.NotIn, ast.NotIn: ast.In, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """One fault: the ``module`` (its path in the repository), the ``line``, the code there and what it becomes."""

    module: str
    line: int
    code: str
    change: str
    site: int


def sites(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield the nodes that can be mutated: none in annotations, messages or what only a type checker reads."""
    skipped = {id(part) for node in ast.walk(tree) for part in _unseen(node)}
    stack: list[ast.AST] = [tree]
    while stack:
        node = stack.pop()
        if id(node) in skipped:
            continue
        stack += reversed(list(ast.iter_child_nodes(node)))
        number = isinstance(node, ast.Constant) and isinstance(node.value, (int, float))
        negative = isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.Not))
        operated = isinstance(node, (ast.BinOp, ast.BoolOp, ast.AugAssign)) and type(node.op) in _SWAPPED
        compared = isinstance(node, ast.Compare) and type(node.ops[0]) in _SWAPPED
        if number or negative or operated or compared:
            yield node


def _unseen(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the children of a node in which no fault can be noticed."""
    if isinstance(node, (ast.FunctionDef, ast.AnnAssign, ast.arg)):
        for annotation in (getattr(node, "annotation", None), getattr(node, "returns", None)):
            if annotation is not None:
                yield annotation
    if isinstance(node, ast.Raise) or (isinstance(node, ast.keyword) and node.arg == "strict"):
        yield node
    if isinstance(node, ast.FunctionDef):
        yield from node.decorator_list
    if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
        yield node
    if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and _is_type(node.value):
        yield node.value


def _is_type(value: ast.AST) -> bool:
    """Tell whether a value is a type under another name, such as ``Run = Callable[...]``."""
    return isinstance(value, ast.Subscript) and isinstance(value.value, ast.Name) and value.value.id[:1].isupper()


def mutate(node: ast.AST) -> ast.AST:
    """Return the node with its fault."""
    if isinstance(node, ast.Constant):
        value = node.value
        assert isinstance(value, (bool, int, float))
        changed = not value if isinstance(value, bool) else value + 1 if isinstance(value, int) else 2 * value or 1.0
        return ast.copy_location(ast.Constant(changed), node)
    if isinstance(node, ast.UnaryOp):
        return node.operand
    if isinstance(node, ast.Compare):
        node.ops[:1] = [_SWAPPED[type(node.ops[0])]()]  # type: ignore[list-item]
    else:
        assert isinstance(node, (ast.BinOp, ast.BoolOp, ast.AugAssign))
        node.op = _SWAPPED[type(node.op)]()  # type: ignore[assignment]
    return node


class _Change(ast.NodeTransformer):
    def __init__(self, target: ast.AST) -> None:
        self.target = target

    def visit(self, node: ast.AST) -> ast.AST:
        return mutate(node) if node is self.target else self.generic_visit(node)


def mutated(source: str, site: int) -> tuple[str, Mutant]:
    """Return the source with the fault at the ``site`` (its number), and what it is; the module is left open."""
    tree = ast.parse(source)
    node = list(sites(tree))[site]
    line = getattr(node, "lineno", 0)
    before = ast.unparse(node)
    after = ast.unparse(mutate(list(sites(copy := ast.parse(source)))[site]))
    del copy
    changed = _Change(node).visit(tree)
    code = source.splitlines()[line - 1].strip()
    return ast.unparse(ast.fix_missing_locations(changed)), Mutant("", line, code, f"{before} -> {after}", site)


def sample(rooms: tuple[str, ...], count: int, seed: int) -> list[tuple[str, int]]:
    """Return ``count`` mutants as (module, site), every site of the rooms as likely as any other.

    Those of the arm come last: after each its kernels are compiled anew.
    """
    found = []
    for room in rooms:
        for path in sorted((ROOT / "ilg_circuit" / room).rglob("*.py")):
            name = path.relative_to(ROOT).as_posix()
            found += [(name, k) for k, _ in enumerate(sites(ast.parse(path.read_text(encoding="utf-8"))))]
    chosen = random.Random(seed).sample(found, min(count, len(found)))
    return sorted(chosen, key=lambda one: one[0].startswith("ilg_circuit/arms/"))


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


def function_at(source: str, site: int) -> str:
    """Return the name of the innermost function around a site, "" for one that runs as its module is imported."""
    tree = ast.parse(source)
    node = list(sites(tree))[site]
    name = ""
    for function in ast.walk(tree):  # outer ones before inner ones
        body = getattr(function, "body", []) if isinstance(function, ast.FunctionDef) else []
        if any(node is part for statement in body for part in ast.walk(statement)):
            name = function.name if isinstance(function, ast.FunctionDef) else name
    return name


def callers(module: str, function: str, calls: Calls) -> list[str]:
    """Return the tests that call a function, or any of its module where it is "": the shortest first, `ENOUGH`."""
    named = f"{module}:{function}"
    found = [
        (float(test["seconds"]), name)
        for name, test in calls.items()
        if (named in test["functions"] if function else any(f.startswith(named) for f in test["functions"]))
    ]
    chosen: list[str] = []
    spent = 0.0
    for seconds, name in sorted(found):
        spent += seconds
        if chosen and spent > ENOUGH:
            break
        chosen.append(name)
    return chosen


def run_tests(folder: Path, files: list[str]) -> str:
    """Run tests or test files in a process forked from this one; return "killed", "survived", or "endless".

    Raises RuntimeError where they could not be run at all.
    """
    child = os.fork()
    if child == 0:
        quiet = os.open(folder / "output.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST + 10))
        code = 99
        try:
            sys.path[:0] = [str(folder)]
            os.environ["PYTHONPATH"] = str(folder)
            with chdir(folder):
                import pytest

                code = int(pytest.main(["-q", "-x", "-p", "no:cacheprovider", *files]))
        except BaseException:  # the child must end here, whatever happens
            traceback.print_exc()
        sys.stderr.flush()
        os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code not in (0, 1, 2) and code >= 0:  # 2: a module that cannot be imported any more; below 0: a crash
        raise RuntimeError(f"pytest ended with {code}, see {folder / 'output.txt'}")
    return "survived" if code == 0 else "endless" if code == -signal.SIGXCPU else "killed"


def reasons() -> dict[tuple[str, str, str], str]:
    """Return why survivors are none to mend, by module, code and change."""
    table = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    return {(s["module"], s["code"], s["change"]): s["reason"] for s in table.get("survivor", [])}


def report(results: list[dict[str, object]]) -> int:
    """Print how many were noticed, and the survivors; return 1 where too many survive without a reason."""
    known = reasons()
    survivors = [r for r in results if r["outcome"] == "survived"]
    for r in survivors:
        why = known.get((str(r["module"]), str(r["code"]), str(r["change"])), "no reason given")
        print(f"{r['module']}:{r['line']}: {r['change']}    in: {r['code']}\n    {why}")
    share = 1 - len(survivors) / max(len(results), 1)
    print(f"{len(results)} mutants, {len(survivors)} survived, {100 * share:.1f} % noticed")
    return 0 if share >= 0.85 else 1


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--count", type=int, default=300)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--state", type=Path, default=ROOT / "mutants.jsonl")
    options.add_argument("--rooms", default=",".join(ROOMS))
    options.add_argument("--calls", type=Path, default=ROOT / "calls_of_tests.jsonl")
    options.add_argument("--again", action="store_true", help="run the survivors of the state once more")
    given = options.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    import numba  # noqa: F401 - what every child would import
    import pint  # noqa: F401
    import pytest  # noqa: F401
    import scipy.interpolate
    import scipy.optimize
    import scipy.stats  # noqa: F401

    lines = given.state.read_text(encoding="utf-8").splitlines() if given.state.exists() else []
    results = {(r["module"], r["site"]): r for r in map(json.loads, lines)}
    calls = {name: test for tests in read(given.calls).values() for name, test in tests.items()}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for part in _COPIED:
            source = ROOT / part
            if source.is_dir():
                shutil.copytree(source, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
            elif source.exists():
                shutil.copy(source, folder / part)
        for module, site in sample(tuple(given.rooms.split(",")), given.count, given.seed):
            if (module, site) in results and not (given.again and results[module, site]["outcome"] == "survived"):
                continue
            source_text = (ROOT / module).read_text(encoding="utf-8")
            text, found = mutated(source_text, site)
            (folder / module).write_text(text, encoding="utf-8")
            begin = time.monotonic()
            tests = callers(module, function_at(source_text, site), calls) or tests_of(module)
            try:
                outcome = run_tests(folder, tests)
            except RuntimeError:
                print((folder / "output.txt").read_text()[-2000:])
                raise
            (folder / module).write_text(source_text, encoding="utf-8")
            took = round(time.monotonic() - begin, 1)
            entry = asdict(found) | {"module": module, "outcome": outcome, "seconds": took}
            results[module, site] = entry
            with given.state.open("a", encoding="utf-8") as file:
                file.write(json.dumps(entry) + "\n")
            print(f"{outcome:<9}{took:6.1f} s  {module}:{found.line}: {found.change[:100]}", flush=True)
    return report(list(results.values()))


if __name__ == "__main__":
    sys.exit(main())
