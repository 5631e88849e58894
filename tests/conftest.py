"""What all tests share: hypothesis' profile, third-party measurements, and the paper's strip with variations."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from command import Outcome, Run
from hypothesis import settings
from synthetic import Synthetic, record, step

from ilg_circuit.identification import Identification, identify
from ilg_circuit.strip.actuator import PAPER, Actuator, IonBranch

# Small matrices: the threads of a linear algebra library would only wait for one another. Set before numpy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")

# A suite in the background inherits signals that are ignored; commands that it starts must not, and a handler is not
# inherited.
with suppress(AttributeError, ValueError):  # Windows has no SIGHUP; other threads set none
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:
        signal.signal(signal.SIGHUP, lambda *_: None)

# The same examples on every machine and every run; no deadline, because the first use of pint or ngspice loads them.
settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=50, print_blob=True)
settings.load_profile("repeatable")

_SHARED = Path(__file__).parents[1].parent / "shared" / "data"


#: Files that take a worker longest, the longest first. Begun last, one of them would leave the other workers idle.
LONGEST = (
    "test_strip_page", "test_contract", "test_every_result", "test_shown_commands", "test_one_pipeline",
    "test_nonlinear", "test_examples", "test_current_fit", "test_impedance_fit", "test_selection", "test_two_clocks",
    "test_cli_text", "test_cli_identify", "test_transient", "test_attacks", "test_several", "test_ipmc",
    "test_intervals", "test_nist", "test_sweep_workers", "test_rhythm", "test_deck", "test_supercapacitor",
    "test_page_in_use", "test_ogden_fit", "test_models", "test_beam_and_clock", "test_stated_error",
)  # fmt: skip


#: Test functions that `make test` leaves to `make test-slow`; see scripts/slow_tests.py.
SLOW = frozenset(Path(__file__).with_name("slow.txt").read_text(encoding="utf-8").split())


def pytest_configure(config: pytest.Config) -> None:
    """Let ``--dist loadfile`` keep the order of the files; by itself it would begin with those of most tests."""
    config.option.loadscopereorder = False


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark slow tests, and put the longest files first where several workers share them."""
    for item in items:
        if item.nodeid.partition("[")[0] in SLOW:
            item.add_marker(pytest.mark.slow)
    if hasattr(config, "workerinput"):
        rank = {name: place for place, name in enumerate(LONGEST)}
        items.sort(key=lambda item: rank.get(item.path.stem, len(rank)))


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    """Electrical models that a test or an example registers are gone after it."""
    from ilg_circuit.strip.models.registry import MODELS

    kept = dict(MODELS)
    yield
    if kept != MODELS:
        MODELS.clear()
        MODELS.update(kept)


@pytest.fixture
def shared_data() -> Callable[[str], Path]:
    """A measurement kept beside the project, by its path; the test is skipped where it is absent."""

    def find(name: str) -> Path:
        path = _SHARED / name
        if not path.is_file():
            pytest.skip(f"third-party data {name} is not kept with the project and is absent here")
        return path

    return find


@pytest.fixture(scope="session")
def strips() -> dict[str, Actuator]:
    """The paper's strip and one variation for each thing that changes the circuit's topology."""
    g, m = PAPER.geometry, PAPER.material
    electrodes = replace(m, electrode_resistivity_1=175.0, electrode_thickness_1=2e-6)  # 2 ohm
    second = (IonBranch(dynamic_resistivity=60.0, permittivity=0.4),)
    return {
        "paper": PAPER,
        "electrodes": replace(PAPER, name="electrodes", material=electrodes),
        "rc2": replace(PAPER, name="rc2", material=replace(m, further_branches=second)),
        "rc2 electrodes": replace(PAPER, name="rc2 electrodes", material=replace(electrodes, further_branches=second)),
        "load inside": replace(PAPER, name="load inside", geometry=replace(g, load_position=20e-3)),
        "undamped": replace(PAPER, name="undamped", material=replace(m, beam_damping_ratio=0.0)),
        "no coupling": replace(PAPER, name="no coupling", coupling=None),
    }


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """The program's entry point in this process, in an empty working directory."""
    from ilg_circuit.cli import main

    monkeypatch.chdir(tmp_path)

    def call(*arguments: str) -> Outcome:
        capsys.readouterr()
        with pytest.raises(SystemExit) as caught:
            main(list(arguments))
        streams = capsys.readouterr()
        return Outcome(int(caught.value.code or 0), streams.out, streams.err)

    return call


@pytest.fixture
def brisk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Searches for designs with fewer scattered designs and starts: enough for problems as plain as the tests'."""
    from ilg_circuit.study import search, space

    for table, values in (
        (space.INITIAL_POINTS, {"exact": 128, "ngspice": 16}),
        (search.STARTS, {"exact": 4, "ngspice": 2}),
        (search.POLISHING, {"exact": (2, 8), "ngspice": (1, 4)}),
    ):
        for engine, value in values.items():
            monkeypatch.setitem(table, engine, value)


@pytest.fixture
def drafts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are written small and without a layout, which takes most of their time; other tests look at them."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib.figure import Figure

    saved = Figure.savefig

    def draft(figure: Figure, target: Any, **how: Any) -> None:
        figure.set_layout_engine("none")
        frame = how.get("format") == "rgba"  # of an animation, whose size is fixed
        saved(figure, target, **how | ({} if frame else {"dpi": 20}))

    monkeypatch.setattr(Figure, "savefig", draft)


@pytest.fixture(scope="session")
def step_record() -> Synthetic:
    """The paper's strip, 4 V for 300 s, 20 samples of rest, noise of 0.3 %."""
    return record(step(), 300.0, 301, rest=20, displacement=True, noise=0.003, rest_position=5e-3, seed=11)


@pytest.fixture(scope="session")
def step_fit(step_record: Synthetic) -> Identification:
    return identify(step_record.measurement(), base=PAPER, model="rc")
