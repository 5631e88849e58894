"""Runs ngspice in this process, through PySpice, with additional checks.

PySpice 1.5 needs these checks: it takes harmless notes on stderr for errors, so a run is judged by its result; it keeps
every circuit and plot, so both are removed; after a failed run it would read the previous run's plot, so old plots are
removed first and the new one's name, length and last time are checked.

The time points are ours: ngspice asks before every step (GetSyncData of its shared library), and gets the next point
of a given grid. So the trapezoidal rule works on a grid chosen for the circuit, and no tolerance of ngspice decides
about the accuracy; see `ilg_circuit.solve.transient`. The drive is an external source (GetVSRCData) whose voltage is
given with each point: no breakpoints, at which ngspice would fall back to first order, and no digits lost in a netlist.

An exception in one of these callbacks, such as KeyboardInterrupt, cannot pass through ngspice: it is kept, the run is
brought to its end in one step, and then it is raised.
"""

from __future__ import annotations

import contextlib
import logging
import os
import tempfile
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, ComplexArray
from ..errors import SolveError, StoppedEarlyError, first_line
from .library import VARIABLE, prepare_library

Run = Callable[..., Array]
#: Called with a grid's position and a function that reads a vector there; returns the voltage from then on.
Arrival = Callable[[int, Callable[[str], float]], float]

#: Truncation control is off: the grid decides. A linear circuit is solved in one Newton step, so its tolerances only
#: have to be wide enough for rounding.
_OPTIONS = {"method": "trap", "trtol": "1e12", "reltol": "1e-3", "abstol": "1e-6", "vntol": "1e-3", "chgtol": "1e-14"}
#: A nonlinear circuit is iterated until all voltages converge; far from the solution an exponential needs many steps.
#: Current convergence is not required: across a jump, capacitor currents are rounding errors amplified by C/h.
_NONLINEAR = {"reltol": "1e-12", "abstol": "1.0", "vntol": "1e-14", "itl1": "500", "itl4": "500"}
#: The relative part where voltages need not converge to their last digits.
_RELATIVE = "1e-11"
#: But ngspice stores the iteration before the last, so every point of a nonlinear circuit is begun with its drive a
#: little off, by this part of the largest: one more iteration follows, and stored currents belong to stored voltages.
_NUDGE = 1e-6

#: An operating point requires convergence of currents too, which are steady there.
_OPERATING_POINT = {"abstol": "1e-15", "gmin": "1e-15", "pivtol": "1e-40"}

_lock = threading.RLock()


