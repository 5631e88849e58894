"""The examples run as they are, and the netlists of the paper's strip are those that the package writes today."""

import runpy
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NETLISTS = runpy.run_path(str(ROOT / "netlists" / "generate.py"))["texts"]()


@pytest.mark.parametrize("script", sorted(p.name for p in (ROOT / "examples").glob("*.py")))
def test_example_runs(script: str, tmp_path: Path) -> None:
    command = [sys.executable, "-W", "error::RuntimeWarning", str(ROOT / "examples" / script), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()


@pytest.mark.parametrize("name", sorted(NETLISTS))
def test_netlist_is_current(name: str) -> None:
    assert (ROOT / "netlists" / name).read_text(encoding="utf-8") == NETLISTS[name], "run python netlists/generate.py"


def test_no_netlist_is_left_over() -> None:
    assert {p.name for p in (ROOT / "netlists").glob("paper_*")} == set(NETLISTS)
