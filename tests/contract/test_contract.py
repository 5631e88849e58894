"""Version 0.1.0 as it answered: what `remake.py` kept of it is what every later version must give.

`compare` says what of an answer is compared and how closely. A reference value changes only by ``remake.py``, in the
commit that says why.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from compare import differences
from runs import RUNS, Run, families, options, perform

REFERENCE = Path(__file__).with_name("reference")
pytestmark = pytest.mark.usefixtures("drafts")  # of pictures only that they are there is kept
Perform = Callable[[Run], dict[str, Any]]


def reference(name: str) -> Any:
    return json.loads((REFERENCE / f"{name}.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def performed(tmp_path_factory: pytest.TempPathFactory) -> Perform:
    """What is kept of a run, which is made only once."""
    kept: dict[str, dict[str, Any]] = {}

    def once(run: Run) -> dict[str, Any]:
        if run.name not in kept:
            kept[run.name] = perform(run, tmp_path_factory.mktemp(run.name))
        return kept[run.name]

    return once


@pytest.mark.parametrize("run", RUNS, ids=lambda run: run.name)
def test_the_answer_is_that_of_0_1_0(run: Run, performed: Perform) -> None:
    if any(name.endswith(".nc") for name in run.outputs):
        pytest.importorskip("xarray")
        pytest.importorskip("h5netcdf")
    if run.name.startswith("arm"):
        pytest.importorskip("numba")
    if "mcmc" in run.arguments:
        pytest.importorskip("emcee")
    found = differences(reference(run.name), performed(run), run.klass)
    assert not found, "\n".join([f"ilg-circuit {run.arguments}", *found])


@pytest.mark.parametrize("family", ["record", "spectrum", "several"])
def test_every_key_of_fit_json_is_there(family: str, performed: Perform) -> None:
    of_family = {run.name: performed(run) for run in RUNS if run.family == family}
    there = set(families(of_family)[family])
    # a list or table that was empty may be filled
    missing = {path for path in reference("keys")[family] if not any(known.startswith(path) for known in there)}
    assert not missing, sorted(missing)


def test_every_option_is_offered() -> None:
    offered = options()
    missing = {name: sorted(set(known) - set(offered.get(name, ()))) for name, known in reference("options").items()}
    assert not any(missing.values()), missing


def test_every_reference_is_of_a_run() -> None:
    assert {path.stem for path in REFERENCE.glob("*.json")} == {run.name for run in RUNS} | {"keys", "options"}