class Session:
    """The one ngspice of this process. Use `session()`; it is safe across threads, not across a fork."""

    def __init__(self) -> None:
        self.library = prepare_library()
        logging.getLogger("PySpice").addHandler(logging.NullHandler())
        from PySpice.Spice.NgSpice import Shared

        self._grid: list[float] = [0.0]
        self._voltages: list[list[float]] = [[0.0]]
        self._position = 0
        self._kept: BaseException | None = None
        bare = Shared.ffi
        self._ffi = _Keeping(type(bare)(), self._keep)  # one that an interrupted attempt has declared nothing in
        with _clean_start():
            try:
                Shared.ffi = self._ffi
                self._shared = _quiet_class(Shared.NgSpiceShared)()
            except Exception as error:  # PySpice, cffi and the linker raise various errors
                raise SolveError(f"cannot load {self.library}: {first_line(error)}") from None
            finally:
                Shared.ffi = bare
        Shared.NgSpiceShared._instances[0] = self._shared  # a user's own simulators run in the same ngspice
        self._running = False
        self._arrived: Arrival | None = None
        self._reached = -1
        self._lib = self._shared._ngspice_shared
        self._holds = False
        self._process = os.getpid()
        self._tiny = 0.0
        self._nudge = 0.0
        self._begun = -1.0
        self._complaints: list[str] = []
        self._loads = 0
        self._sync = self._ffi.callback("int(double, double *, double, int, int, int, void *)", self._next_step)
        self._source = self._ffi.callback("int(double *, double, char *, int, void *)", self._source_voltage)
        identity = self._shared._ngspice_id
        if self._lib.ngSpice_Init_Sync(self._source, self._ffi.NULL, self._sync, identity, self._shared._self_c):
            raise SolveError("ngspice refused the time step callback; its version is too old (36 or later is needed)")
        self._raise_kept()

    @property
    def version(self) -> str:
        return str(self._shared.ngspice_version)

    @contextlib.contextmanager
    def loaded(
        self, circuit: str, end: float, vectors: list[str], *, linear: bool = True, settled: float | None = None
    ) -> Iterator[Run]:
        """Load a circuit's text once, for a run on any number of grids.

        Gives ``run(grid, voltages)``: ``grid`` [s] ascends from 0 to ``end``, ``voltages`` [V] (points,) at its points
        belong to the circuit's external source, or (sources, points) of several named Vdrive_0, Vdrive_1, ... It
        returns ``vectors`` at all points after 0, shape (vectors, points). Initial conditions are the elements'. A
        third argument of ``run`` is called at each point of the grid that is reached, and gives the voltage of the next
        one in place of ``voltages``. ``linear=False`` iterates every step until it converges: to the last digits, or to
        ``settled`` [V] where rounding is larger. Raises SolveError when ngspice rejects the circuit, stops early, or
        leaves the grid.
        """
        stop = 1.01 * end  # ngspice drops points very near its end, so its end lies beyond ours

        def run(grid: Array, voltages: Array, arrived: Arrival | None = None) -> Array:
            self._command("destroy all")
            waves = np.atleast_2d(voltages)
            self._grid = [*grid.tolist(), stop]
            self._voltages = [[*wave, wave[-1]] for wave in waves.tolist()]
            self._position, self._tiny, self._begun = 0, 1e-15 * end, -1.0
            self._nudge = 0.0 if linear else _NUDGE * float(np.abs(voltages).max())
            self._running, self._arrived, self._reached = True, arrived, -1
            try:
                self._command("run")
            finally:
                self._running, self._arrived = False, None
            return self._read(vectors, grid)

        options = {} if linear else _NONLINEAR
        if settled and not linear:
            options = options | {"reltol": _RELATIVE, "vntol": repr(settled)}
        with self._holding(circuit, options, f".save {' '.join(vectors)}\n.tran {stop!r} {stop!r} 0 {stop!r} uic"):
            yield run

    def ac(self, circuit: str, frequencies: Array, vectors: list[str]) -> ComplexArray:
        """Return small-signal ``vectors`` at ``frequencies`` [Hz] about the operating point (vectors, frequencies).

        The circuit's text holds its sources' DC and AC values. Raises SolveError when ngspice rejects it or finds no
        operating point.
        """
        result = np.empty((len(vectors), len(frequencies)), dtype=np.complex128)
        with self._holding(circuit, _NONLINEAR | _OPERATING_POINT, f".save {' '.join(vectors)}"):
            for k, frequency in enumerate(frequencies.tolist()):
                self._command(f"ac lin 1 {frequency!r} {frequency!r}")
                plot = self._plot("ac", "small-signal analysis")
                result[:, k] = [self._vector(f"{plot}.{name}", complex_=True)[-1] for name in vectors]
                self._command("destroy all")
        return result

    @contextlib.contextmanager
    def _holding(self, circuit: str, options: dict[str, str], analysis: str) -> Iterator[None]:
        """Lock ngspice while it holds a circuit, which is removed at the end."""
        if os.getpid() != self._process:
            raise SolveError("ngspice was loaded before this process was forked; start workers with spawn or loky")
        with _lock:
            self._forget()
            try:
                self._load(circuit, _OPTIONS | options, analysis)
                yield
            finally:
                self._forget()

    def _forget(self) -> None:
        """Remove ngspice's results, and a circuit that an interrupted call may have left."""
        self._command("destroy all")
        if self._holds:
            self._command("remcirc")
            self._holds = False
        self._lib.ngSpice_Command(self._ffi.NULL)  # clears ngspice's list of commands, which grows otherwise

    def _command(self, text: str) -> None:
        self._shared.exec_command(text)
        self._raise_kept()

    def _keep(self, _kind: Any, error: BaseException, _traceback: Any) -> None:
        """Keep the first exception of a callback, and let the run end with its next step."""
        self._kept = self._kept or error
        self._position = len(self._grid) - 1

    def _raise_kept(self) -> None:
        """Raise the exception that occurred in a callback while ngspice ran, if any."""
        kept, self._kept = self._kept, None
        if kept:
            raise kept

    def _next_step(self, time: float, delta: Any, _old: float, redo: int, _id: int, where: int, _data: Any) -> int:
        """Answer ngspice before (where = 0) and after each step. Returns 1 to have the step repeated."""
        if not self._running:  # a run of a user's own simulator
            return redo
        if where or redo:  # a step that did not converge is repeated with ngspice's own shorter one
            if redo and self._kept:
                delta[0] = 0.0  # which it gives up at once
            return redo
        ahead = self._grid[self._position] - time
        if ahead <= self._tiny and self._position < len(self._grid) - 1:
            if self._arrived and self._reached < self._position:
                self._reached = self._position
                self._voltages[0][self._position + 1] = self._arrived(self._position, self._latest)
            self._position += 1
            ahead = self._grid[self._position] - time
        # beyond its end, which only a circuit that is not ours has, the run is ended by ever longer steps
        delta[0] = max(ahead, self._tiny) if ahead > 0 else max(time, self._tiny)
        return 0

    def _latest(self, name: str) -> float:
        """Return the last value of a vector while a run goes on."""
        info = self._lib.ngGet_Vec_Info(name.encode())
        if info == self._ffi.NULL or info.v_realdata == self._ffi.NULL or not info.v_length:
            raise SolveError(f"ngspice has no vector {name} while it runs; its version is too old")
        return float(info.v_realdata[info.v_length - 1])

    def _source_voltage(self, voltage: Any, time: float, name: Any, _id: int, _data: Any) -> int:
        """Give ngspice the voltage of an external source, at every Newton iteration."""
        if not self._running:
            return 0
        k = self._position
        wave = self._voltages[0]
        if len(self._voltages) > 1:
            wave = self._voltages[int(self._ffi.string(name).rpartition(b"_")[2])]
        ahead = self._grid[k] - time
        if ahead <= self._tiny or k == 0:
            voltage[0] = wave[k]
        else:  # a step made shorter by ngspice
            share = ahead / (self._grid[k] - self._grid[k - 1])
            voltage[0] = wave[k] + share * (wave[k - 1] - wave[k])
        if self._nudge and time != self._begun:
            self._begun = time
            voltage[0] += self._nudge
        return 0

    def _load(self, circuit: str, options: dict[str, str], analysis: str) -> None:
        self._loads += 1
        head = [self._title, *(f".options {key}={value}" for key, value in options.items())]
        body = circuit.partition("\n")[2]
        text = [*head, *body.splitlines(), *analysis.splitlines(), ".end"]
        lines = [self._ffi.new("char[]", line.encode()) for line in text if line]
        self._shared.clear_output()
        self._holds = True
        refused = self._lib.ngSpice_Circ(self._ffi.new("char *[]", [*lines, self._ffi.NULL]))
        self._raise_kept()
        if refused:
            raise SolveError(f"ngspice did not accept the circuit: {self._complaint()}")
        self._complaints = [*self._shared._stderr, *self._shared._stdout]

    def _complaint(self) -> str:
        """Return ngspice's own error message, in one line."""
        lines = [*self._complaints, *self._shared._stderr, *self._shared._stdout]
        telling = [line.strip() for line in lines if "error" in line.lower() or "singular" in line.lower()]
        return "; ".join(telling[:3]) or "it gave no reason"

    def _plot(self, kind: str, analysis: str) -> str:
        """Return ngspice's name of the results of the previous run."""
        plot: str = self._ffi.string(self._lib.ngSpice_CurPlot()).decode()
        if not plot.startswith(kind):
            raise SolveError(f"ngspice did not run the {analysis}: {self._complaint()}")
        if self._shared.exec_command("echo $curplottitle").strip() != self._title:
            # it refused this circuit without a word, and ran one that the user's own simulator had left
            raise SolveError(f"ngspice did not accept the circuit: {self._complaint()}")
        return plot

    @property
    def _title(self) -> str:
        """Title of the circuit loaded last: no other circuit of this process has it."""
        return f"ilg_circuit {self._loads}"

    def _read(self, vectors: list[str], grid: Array) -> Array:
        plot = self._plot("tran", "transient")
        time = self._vector(f"{plot}.time")
        if not len(time) or time[-1] < grid[-1] * (1 - 1e-12):
            reached = time[-1] if len(time) else 0.0
            raise StoppedEarlyError(f"ngspice stopped at {reached:g} s of {grid[-1]:g} s: {self._complaint()}")
        # the grid's points among all: a version may store the start, a repeated step adds points of its own
        at = np.searchsorted(time, grid[1:] * (1 - 1e-12))
        if not np.allclose(time[at], grid[1:], rtol=1e-11, atol=0):
            raise SolveError("ngspice left the time grid it was given; please report its version")
        return np.array([self._vector(f"{plot}.{name}")[at] for name in vectors])

    def _vector(self, name: str, *, complex_: bool = False) -> NDArray[Any]:
        info = self._lib.ngGet_Vec_Info(name.encode())
        data = self._ffi.NULL if info == self._ffi.NULL else (info.v_compdata if complex_ else info.v_realdata)
        if data == self._ffi.NULL:
            raise SolveError(f"ngspice returned no vector {name.partition('.')[2]}: {self._complaint()}")
        kind, size = (np.complex128, 16) if complex_ else (np.float64, 8)
        return np.frombuffer(self._ffi.buffer(data, size * info.v_length), dtype=kind).copy()


