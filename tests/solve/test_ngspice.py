"""The one ngspice of this process: it survives what it is given, and runs nothing but the circuit."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PySpice.Spice.Netlist import Circuit

from ilg_circuit.circuit import electrical_netlist, strip_netlist
from ilg_circuit.errors import SolveError
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.solve import transient
from ilg_circuit.solve.ngspice import session
from ilg_circuit.strip.actuator import PAPER

RC = ".title rc\nV1 in 0 1.0\nR1 in out 2.0\nC1 out 0 0.5 ic=0.0\n"
GRID = np.linspace(0, 5, 501)


def solve(circuit: str, vectors: list[str], grid: NDArray[np.float64] = GRID) -> NDArray[np.float64]:
    """A circuit without an external source, whose voltages then do not matter."""
    with session().loaded(circuit, float(grid[-1]), vectors) as run:
        return run(grid, np.zeros_like(grid))


def python(code: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run code in a fresh interpreter with ``folder`` as working directory."""
    return subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)],
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=60,
    )


SOLVE = """
    import numpy as np
    from ilg_circuit.strip.actuator import PAPER
    from ilg_circuit.circuit import strip_netlist
    from ilg_circuit.drive import PiecewiseLinear
    from ilg_circuit.simulation.drives import parse_drive
    from ilg_circuit.errors import IlgError
    from ilg_circuit.solve import transient

    def solve(drive=parse_drive("step:4V", 100.0), end=100.0):
        return transient(strip_netlist(PAPER), drive, np.linspace(0, end, 21)).output("current")[0]
"""


def test_a_circuit_on_a_given_grid() -> None:
    out, current = solve(RC, ["out", "v1#branch"])
    assert out == pytest.approx(1 - np.exp(-GRID[1:]), abs=1e-4)
    assert current == pytest.approx(-np.exp(-GRID[1:]) / 2, abs=1e-4)


def test_halving_the_steps_quarters_the_error() -> None:
    """Trapezoidal on exactly the steps asked for: what Richardson's extrapolation builds on."""
    errors = []
    # begun with steps so short that the backward Euler of the first one does not count
    base = np.concatenate([[0.0], 0.1 * 2.0 ** np.arange(-20, 0), np.linspace(0.1, 5, 50)])
    for parts in (1, 2, 4):
        grid = np.append((base[:-1, None] + np.diff(base)[:, None] * np.arange(parts) / parts).ravel(), 5.0)
        (out,) = solve(RC, ["out"], grid)
        errors.append(np.abs(out - (1 - np.exp(-grid[1:]))).max())
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.02)
    assert errors[1] / errors[2] == pytest.approx(4, rel=0.02)


def test_each_of_two_external_sources_has_its_own_voltage() -> None:
    text = ".title two\n" + "".join(
        f"Vdrive_{k} in{k} 0 external\nR{k} in{k} out{k} 2.0\nC{k} out{k} 0 0.5 ic=0.0\n" for k in (0, 1)
    )
    voltages = np.outer([1.0, -3.0], np.ones_like(GRID))
    with session().loaded(text, float(GRID[-1]), ["out0", "out1"]) as run:
        found = run(GRID, voltages)
    assert found == pytest.approx(voltages[:, 1:] * (1 - np.exp(-GRID[1:])), abs=3e-4)


def test_a_drive_that_is_told_as_the_run_goes_on() -> None:
    """At each point after the first it reads what has been reached, and gives the next voltage, not the stated one."""
    reads = []

    def arrived(position: int, read: Callable[[str], float]) -> float:
        if position:
            reads.append(read("out"))
        return 1.0

    with session().loaded(RC.replace("V1 in 0 1.0", "Vdrive in 0 external"), float(GRID[-1]), ["out"]) as run:
        (out,) = run(GRID, np.eye(1, len(GRID))[0], arrived)
        with pytest.raises(SolveError, match="no vector nothing"):
            run(GRID, np.zeros_like(GRID), lambda position, read: read("nothing") if position else 0.0)
    assert out == pytest.approx(1 - np.exp(-GRID[1:]), abs=1e-4)
    assert reads == out[: len(reads)].tolist()
    assert len(reads) >= len(out) - 1


