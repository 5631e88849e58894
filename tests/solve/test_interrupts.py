"""Exceptions that arrive while ngspice runs: raised, none swallowed, and ngspice solves on as if nothing had been."""

from __future__ import annotations

import gc
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import FrameType

import numpy as np
import pytest

from ilg_circuit.circuit import strip_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.solve import transient
from ilg_circuit.solve.ngspice import session
from ilg_circuit.strip.actuator import PAPER, Actuator

NONLINEAR = replace(PAPER, material=replace(PAPER.material, emission_voltage=0.5))
TIMES = np.linspace(0, 6, 21)
DRIVE = PiecewiseLinear.square(-4.0, 4.0, 2.0, 6.0)


class Alarm(Exception):
    """What a handler of the user's own may raise."""


@pytest.fixture
def alarm(request: pytest.FixtureRequest) -> Iterator[type[BaseException]]:
    """The exception that a timer raises."""

    def ring(*_: object) -> None:
        raise request.param

    before = signal.signal(signal.SIGALRM, ring)
    yield request.param
    gc.enable()
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="this platform has no timers")
@pytest.mark.parametrize(
    ("strip", "alarm"),
    [(PAPER, KeyboardInterrupt), (NONLINEAR, Alarm)],
    ids=["linear", "nonlinear"],
    indirect=["alarm"],
)
def test_an_exception_at_any_time_is_raised_and_leaves_no_trace(strip: Actuator, alarm: type[BaseException]) -> None:
    netlist = strip_netlist(strip)
    expected = transient(netlist, DRIVE, TIMES).values
    began = time.perf_counter()
    transient(netlist, DRIVE, TIMES)
    usual = time.perf_counter() - began
    random = np.random.default_rng(13)
    raised = 0
    gc.disable()  # hypothesis times collections by a callback, which would swallow the exception
    for _ in range(20):
        after = random.uniform(0.01, 0.7) * usual
        began = time.perf_counter()
        try:
            signal.setitimer(signal.ITIMER_REAL, after)
            transient(netlist, DRIVE, TIMES)
            # solved sooner than usual: the alarm is still to come, and must not ring outside
            left, _ = signal.setitimer(signal.ITIMER_REAL, 0)
        except alarm:
            raised += 1
            assert time.perf_counter() - began < after + 1.0
        else:
            assert left > 0
    gc.enable()
    assert raised >= 10
    assert (transient(netlist, DRIVE, TIMES).values == expected).all()


def test_an_interrupt_while_ngspice_is_loaded(tmp_path: Path) -> None:
    """A process can load it once only: the first call is interrupted, the next one solves."""
    code = """
    import os, signal
    import numpy as np
    from ilg_circuit.circuit import electrical_netlist
    from ilg_circuit.drive import PiecewiseLinear
    from ilg_circuit.solve import ngspice, transient

    def load(self, make=ngspice.Session.__init__):
        os.kill(os.getpid(), signal.SIGINT)
        make(self)

    ngspice.Session.__init__ = load
    folder = os.getcwd()
    try:
        ngspice.session()
    except KeyboardInterrupt:
        print("interrupted", os.getcwd() == folder)
    solved = transient(electrical_netlist(600.0, ((20.0, 0.3),)), PiecewiseLinear.step(1.0), np.linspace(0, 30, 7))
    print(solved.values.shape)
    """
    program = "\n".join(line[4:] for line in code.splitlines())
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.stderr == ""
    assert done.stdout.splitlines()[0] == "interrupted True"
    assert len(done.stdout.splitlines()) == 2


@pytest.mark.parametrize("where", ["time step", "source", "message"])
def test_an_exception_in_each_callback(where: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of them is asked by ngspice; the second call fails, as if an interrupt had come just then."""
    ngspice = session()
    name = {"time step": "_next_step", "source": "_source_voltage", "message": "_send_char"}
    owner = ngspice._shared if where == "message" else ngspice
    code = getattr(owner, name[where]).__code__
    calls = 0

    def trace(frame: FrameType, event: str, _argument: object) -> None:
        nonlocal calls
        if frame.f_code is code and event == "call":
            calls += 1
            if calls == 2:
                raise KeyboardInterrupt(where)

    expected = transient(strip_netlist(PAPER), DRIVE, TIMES).values
    sys.settrace(trace)
    try:
        with pytest.raises(KeyboardInterrupt, match=where):
            transient(strip_netlist(PAPER), DRIVE, TIMES)
    finally:
        sys.settrace(None)
    assert (transient(strip_netlist(PAPER), DRIVE, TIMES).values == expected).all()