_sessions: list[Session] = []
_loaded: list[threading.Event] = []


def session() -> Session:
    """Return the process's ngspice, loaded at the first call. Raises MissingLibraryError when there is none."""
    with _lock:
        if not _sessions:
            _load()
        return _sessions[0]


def _load() -> None:
    """Load ngspice, which works once in a process: an exception that arrives meanwhile, as by Ctrl-C, is raised after.

    Such exceptions are raised in the main thread, so another one does it.
    """
    failures: list[Exception] = []

    def load() -> None:
        try:
            _sessions.append(Session())
        except Exception as error:
            failures.append(error)
        finally:
            done.set()

    if not _loaded or _loaded[-1].is_set():  # else an interrupted call has begun it
        done, thread = threading.Event(), threading.Thread(target=load, daemon=True)
        _loaded.append(done)
        thread.start()
    interrupted: BaseException | None = None
    while not _loaded[-1].is_set():
        try:
            _loaded[-1].wait()
        except BaseException as error:
            interrupted = error
    for raised in (interrupted, *failures):
        if raised:
            raise raised


class _Keeping:
    """A cffi interface whose callbacks hand their exceptions to ``keep``, where cffi itself would drop them.

    A function None is a callback that ngspice is not given.
    """

    def __init__(self, bare: Any, keep: Callable[[Any, BaseException, Any], None]) -> None:
        self._bare, self._keep = bare, keep

    def __getattr__(self, name: str) -> Any:
        return getattr(self._bare, name)

    def callback(self, signature: str, function: Callable[..., Any] | None) -> Any:
        return self._bare.callback(signature, function, onerror=self._keep) if function else self._bare.NULL