BROKEN = {
    "no such element": "Zzz a b 1",
    "no such model": "D1 out 0 nomodel",
    "parallel sources": "V2 in 0 2.0",
    "controlled by nothing": "F1 out 0 Vnone 1.0",
    "missing include": ".include none.lib",
    "unknown subcircuit": "X1 in out nothing",
}


@pytest.mark.parametrize("line", BROKEN.values(), ids=BROKEN)
def test_a_circuit_that_ngspice_rejects_leaves_the_session_usable(line: str) -> None:
    with pytest.raises(SolveError, match="ngspice"):
        solve(RC + line + "\n", ["out"])
    assert solve(RC, ["out"])[0] == pytest.approx(1 - np.exp(-GRID[1:]), abs=1e-4)


def test_a_circuit_of_the_users_own_simulator_is_not_run_for_a_rejected_one() -> None:
    """PySpice leaves its circuits loaded, and ngspice falls back to them."""
    own = Circuit("own")
    own.V(1, "in", own.gnd, 1.0)
    own.R(1, "in", "out", 5.0)
    own.C(1, "out", own.gnd, 1e-6)
    own.simulator().transient(step_time=1e-7, end_time=5e-6)
    with pytest.raises(SolveError, match="ngspice did not accept the circuit: Error: unknown subckt"):
        solve(RC + "X1 in out nothing\n", ["out"])
    assert solve(RC, ["out"])[0] == pytest.approx(1 - np.exp(-GRID[1:]), abs=1e-4)


def test_a_circuit_that_ngspice_gives_up_on_is_an_error_not_a_crash(tmp_path: Path) -> None:
    """After some mistakes ngspice wants to be unloaded, which a process cannot do: every later run must say so."""
    code = f"""
    import numpy as np
    from ilg_circuit.errors import SolveError
    from ilg_circuit.solve.ngspice import session
    for text in ({RC + "B1 x 0 v=foo(bar"!r}, {RC!r}):
        try:
            with session().loaded(text + "\\n", 5.0, ["out"]) as run:
                run(np.linspace(0, 5, 51), np.zeros(51))
        except SolveError as error:
            print(error)
    """
    done = python(code, tmp_path)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == 2


def test_a_vector_that_does_not_exist_is_no_old_one() -> None:
    solve(RC, ["out"])
    with pytest.raises(SolveError):
        solve(RC, ["elsewhere"])


def test_complaints_are_one_line() -> None:
    with pytest.raises(SolveError) as caught:
        solve(RC + "D1 out 0 nomodel\n", ["out"])
    assert "\n" not in str(caught.value)


def test_nothing_is_left_behind() -> None:
    """PySpice keeps every circuit and plot: hundreds of runs would grow slower and slower."""
    for _ in range(3):
        solve(RC, ["out"])
    shared = session()._shared
    assert [name for name in shared.plot_names if name.startswith("tran")] == []


def test_the_same_run_gives_the_same_bits() -> None:
    first, second = (solve(RC, ["out"]) for _ in range(2))
    assert (first == second).all()


def test_threads_take_turns() -> None:
    nets = [electrical_netlist(600.0, ((float(r), 0.3),)) for r in range(10, 18)]
    drive, t = parse_drive("step:1V", 30.0), np.linspace(0, 30, 61)
    alone = [transient(net, drive, t).values for net in nets]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda net: transient(net, drive, t).values, nets))
    for a, b in zip(alone, together, strict=True):
        assert (a == b).all()


def test_ngspice_leaves_the_working_directory_and_home_as_they_were(tmp_path: Path) -> None:
    code = (
        SOLVE
        + """
    import os
    before = os.getcwd(), os.environ["HOME"]
    solve()
    assert (os.getcwd(), os.environ["HOME"]) == before
    """
    )
    done = python(code, tmp_path, HOME=str(tmp_path))
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("where", ["working directory", "home"])
def test_a_spiceinit_is_not_run(tmp_path: Path, where: str) -> None:
    work, home = tmp_path / "work", tmp_path / "home"
    for folder in (work, home):
        folder.mkdir()
    hostile = work if where == "working directory" else home
    for name in (".spiceinit", "spice.rc"):
        (hostile / name).write_text(f"* init\nshell touch {tmp_path / 'pwned'}\n")
    done = python(SOLVE + "\n    print(solve())\n", work, HOME=str(home))
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) == pytest.approx(0.2118)
    assert not (tmp_path / "pwned").exists()


