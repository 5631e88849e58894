"""The list of slow tests: its names are those of tests, and its script finds them in pytest's report."""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "scripts"))

from slow_tests import LIST, slow  # noqa: E402 - found by the path above


def test_every_slow_test_is_there() -> None:
    names = LIST.read_text(encoding="utf-8").split()
    assert names == sorted(set(names))
    for name in names:
        file, function = name.split("::")
        assert re.search(rf"^def {function}\(", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE), name


def test_those_are_slow_whose_cases_take_long_with_what_they_need() -> None:
    report = (
        "3.00s setup    tests/a.py::test_shared[first case]\n0.20s call     tests/a.py::test_shared[second]\n"
        "0.90s call     tests/a.py::test_one\n0.30s teardown tests/a.py::test_one\n"
        "0.90s call     tests/b.py::test_one\n9 passed in 9.00s\n"
    )
    assert slow(report, 1.1) == ["tests/a.py::test_one", "tests/a.py::test_shared"]
