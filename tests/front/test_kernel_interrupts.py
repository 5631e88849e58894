"""Interrupting a cell of a notebook: the work ends at once, and kernel and ngspice are usable as before."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from queue import Empty
from typing import Any

import pytest

manager = pytest.importorskip("jupyter_client.manager")
pytest.importorskip("ipykernel")

Cell = Callable[..., list[str]]

BEGIN = """
import numpy as np
import ilg_circuit as ilg
t = np.arange(-20, 300, 0.1)
noise = 1e-4 * np.random.default_rng(0).standard_normal(len(t))
current = np.where(t < 0, 0, 4 / 600 + 4 / 20 * np.exp(-t / 7) + 4 / 300 * np.exp(-t / 40)) + noise
run = lambda: ilg.simulate("paper", "square:4V,30s", "60 s").current
expected = run()
"""
FIT = "ilg.identify(time=t, voltage=np.where(t < 0, 0, 4.0), current=current, model='rc2', intervals='bootstrap')"
SWEEP = "ilg.sweep('paper', 'step:4V', '60 s', vary=['thickness=0.2mm:1mm:2000'])"


@pytest.fixture(scope="module")
def cell() -> Iterator[Cell]:
    """What runs a cell, interrupts it after so many seconds, and returns its output and the name of its error."""
    kernels, client = manager.start_new_kernel(kernel_name="python3")

    def run(code: str, interrupt: float | None = None) -> list[str]:
        message, sent = client.execute(code), False
        began, found = time.monotonic(), []
        while time.monotonic() - began < 60:
            if interrupt is not None and not sent and time.monotonic() - began > interrupt:
                kernels.interrupt_kernel()
                sent = True
            try:
                answer: Any = client.get_iopub_msg(timeout=0.1)
            except Empty:
                continue
            if answer["parent_header"].get("msg_id") != message:
                continue
            content = answer["content"]
            found += [content[key] for key in ("ename", "text") if key in content]
            if content.get("execution_state") == "idle":
                return found
        raise AssertionError(f"the cell did not end: {found}")

    yield run
    client.stop_channels()
    kernels.shutdown_kernel(now=True)


def test_long_work_ends_and_the_kernel_goes_on(cell: Cell) -> None:
    assert cell(BEGIN) == []
    for work in (FIT, SWEEP):
        assert "KeyboardInterrupt" in cell(work, interrupt=0.5)
        assert cell("print((run() == expected).all())") == ["True\n"]
