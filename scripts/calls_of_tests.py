"""Records which functions of the engine each test calls, and how long it takes, for `mutants.py` to choose tests by.

Each test file runs in a process of its own: those of the folders that test the engine closely (`FOLDERS`), which takes
an hour; all others would take two hours, and call the engine only as these do, and slowly. ``--state`` keeps one
line of JSON a file, and a later run records only files that are new or changed. Compiled kernels and what a test does
in other processes are not seen.

usage: python scripts/calls_of_tests.py [--state calls_of_tests.jsonl] [--workers 2] [--folders solve,circuit,...]
"""

from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import os
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
#: Folders of tests whose files are recorded.
FOLDERS = ("solve", "circuit", "fit", "arms", "strip", "simulation", "identification", "published", "report")

Calls = dict[str, dict[str, Any]]


class Recorder:
    """Plugin of pytest: ``calls`` has each test's seconds and the functions, as "module:name", that it calls.

    What a fixture of several tests calls counts for each of them.
    """

    def __init__(self) -> None:
        self.calls: Calls = {}
        self._called: set[CodeType] = set()
        self._by_fixture: dict[str, set[CodeType]] = {}
        self._begin = 0.0

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self._called = set()
        self._begin = time.process_time()
        threading.settrace(self._note)
        sys.settrace(self._note)
        yield
        sys.settrace(None)
        threading.settrace(None)
        package = str(ROOT / "ilg_circuit") + os.sep
        shared = [self._by_fixture.get(name, set()) for name in getattr(item, "fixturenames", ())]
        own = [code for code in self._called.union(*shared) if code.co_filename.startswith(package)]
        functions = {f"{Path(code.co_filename).relative_to(ROOT).as_posix()}:{code.co_name}" for code in own}
        self.calls[item.nodeid] = {
            "seconds": round(time.process_time() - self._begin, 2),
            "functions": sorted(functions),
        }

    @pytest.hookimpl(hookwrapper=True)
    def pytest_fixture_setup(self, fixturedef: pytest.FixtureDef[Any]) -> Iterator[None]:
        before, self._called = self._called, set()
        yield
        if fixturedef.scope != "function":
            self._by_fixture[fixturedef.argname] = self._called
        self._called = self._called | before

    def _note(self, frame: FrameType, event: str, argument: object) -> None:
        self._called.add(frame.f_code)


def recorded(file: str) -> tuple[str, Calls]:
    """Run one test file; return its name and what its tests call."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    os.environ["PYTHONPATH"] = str(ROOT)
    sys.path.insert(0, str(ROOT))
    os.chdir(ROOT)
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    recorder = Recorder()
    pytest.main(["-q", "-p", "no:cacheprovider", file], plugins=[recorder])
    return file, recorder.calls


def read(state: Path) -> dict[str, Calls]:
    """Return what was recorded, by test file, of those that are as they were."""
    lines = state.read_text(encoding="utf-8").splitlines() if state.exists() else []
    return {
        entry["file"]: entry["tests"] for entry in map(json.loads, lines) if entry["text"] == text_of(entry["file"])
    }


def text_of(file: str) -> str:
    """Return a hash of a file's text, "" where there is none."""
    path = ROOT / file
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16] if path.exists() else ""


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--state", type=Path, default=ROOT / "calls_of_tests.jsonl")
    options.add_argument("--workers", type=int, default=2)
    options.add_argument("--folders", default=",".join(FOLDERS))
    given = options.parse_args()
    paths = [p for folder in given.folders.split(",") for p in sorted((ROOT / "tests" / folder).rglob("test_*.py"))]
    files = [path.relative_to(ROOT).as_posix() for path in paths]
    known = read(given.state)
    missing = [file for file in files if file not in known]
    with multiprocessing.get_context("spawn").Pool(given.workers, maxtasksperchild=1) as pool:
        for file, calls in pool.imap_unordered(recorded, missing, chunksize=1):
            with given.state.open("a", encoding="utf-8") as out:
                out.write(json.dumps({"file": file, "text": text_of(file), "tests": calls}) + "\n")
            print(f"{sum(c['seconds'] for c in calls.values()):6.1f} s  {file}", flush=True)


if __name__ == "__main__":
    main()
