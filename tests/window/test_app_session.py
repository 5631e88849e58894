"""The state of a window, its solver process and what it shows, without a browser."""

from __future__ import annotations

import os
import re
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path
from queue import Queue
from typing import Any

import pytest
from every_model import strip_of

import ilg_circuit as ilg
from ilg_circuit.front.heads import head
from ilg_circuit.strip.actuator import Actuator
from ilg_circuit.window.live import Live
from ilg_circuit.window.moved import ENDS, changes, movable, place_of, shown, typed, value_at
from ilg_circuit.window.session import Session
from ilg_circuit.window.tasks import Source
from ilg_circuit.window.worker import Task, Told, Worker


def ended(queue: Queue[Told]) -> Told:
    """The end of a task, after its progress."""
    while (told := queue.get(timeout=60)).kind == "progress":
        pass
    return told


LAYER = 'name = "{}"\nthickness = "{}"\nyoungs_modulus = "{}"\ndensity = "1000 kg/m^3"\n'
LAYERS = [
    LAYER.format(*each) for each in (("gold", "5 um", "1 MPa"), ("gel", "0.49 mm", "7 kPa"), ("gold", "5 um", "1 MPa"))
]
SHEETS = '\n[electrodes]\nsheet_resistance_1 = "1 ohm"\nsheet_resistance_2 = "2 ohm"\n'


def opened(kind: str, folder: Path) -> Actuator:
    """A strip of an electrical model, or the paper's with layers or with sheets."""
    if kind not in ("layers", "sheets"):
        return strip_of(kind, 3.0)
    ilg.PAPER.save(folder / "strip.toml")
    text = (folder / "strip.toml").read_text(encoding="utf-8")
    if kind == "layers":
        text = re.sub(r"(?m)^(youngs_modulus|density|beam_damping_ratio).*\n", "", text)
    more = "".join(f"\n[[layers]]\n{layer}" for layer in LAYERS) if kind == "layers" else SHEETS
    (folder / "strip.toml").write_text(text + more, encoding="utf-8")
    return ilg.load(folder / "strip.toml")


@pytest.mark.parametrize("kind", ["rc", "warburg", "rc2+growing+sinh", "layers", "sheets"])
def test_a_slider_s_place_and_value_belong_together(kind: str, tmp_path: Path) -> None:
    strip = opened(kind, tmp_path)
    names = {slider.name for slider in movable(strip)}
    assert names >= {"layers": {"gel_thickness", "gold_youngs_modulus"}, "sheets": {"sheet_resistance_2"}}.get(
        kind, set()
    )
    for slider in movable(strip):
        assert value_at(slider, 0) == slider.value
        assert value_at(slider, ENDS) == pytest.approx(slider.highest)
        assert value_at(slider, -ENDS) == pytest.approx(slider.lowest)
        for place in (-70, 13):
            value = value_at(slider, place)
            assert place_of(slider, value) == place
            assert typed(slider, shown(slider, value)) == pytest.approx(value, rel=1e-3)
        if slider.name not in ("length", "free_length"):  # which may contradict each other
            moved = strip.with_(**changes(movable(strip), {slider.name: value}))
            again = {s.name: s.value for s in movable(moved)}
            assert again[slider.name] == pytest.approx(value, rel=1e-9)


def test_what_is_typed_has_a_unit_or_that_of_the_field() -> None:
    thickness = next(s for s in movable(ilg.PAPER) if s.name == "thickness")
    assert [typed(thickness, text) for text in ("400", "0,4 mm", "400 \N{MICRO SIGN}m", "4e-4m")] == pytest.approx(
        4 * [4e-4]
    )
    with pytest.raises(ilg.InputError, match="Thickness"):
        typed(thickness, "4 V")