def test_an_actuators_name_runs_nothing(tmp_path: Path) -> None:
    code = (
        SOLVE
        + """
    from dataclasses import replace
    strip = replace(PAPER, name="x\\n.control\\nshell touch pwned\\n.endc\\n*")
    try:
        transient(strip_netlist(strip), parse_drive("step:4V", 1.0), [0.5, 1.0])
    except IlgError:
        pass
    """
    )
    done = python(code, tmp_path)
    assert done.returncode == 0, done.stderr
    assert not (tmp_path / "pwned").exists()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this platform cannot fork")
def test_a_forked_child_is_told_to_start_afresh(tmp_path: Path) -> None:
    code = (
        SOLVE
        + """
    import os, warnings
    warnings.simplefilter("ignore")  # newer Pythons warn of any fork beside threads
    solve()
    child = os.fork()
    if not child:
        try:
            solve()
        except IlgError as error:
            os._exit(7 if "spawn" in str(error) else 8)
        os._exit(9)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
    solve()
    """
    )
    done = python(code, tmp_path)
    assert done.returncode == 0, done.stderr


def test_a_library_that_is_none_is_told(tmp_path: Path) -> None:
    (tmp_path / "libngspice.so").write_text("not a library")
    code = (
        SOLVE
        + """
    try:
        solve()
    except IlgError as error:
        print(error)
    """
    )
    done = python(code, tmp_path, NGSPICE_LIBRARY_PATH=str(tmp_path / "libngspice.so"))
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("cannot load")
    assert len(done.stdout.splitlines()) == 1


def test_a_library_that_is_none_is_told_every_time(tmp_path: Path) -> None:
    (tmp_path / "libngspice.so").write_text("not a library")
    code = (
        SOLVE
        + """
    for _ in range(2):
        try:
            solve()
        except IlgError as error:
            print(error)
    """
    )
    done = python(code, tmp_path, NGSPICE_LIBRARY_PATH=str(tmp_path / "libngspice.so"))
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == 2


@pytest.mark.parametrize(
    "drive",
    [
        "PiecewiseLinear.step(4.0, at=1e-9)",
        "PiecewiseLinear([0, 10, 10, 10 + 1e-9, 10 + 1e-9], [0, 0, 4, 4, 0])",
        "PiecewiseLinear([0, 10, 10, 10 + 1e-12, 30], [0, 0, 4, 5, 0])",
        "PiecewiseLinear.square(0, 1, 2e-9, 2e-6)",
        "PiecewiseLinear.step(4.0, at=100 - 1e-9)",
    ],
    ids=["near the start", "short pulse", "bend near a jump", "fast square", "near the end"],
)
def test_edges_nearer_than_a_rise_do_not_take_the_process_down(tmp_path: Path, drive: str) -> None:
    end = 1e-6 if "square" in drive else 100.0
    code = (
        SOLVE
        + f"""
    try:
        solve({drive}, {end})
    except IlgError as error:
        print(error)
    """
    )
    done = python(code, tmp_path)
    assert done.returncode == 0, f"exit code {done.returncode}: {done.stderr[-300:]}"


def test_messages_of_pyspice_do_not_reach_the_user(tmp_path: Path) -> None:
    done = python(SOLVE + "\n    solve()\n", tmp_path)
    assert done.returncode == 0
    assert done.stdout == ""
    assert done.stderr == ""


def test_importing_loads_no_library(tmp_path: Path) -> None:
    code = """
    import sys
    import ilg_circuit.solve, ilg_circuit.simulation.response, ilg_circuit.circuit
    assert "PySpice" not in sys.modules
    """
    done = python(code, tmp_path, NGSPICE_LIBRARY_PATH="/nowhere")
    assert done.returncode == 0, done.stderr


def test_the_version_is_known() -> None:
    assert session().version.isdigit()
    assert session() is session()
    assert strip_netlist(PAPER).title.startswith("ILG strip")
