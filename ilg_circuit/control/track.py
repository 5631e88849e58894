"""Finds the voltage that makes the tip, or its blocked force, follow a path; says how well, and what limits it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from ..arrays import Array, plain
from ..circuit.load import Load
from ..circuit.strip import strip_netlist
from ..drive import Drive, PiecewiseLinear, drive_findings
from ..errors import InputError, SolveError, argument
from ..files import write_csv
from ..findings import Finding, Warned
from ..result import Column, Result
from ..simulation.prediction_band import prediction_band
from ..simulation.response import Response, line_of, simulate, transient_band
from ..simulation.waveforms import WAVEFORMS
from ..solve.state_space import state_space
from ..strip.actuator import Actuator
from .bound import fastest_settling
from .plant import TIPS, plants_of, speeds, unit_of
from .programme import Answers, Limits, answers, nearest_voltage

#: Nodes of the voltage, the most of them, and the largest error of a path that counts as followed, in parts of it.
NODES, MOST_NODES, FOLLOWED = 301, 2001, 0.01
#: How near a limit counts as at it, and steps of Gauss and Newton with the voltage's change that ends them [V/V].
_AT, _STEPS, _SAME = 1e-5, 12, 1e-5
#: Times of the impulse response for the largest rate, in time constants from the slowest pole to the fastest.
_LONG, _FINE = 8.0, 4000


class Voltage:
    """Mixin of results whose ``drive`` is a voltage to apply."""

    drive: PiecewiseLinear

    def write_drive(self, path: str | Path) -> None:
        """Write the voltage of ``drive`` as a CSV file that ``simulate --drive file:`` reads.

        Parameters
        ----------
        path : str or Path
            The file to write; it is replaced whole or not at all.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        write_csv(path, {"time_s": self.drive.times, "voltage_V": self.drive.values})