def _quiet_class(base: Any) -> Any:
    """Return PySpice's interface with messages collected and not interpreted."""
    from PySpice.Spice.NgSpice.Shared import ffi

    class QuietShared(base):  # type: ignore[misc]
        _send_stat = None  # of a run's progress, a thousand times

        @staticmethod
        def _send_char(message: Any, _ngspice_id: int, user_data: Any) -> int:
            self = ffi.from_handle(user_data)
            stream, _, content = ffi.string(message).decode(errors="replace").partition(" ")
            (self._stderr if stream == "stderr" else self._stdout).append(content)
            return 0

    return QuietShared


@contextlib.contextmanager
def _clean_start() -> Any:
    """An empty working and home directory while ngspice starts, and no variables of its own.

    A `.spiceinit` there, or a `spinit` in $SPICE_SCRIPTS, would run as commands.
    """
    kept = dict(os.environ)
    with tempfile.TemporaryDirectory() as empty, contextlib.chdir(empty):
        for name in [name for name in kept if name.startswith(("SPICE_", "NGSPICE_")) and name != VARIABLE]:
            del os.environ[name]
        try:
            os.environ["HOME"] = empty
            yield
        finally:
            os.environ.update(kept)
            if "HOME" not in kept:
                del os.environ["HOME"]
