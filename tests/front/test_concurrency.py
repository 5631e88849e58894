"""Interrupts, threads and processes: the engine stays usable, and results are the same as alone."""

from __future__ import annotations

import multiprocessing
import threading
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from itertools import count

import numpy as np
import pytest
from numpy.testing import assert_allclose

import ilg_circuit as ilg
from ilg_circuit.study.workers import processes_possible


def final(voltage: float) -> float:
    return float(ilg.simulate("paper", f"step:{voltage}V", "10 s", samples=11, accuracy=1e-6).displacement[-1])


@pytest.fixture(scope="module")
def alone() -> list[float]:
    return [final(voltage) for voltage in (1.0, 2.0, 3.0, 4.0)]


def test_threads_that_simulate_at_once_get_what_one_gets(alone: list[float]) -> None:
    with ThreadPoolExecutor(2) as pool:
        assert_allclose(list(pool.map(final, (1.0, 2.0, 3.0, 4.0))), alone, rtol=1e-9)


@pytest.mark.skipif(not processes_possible(), reason="this machine lets processes share no locks")
@pytest.mark.parametrize("method", ["spawn", "forkserver"])
def test_processes_that_start_afresh_get_what_one_gets(method: str, alone: list[float]) -> None:
    with ProcessPoolExecutor(1, multiprocessing.get_context(method)) as pool:
        assert_allclose(list(pool.map(final, (1.0, 2.0))), alone[:2], rtol=1e-9)


def test_an_interrupted_fit_leaves_ngspice_usable(alone: list[float]) -> None:
    """What Ctrl-C does in a notebook: KeyboardInterrupt in the main thread while a fit evaluates."""
    t = np.arange(-5.0, 60.0, 0.5)
    current = np.where(t < 0, 0.0, 4 / 600 + 4 / 20 * np.exp(-np.maximum(t, 0) / 7))
    calls = count()

    def stop(*_: object) -> None:
        if next(calls) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ilg.identify(time=t, voltage=np.where(t < 0, 0.0, 4.0), current=current, model="rc", progress=stop)
    assert final(1.0) == pytest.approx(alone[0], rel=1e-9)
    assert threading.active_count() < 10