@dataclass(frozen=True, repr=False, eq=False)
class Tracked(Voltage, Warned, Result):
    """The voltage whose displacement, or force, is nearest to a path, as `ilg_circuit.track` returns it.

    Attributes
    ----------
    actuator : Actuator
        The strip.
    quantity : {"displacement", "force"}
        What follows the path: the displacement [m] of the free tip, or the force [N] of the clamped one.
    path : ndarray (m,)
        What is asked for, in ``unit``, at ``time``, which is that of the voltage's nodes and half way between them.
    drive : PiecewiseLinear
        The voltage as a drive, for `ilg_circuit.simulate`.
    limits : Limits
        Largest ``voltage`` [V], ``slew`` [V/s], ``current`` [A], ``energy`` [J].
    stderr : ndarray (m,) or None
        Standard error of the quantity from the uncertainty of a fitted strip.
    at_limit : float
        Share of the time at a limit.
    reach, rate : float
        Largest displacement [m] or force [N] that the limit of the voltage holds, and largest rate [m/s] or [N/s] that
        it reaches from rest.
    bound : float or None
        Shortest time [s] in which any voltage settles at the path's largest value; None if it is out of reach.
    response : Response
        The run of the strip under the drive.
    findings : tuple of Finding
        What the voltage should be known for.
    """

    presenter: ClassVar[str] = "track"
    actuator: Actuator
    path_text: str
    path: Array
    drive: PiecewiseLinear
    limits: Limits
    response: Response
    at_limit: float
    reach: float
    rate: float
    bound: float | None
    stderr: Array | None = None
    quantity: str = "displacement"
    findings: tuple[Finding, ...] = ()

    @property
    def time(self) -> Array:
        """Times [s] (m,)."""
        return self.response.time

    @property
    def unit(self) -> str:
        """Unit of the path and of what follows it: "m" or "N"."""
        return WAVEFORMS[self.quantity].unit

    @property
    def output(self) -> Array:
        """What follows the path (m,): displacement [m] or force [N], as ``quantity`` says."""
        return self.response.waveforms[self.quantity]

    @property
    def displacement(self) -> Array:
        """Displacement [m] (m,); that of a clamped tip is zero."""
        return self.response.displacement

    @property
    def force(self) -> Array:
        """Force [N] (m,); that of a free tip without a load is zero."""
        return self.response.force

    @property
    def voltage(self) -> Array:
        """Voltage [V] (m,)."""
        return self.response.voltage

    @property
    def current(self) -> Array:
        """Current [A] (m,)."""
        return self.response.current

    @property
    def energy(self) -> float:
        """Energy delivered [J]."""
        return float(self.response.energy[-1])

    @property
    def error(self) -> Array:
        """Path less output (m,) [m] or [N]."""
        return np.asarray(self.path - self.output)

    @property
    def rms(self) -> float:
        """Root mean square of the error over time [m] or [N]."""
        return float(np.sqrt(np.trapezoid(self.error**2, self.time) / (self.time[-1] - self.time[0])))

    @property
    def size(self) -> float:
        """Largest displacement [m] or force [N] that the path asks for."""
        return float(np.abs(self.path).max())

    @property
    def followed(self) -> bool:
        """Whether the error stays within 1 % of the path's largest value."""
        return bool(np.abs(self.error).max() <= FOLLOWED * self.size)

    def table(self) -> tuple[Column, ...]:
        """Return time, path, what follows it, voltage, current and the standard error of what follows (m,)."""
        errors = () if self.stderr is None else (Column(f"{self.quantity}_stderr", self.stderr, self.unit),)
        return (
            Column("time", self.time, "s", over=True),
            Column("path", self.path, self.unit),
            Column(self.quantity, self.output, self.unit),
            Column("voltage", self.voltage, "V"),
            Column("current", self.current, "A"),
            *errors,
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the voltage, the errors and the limits as plain data; waveforms are lists by header."""
        return {
            "actuator": self.actuator.name,
            "path": self.path_text,
            "quantity": self.quantity,
            "unit": self.unit,
            "followed": self.followed,
            "error_largest": float(np.abs(self.error).max()),
            "error_rms": self.rms,
            "limits": vars(self.limits),
            "at_limit": self.at_limit,
            "energy": self.energy,
            "reach": self.reach,
            "rate": self.rate,
            "path_largest": self.size,
            "path_rate": path_rate(self),
            "bound": self.bound,
            "engine": self.response.engine,
            "waveforms": {column.header: plain(np.asarray(column.values)) for column in self.table()},
            "findings": [finding.to_dict() for finding in self.findings],
        }


def path_rate(tracked: Tracked) -> float:
    """Return the largest rate that the path asks for between samples [m/s] or [N/s]."""
    return float(np.abs(np.diff(tracked.path) / np.diff(tracked.time)).max())


def track(
    actuator: Actuator,
    path: Drive,
    duration: float,
    limits: Limits,
    *,
    quantity: str = "displacement",
    nodes: int = NODES,
    beam: str | None = None,
    load: Load | None = None,
    band: bool = False,
    engine: str = "exact",
) -> Tracked:
    """Return the voltage through ``nodes`` whose ``quantity`` is nearest to ``path`` over ``duration`` [s].

    It is the displacement [m] of the free tip, or the force [N] of the clamped one. ``engine`` simulates the answer,
    and a nonlinear strip in each of its steps. Raises InputError for values out of range, SolveError where no voltage
    keeps the limits.
    """
    require_path(limits, nodes, duration)
    unit_of(quantity)
    if load and quantity == "force":
        raise InputError(f"the force is that of a clamped tip, which moves no load; leave {argument('load')} out")
    plant = plants_of(actuator, beam=beam, load=load, quantity=quantity)[0]
    at = np.linspace(0.0, duration, nodes)
    fine = np.linspace(0.0, duration, 2 * nodes - 1)
    wanted = path.value(fine)
    mounted: dict[str, Any] = {"tip": TIPS[quantity], "beam": beam, "load": load}
    line, _ = line_of(actuator, transient_band(fine), None, limits.voltage)
    net = strip_netlist(actuator, **mounted, band=transient_band(fine), **line)
    system = state_space([net.linearised()])
    about = answers(system, at, quantity)
    how = {**mounted, "engine": engine}

    def run(values: Array) -> Response:
        drive = PiecewiseLinear(at, values, f"voltage for {path.text}")
        return simulate(actuator, drive, fine, **how)

    values = nearest_voltage(about, wanted, at, limits)
    response = run(values)
    if not net.linear:

        def seen(response: Response) -> tuple[Array, Array]:
            return response.waveforms[quantity], response.current[::2]

        values, response = newton(values, response, about, wanted, at, limits, run, seen)
    drive = response.drive
    assert isinstance(drive, PiecewiseLinear)
    reach = abs(plant.gain) * limits.voltage
    size = float(np.abs(wanted).max())
    tracked = Tracked(
        actuator=actuator,
        path_text=path.text,
        path=wanted,
        drive=drive,
        limits=limits,
        response=response,
        at_limit=float(touched(values, response.current[::2], at, limits).mean()),
        reach=reach,
        rate=float(largest_rates(plant.a, limits.voltage * plant.b[:, None], plant.c[None])[0]),
        bound=fastest_settling(plant, size, limits.voltage) if 0 < size <= reach else None,
        stderr=prediction_band(actuator, drive, fine, misfit=False, **how).stderr[quantity] if band else None,
        quantity=quantity,
    )
    return replace(tracked, findings=(*drive_findings(path), *_findings(tracked)))


def newton(
    values: Array,
    response: Response,
    about: Answers,
    wanted: Array,
    at: Array,
    limits: Limits | Sequence[Limits],
    run: Callable[[Array], Response],
    seen: Callable[[Response], tuple[Array, Array]],
    **how: float,
) -> tuple[Array, Response]:
    """Return the voltages and the run of a nonlinear strip: steps of Gauss and Newton about its own runs.

    The step responses stay those about rest; what the strip adds to them is taken from its run, of which ``seen`` gives
    the outputs and currents as `Answers` has them. ``how`` is for `nearest_voltage`.
    """
    volt = min(of.voltage for of in ([limits] if isinstance(limits, Limits) else limits))
    for _ in range(_STEPS):
        output, flowing = seen(response)
        about = replace(
            about,
            offset=output - about.output @ values,
            flowing=flowing - about.current @ values,
            spent=float(response.energy[-1] - values @ about.energy @ values),
        )
        found = nearest_voltage(about, wanted, at, limits, **how)
        moved = float(np.abs(found - values).max())
        values, response = found, run(found)
        if moved <= _SAME * volt:
            return values, response
    raise SolveError(
        f"the nonlinear strip's voltage still moves by {moved:.2g} V after {_STEPS} steps; use fewer nodes"
    )


def require_path(limits: Limits, nodes: int, duration: float) -> None:
    """Raise InputError for limits, nodes or a duration that make no sense."""
    for name, unit in (("voltage", "V"), ("slew", "V/s"), ("current", "A"), ("energy", "J")):
        value = getattr(limits, name)
        if value is not None and not (np.isfinite(value) and value > 0):
            raise InputError(f"{argument(name)} is {value:g} {unit}; it must be more than zero")
    if not 4 <= nodes <= MOST_NODES:
        raise InputError(f"{argument('nodes')} is {nodes}; give 4 to {MOST_NODES}")
    if not (np.isfinite(duration) and duration > 0):
        raise InputError(f"{argument('duration')} {duration:g} s must be more than zero")


def touched(values: Array, current: Array, at: Array, limits: Limits) -> NDArray[np.bool_]:
    """Return whether a limit is reached at each node (n,), of a voltage and a current there."""
    found: NDArray[np.bool_] = np.abs(values) >= limits.voltage * (1 - _AT)
    if limits.slew is not None:
        rates = np.abs(np.diff(values, prepend=values[0])) / (at[1] - at[0])
        found |= rates >= limits.slew * (1 - _AT)
    if limits.current is not None:
        found |= np.abs(current) >= limits.current * (1 - _AT)
    return found


def largest_rates(a: Array, b: Array, c: Array) -> Array:
    """Return the largest rate of each output (T,) that steps of all inputs, 1 or -1, give: answers to impulses.

    b is (s, inputs), c is (T, s).
    """
    rates = speeds(a)
    most, scales = np.zeros(len(c)), 1 + int(np.ceil(np.log10(rates.max() / rates.min())))
    for rate in np.geomspace(rates.min(), rates.max(), scales):
        moved, state = expm(a * (_LONG / rate / _FINE)), b
        for _ in range(_FINE):
            most = np.maximum(most, np.abs(c @ state).sum(axis=1))
            state = moved @ state
    return most


def _findings(tracked: Tracked) -> tuple[Finding, ...]:
    """Return what the voltage should be known for."""
    found, unit = [], {"unit": tracked.unit}
    if tracked.size > tracked.reach:
        values = {**unit, "size": tracked.size, "reach": tracked.reach, "voltage": tracked.limits.voltage}
        found.append(Finding("path-too-far", values=values))
    if not tracked.followed:
        worst = float(np.abs(tracked.error).max())
        values = {**unit, "error": worst, "share": worst / max(tracked.size, 1e-300), "limited": tracked.at_limit}
        found.append(Finding("path-not-followed", values=values))
    return tuple(found)