def test_the_newest_wish_is_computed_and_others_are_skipped() -> None:
    gate, seen, ready = threading.Event(), [], threading.Event()

    def compute(wish: int) -> int:
        gate.wait(10)
        if wish == 9:
            raise ilg.InputError("not nine")
        return wish

    def show(found: Any) -> None:
        seen.append(found)
        if isinstance(found, ilg.InputError):
            ready.set()

    live = Live(compute, show, lambda call: call())
    for wish in range(10):
        live.want(wish)
    gate.set()
    assert ready.wait(10)
    assert len(seen) <= 2
    gate.clear()
    live.want(1)
    live.forget()
    gate.set()
    live.want(9)
    while not isinstance(seen[-1], ilg.InputError) or len(seen) < 3:
        time.sleep(0.001)
    assert 1 not in seen[2:]
    live.close()
    assert str(seen[-1]) == "not nine"


def test_the_solver_process_answers_fails_is_stopped_and_killed(record: Callable[..., Path]) -> None:
    tasks, told, worker = "ilg_circuit.window.tasks", Queue[Told](), Worker()
    try:
        run = {"strip": ilg.PAPER, "drive": "step:4V", "duration": "10 s", "tip": "free"}
        worker.submit(Task(tasks, "run", run), told.put)
        found = ended(told)
        assert found.kind == "done", found.value
        assert found.value.engine == "ngspice"
        first = worker.pid
        worker.submit(Task(tasks, "run", run | {"drive": "stp:4V"}), told.put)
        wrong = ended(told)
        assert wrong.kind == "failed"
        assert "stp" in wrong.value
        assert worker.pid == first
        worker.submit(Task("time", "sleep", {}), told.put)  # which takes no progress: a fault is one line, too
        assert ended(told).value.startswith("unexpected TypeError")
        source = [Source(record(), "step.csv")]
        fit = {"sources": source, "strip": ilg.PAPER, "options": {"model": "rc"}, "intervals": "mcmc"}
        slow = Task(tasks, "fit", fit)
        worker.submit(slow, told.put)
        time.sleep(0.1)
        worker.stop()
        assert ended(told).kind == "stopped"
        assert worker.pid not in (None, first)
        worker.submit(slow, told.put)
        os.kill(worker.pid, signal.SIGKILL)
        assert "ended by itself" in ended(told).value
        assert not worker.busy
    finally:
        worker.close()
    assert worker.pid is None


def test_files_are_taken_from_disk_and_from_the_browser(session: Session, record: Callable[..., Path]) -> None:
    path = record()
    session.take("../../step.csv", path.read_bytes())
    (source,) = session.sources
    assert source.name == "step.csv"
    assert session.folder in source.path.parents
    session.take("step.csv", path.read_bytes())
    assert len(session.sources) == 1
    ilg.PAPER.with_(thickness="0.4 mm").save(path.with_name("thin.toml"))
    session.open(path.with_name("thin.toml"))
    assert session.base.geometry.thickness == session.strip.geometry.thickness == 4e-4
    for wrong in ("none.csv", "none.toml"):
        with pytest.raises(ilg.InputError, match=wrong):
            session.open(wrong)
    session.take_example()
    assert [each.name for each in session.sources] == ["step.csv", "example.csv"]
    session.leave_out(["step.csv"])
    assert [each.name for each in session.sources] == ["example.csv"]
    folder = session.folder
    session.close()
    assert not folder.exists()


@pytest.mark.parametrize(
    ("text", "titles"),
    [
        ("Zeitpunkt;Foo;Bar\n1,0;2,5;3\n2,0;2,5;3\n", ("Zeitpunkt", "Foo", "Bar")),
        ("0 1 2\n1 1 2\n2 1 2\n", ("1", "2", "3")),
        ("an instrument\nserial 5\n\ntime_s,voltage_V,current_A\n0,1,2\n1,1,2\n", ("time_s", "voltage_V", "current_A")),
    ],
)
def test_the_head_of_a_file_shows_its_titles(tmp_path: Path, text: str, titles: tuple[str, ...]) -> None:
    (tmp_path / "any.csv").write_text(text, encoding="utf-8")
    found = head(tmp_path / "any.csv")
    assert found.titles == titles
    assert {len(row) for row in found.rows} == {len(titles)}
