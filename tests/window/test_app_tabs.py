"""The tabs of a window without a browser: their widgets are moved as a browser would, and what they show is read."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from every_model import strip_of

import ilg_circuit as ilg
from ilg_circuit.study.space import parse_ranges
from ilg_circuit.window.session import Session

pytest.importorskip("panel", reason="the extra app is not installed")
from ilg_circuit.window.curves import BEFORE, NOW
from ilg_circuit.window.download import _Refused
from ilg_circuit.window.study import _plain
from ilg_circuit.window.window import Window

#: The page's bound on differences from the command, relative to the largest value.
CLOSE = 1e-6


class Soon:
    """Calls in this thread what another one asks for."""

    def __init__(self) -> None:
        self.ready = threading.Semaphore(0)
        self.calls: list[Callable[[], object]] = []

    def __call__(self, call: Callable[[], object]) -> None:
        self.calls.append(call)
        self.ready.release()

    def until(self, done: Callable[[], object]) -> None:
        while not done():
            assert self.ready.acquire(timeout=60)
            self.calls.pop(0)()


@pytest.fixture(scope="module")
def soon() -> Soon:
    return Soon()


@pytest.fixture(scope="module")
def opened(soon: Soon) -> Iterator[Window]:
    """One window, and so one solver process, for all tests."""
    made = Window(Session(soon))
    yield made
    made.close()


@pytest.fixture
def window(opened: Window) -> Window:
    """The window as it was at first."""
    opened.session.leave_out([each.name for each in opened.session.sources])
    opened.session.fit = None
    opened.session.take_strip(ilg.PAPER, "the paper's strip")
    opened.session.tell("fit")
    opened.strip.tip.value = "free"
    return opened


def drawn(window: Window, curve: str, name: str) -> np.ndarray:
    return np.asarray(window.strip.response.sources[curve].data[name])


def test_a_moved_slider_s_curves_are_those_of_simulate(window: Window, soon: Soon) -> None:
    soon.until(lambda: len(drawn(window, "now", "time")))
    sliders = window.strip.moving.widgets
    sliders["thickness"][0].value = -30
    sliders["permittivity"][1].value = "1.5"
    strip = window.session.strip
    assert strip.geometry.thickness < 0.5e-3
    soon.until(lambda: window.session.run is not None and window.session.run.actuator == strip)
    run = ilg.simulate(strip, "step:4V", "300 s", engine="exact")
    for name in ("current", "displacement", "charge"):
        found = drawn(window, NOW.name, name)
        assert np.abs(found - run.waveforms[name]).max() < CLOSE * np.abs(run.waveforms[name]).max()
    before = ilg.simulate("paper", "step:4V", "300 s", engine="exact")
    assert np.allclose(drawn(window, BEFORE.name, "current"), before.current, rtol=CLOSE)
    assert "mA" in window.strip.response.figures[2].yaxis[0].axis_label
    soon.until(lambda: len(window.strip.spectrum.sources["before"].data["re"]))
    there = window.strip.spectrum.sources["now"].data
    z = ilg.impedance(strip, "1 mHz", "1 kHz", engine="exact").impedance
    assert np.abs(there["re"] - 1j * there["minus_im"] - z).max() < CLOSE * np.abs(z).max()
    files = window.export.files
    rows = files["response.csv"].content().read().decode().splitlines()
    assert rows[0].startswith("time_s,voltage_V,current_A")
    assert float(rows[-1].split(",")[2]) == pytest.approx(run.current[-1], rel=CLOSE)
    assert b"permittivity" in files["strip.toml"].content().read()
    assert b".subckt" in files["strip.lib"].content().read().lower()
    assert files["fitted.toml"].button.disabled
    window.strip.tip.value = "clamped"
    soon.until(lambda: float(np.abs(drawn(window, "now", "force")).max(initial=0)) > 0)
    assert sliders["thickness"][0].value == -30


def test_errors_are_lines_in_a_box(window: Window, soon: Soon) -> None:
    soon.until(lambda: len(drawn(window, "now", "time")))
    window.strip.drive.value = "stp:4V"
    soon.until(lambda: "box error" in window.strip.told.object)
    window.strip.drive.value = "step:4V"
    soon.until(lambda: "box error" not in window.strip.told.object)
    moving = window.strip.moving
    moving.widgets["free_length"][1].value = "4 V"
    assert "box error" in moving.refused.object
    moving.widgets["length"][0].value = -50
    assert "the free part cannot exceed the whole" in moving.refused.object
    moving.widgets["length"][1].value = "50 m"
    assert "usual strips have" in moving.refused.object
    moving.reset()
    assert moving.refused.object == ""
    window.measure.start()
    assert "nothing to fit" in window.measure.answer.object
    window.session.take("broken.csv", b"a;b\n1;2\n")
    assert 'class="box error"' in window.measure.opened.object
    window.session.leave_out(["broken.csv"])
    button = window.export.files["fitted.toml"]
    with pytest.raises(_Refused):
        button.content()
    assert "no fit yet" in button.line.object


def test_what_the_exact_engine_cannot_do_live_is_solved_by_ngspice(window: Window, soon: Soon) -> None:
    strip = window.strip
    window.session.take_strip(strip_of("rc+sinh", 3.0), "nonlinear")
    strip.duration.value = "10 s"
    assert "A nonlinear strip is solved by ngspice alone" in strip.told.object
    assert window.session.run is None
    assert window.sweep.ranges.rows[0][0].value == "thickness"
    strip.solve()
    soon.until(lambda: window.session.work is None)
    assert "Solved by ngspice" in strip.compared.object
    assert window.session.run.engine == "ngspice"
    strip.duration.value = "300 s"


def test_a_displacement_alone_and_a_measured_drive(window: Window, soon: Soon, tmp_path: Path) -> None:
    measure, path = window.measure, tmp_path / "film.csv"
    run = ilg.simulate("paper", "step:2V", "60 s", engine="exact", beam="static")
    rows = [f"{t + 3:.6g},{1e3 * y:.6g}" for t, y in zip(run.time, run.displacement, strict=True)]
    path.write_text("\n".join(["time_s,displacement_mm", *rows]), encoding="utf-8")
    window.session.open(path)
    assert "Drive of a displacement alone" in measure.opened.object
    measure.more["drive"].value = "step:2V"
    assert "Film: " in measure.opened.object
    measure.more["drive"].value = ""
    window.session.take_example()
    window.strip.drive.value = "measured: example.csv"
    soon.until(lambda: len(drawn(window, "measured", "time")))
    there = window.strip.response.sources["measured"].data
    assert np.nanmax(there["displacement"]) == pytest.approx(4.3e-3, abs=2e-4)
    window.strip.drive.value = "step:4V"


def test_columns_are_chosen_and_the_fit_is_taken(window: Window, soon: Soon, record: Callable[..., Path]) -> None:
    path = record(titles="Zeitpunkt,Kanal 1,Kanal 2")
    window.measure.drop.param.update(filename=["odd.csv"], value=[path.read_bytes()])
    measure, columns = window.measure, window.measure.columns
    assert "box error" in measure.opened.object
    assert not columns.view.collapsed
    assert "<th>Kanal 2</th>" in columns.head.object
    for quantity, title, unit in (("time", "Zeitpunkt", "s"), ("voltage", "Kanal 1", "V"), ("current", "Kanal 2", "A")):
        columns.chosen[quantity][0].value, columns.chosen[quantity][1].value = title, unit
    columns.apply()
    assert "box error" not in measure.opened.object
    measure.model.value, measure.more["onset"].value = "rc", "5 s"
    measure.start()
    assert measure.fit.disabled
    assert "Fitting" in window.work.object
    assert window.stop.visible
    soon.until(lambda: window.session.work is None)
    assert "describes the data" in measure.answer.object
    fit: Any = window.session.fit
    own = ilg.identify(
        ilg.read(
            path,
            columns=["time=Zeitpunkt", "voltage=Kanal 1", "current=Kanal 2"],
            units=["time=s", "voltage=V", "current=A"],
            onset="5 s",
        ),
        model="rc",
        onset="5 s",
        engine="exact",
    )
    assert "<details open>" in measure.answer.object
    assert fit.result["capacitance"].value == pytest.approx(own["capacitance"].value, rel=1e-6)
    assert window.session.base == fit.result.actuator
    files = window.export.files
    assert b"[uncertainty" in files["fitted.toml"].content().read()
    assert b"ilg-circuit identify odd.csv" in files["report.html"].content().read()
    soon.until(lambda: window.session.run is not None and window.session.run.actuator == fit.result.actuator)


def test_a_sweep_and_a_design_of_the_moved_strip(window: Window, soon: Soon) -> None:
    window.strip.moving.widgets["width"][1].value = "6 mm"
    sweep, design = window.sweep, window.design
    for row in sweep.ranges.rows:
        row[3].value = 2
    assert sweep.ranges.texts[0].startswith("thickness=250 ")
    for name, ends in sweep.ranges.known.items():  # whatever is offered is understood
        parse_ranges([f"{name}={':'.join(map(_plain, ends))}"])
    sweep.start()
    soon.until(lambda: window.session.work is None)
    assert "4 designs solved" in sweep.answer.object
    assert sweep._table.startswith("thickness_m,width_m,displacement_final_m")
    design.ranges.rows[1][0].value = "(nothing)"
    design.require.value = "displacement_final>=3mm"
    design.start()
    soon.until(lambda: window.session.work is None)
    assert "meets all requirements" in design.answer.object
    design._use()
    strip = window.session.strip
    assert strip.geometry.width == pytest.approx(6e-3)
    run = ilg.simulate(strip, "step:4V", "300 s", engine="exact")
    assert run.displacement[-1] == pytest.approx(3e-3, rel=1e-2)
