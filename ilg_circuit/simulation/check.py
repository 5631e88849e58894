"""Compares independent solutions: ngspice, the exact solver, and the papers' closed forms where one exists."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array, ComplexArray
from ..circuit.load import Load
from ..drive import Drive, by_current, voltage_limit
from ..errors import InputError, SolveError, warn
from ..solve.library import available, install_hint
from ..strip.couplings import Coupling
from ..strip.elements import lumped_elements, lumped_port
from . import closed_forms as formulas
from .impedance import Impedance, impedance
from .response import Response, simulate, transient_band
from .superposition import superpose
from .waveforms import answers

#: Largest difference of two solutions that agree, relative to the maximum.
AGREEMENT = 1e-5
#: Displacement of the dynamic beam, relative to the static one, below which it is rounding of a difference.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Difference:
    """The largest difference of one quantity between two solutions, relative to the reference's largest value."""

    quantity: str
    reference: str
    value: float

    @property
    def agrees(self) -> bool:
        return self.value <= AGREEMENT


def check(response: Response, *, tip: str, beam: str | None = None, load: Load | None = None) -> list[Difference]:
    """Return the differences of a response from the other engine, if it is there, and from the closed forms.

    A circuit with nonlinear elements, or a source with a limit, has neither: its current (under a current its voltage)
    is compared with an integration of the port's own differential equations (`ilg_circuit.solve.ode`).
    """
    line = response.actuator.electrodes is not None
    if not response.netlist.linear or voltage_limit(response.drive) is not None:
        if line:
            raise InputError("a nonlinear strip with [electrodes] has no second solution; leave the check out")
        return _check_port(response)
    how: dict[str, Any] = {"tip": tip, "beam": beam, "load": load, "wires": response.wires}
    again = {
        other: simulate(response.actuator, response.drive, response.time, engine=other, **how)
        for other in _others(response.engine)
    }
    lumped = lumped_elements(response.actuator)
    # the static displacement under the largest voltage
    static = lumped.bending_ratio * lumped.coupling.static if lumped.coupling is not None else 0.0
    floors = {"displacement": _ROUNDING * float(static * np.abs(response.voltage).max())}
    found = response.waveforms
    rows = [
        Difference(
            w.name, f"{other} engine", _difference(found[w.name], run.waveforms[w.name], floors.get(w.name, 0.0))
        )
        for other, run in again.items()
        for w in answers(response.drive)
        if not np.isnan(found[w.name]).any()
    ]
    if line:  # whose closed forms are those of a frequency
        return rows
    for name, values in closed_forms(response, tip=tip, beam=None if load else beam).items():
        rows.append(Difference(name, "closed form", _difference(found[name], values)))
    return rows


def _others(engine: str) -> list[str]:
    """Return the other engine; none, with a warning, where that is ngspice and its library is missing."""
    if engine == "ngspice":
        return ["exact"]
    if available():
        return ["ngspice"]
    warn(f"not compared with ngspice: {install_hint()}")
    return []


def _check_port(response: Response) -> list[Difference]:
    from ..solve.ode import port_response

    port = lumped_port(response.actuator, transient_band(response.time))
    answer = "voltage" if by_current(response.drive) else "current"
    values, charge = port_response(port, response.drive, response.time)
    return [
        Difference(answer, "port's equations", _difference(response.waveforms[answer], values)),
        Difference("charge", "port's equations", _difference(response.charge, charge)),
    ]


def check_impedance(result: Impedance, **how: Any) -> list[Difference]:
    """Return the differences of an impedance from the other engine's, and from EC (1) and (17) solved for it.

    The other engine reads the same netlist, so that they agree up to rounding. The closed form has the elements of the
    ladder, if there is one, and includes the reflected impedance. ``how``: as for `impedance`.
    """
    rows = []
    for other in _others(result.engine):
        again = impedance(result.actuator, result.frequency, engine=other, segment=result.segment, **how)
        rows.append(Difference("impedance", f"{other} engine", _largest(result.impedance, again.impedance)))
    line = result.actuator.electrodes is not None
    closed = result.port if line else _with_motion(result, **how)
    return [*rows, Difference("impedance", "its nodes" if line else "closed form", _largest(result.impedance, closed))]


def _with_motion(
    result: Impedance, *, tip: str = "free", beam: str | None = None, load: Load | None = None, bias: float = 0.0
) -> ComplexArray:
    """Return Z = Re + Rdc || (Zp + N^2 Zm1 Z_tip/(Zm1 + Z_tip)) [ohm]; with a bias one of the N keeps Zp of 0 V."""
    low, high = float(result.frequency.min()), float(result.frequency.max())
    hung = load.mass if load is not None else 0.0
    lumped = lumped_elements(result.actuator, (low * 0.999, high * 1.001), hung)
    if result.actuator.beam(beam, loaded=bool(load)) == "static" or lumped.coupling is None:
        return result.port
    s = 2j * np.pi * result.frequency
    compliance = lumped.stiffness / s
    series = lumped.mass * s + lumped.damping
    if load is not None:
        series = series + load.mass * s + load.damping + load.stiffness / s
    series = series + lumped.gravity / s
    mechanical = compliance if tip == "clamped" else compliance * series / (compliance + series)
    small = lumped.port.linearised(lumped.port.inner_voltage(bias))
    ion = small.ion_impedance(s)
    # N at rest, and N of the biased ions, whose share of Zp differs
    factor = np.array([lumped.coupling_factor(x) for x in s])
    reflected = factor**2 * (ion / lumped.port.ion_impedance(s)) * mechanical
    return np.asarray(lumped.port.electrode_resistance + 1 / (1 / small.dc_resistance + 1 / (ion + reflected)))


def _largest(values: ComplexArray, reference: ComplexArray) -> float:
    """Return the largest difference relative to each value's own size."""
    return float((np.abs(values - reference) / np.abs(reference)).max())


def require_agreement(differences: Sequence[Difference]) -> None:
    """Raise SolveError naming the worst disagreement, if there is one."""
    worst = max(differences, key=lambda d: d.value)
    if not worst.agrees:
        raise SolveError(
            f"check failed: {worst.quantity} differs from the {worst.reference} by {worst.value:.1e} of its maximum "
            f"(allowed: {AGREEMENT:g})"
        )


def closed_forms(response: Response, *, tip: str, beam: str | None = None) -> dict[str, Array]:
    """Return the papers' closed forms at the response's times, for those quantities that have one.

    Current: one ionic branch, or several without electrode resistance, for a beam that reflects nothing (the dynamic
    beam's reflected voltage is compared too: it must be negligible, EC (20), (21)). Displacement and clamped force: EC
    (34), static beam, no electrode resistance, so that the port has the source's voltage.
    """
    forms: dict[str, Array] = {}
    if response.actuator.beam(beam) != "static" or voltage_limit(response.drive) is not None:
        return forms
    if by_current(response.drive):
        return _closed_by_current(response, tip)
    lumped, drive, t = lumped_elements(response.actuator), response.drive, response.time
    port, coupling = lumped.port, lumped.coupling
    if port.linear and (len(port.branches) == 1 or (port.branches and not port.electrode_resistance)):
        constants = [
            formulas.current_constants(port.dc_resistance, r, c, port.electrode_resistance) for r, c in port.branches
        ]
        # with several branches the electron path, in every part's a0, counts once
        parts = [(0.0 if k else a0, a1, rate) for k, (a0, a1, rate) in enumerate(constants)]
        forms["current"] = _superposed("current", drive, t, parts)
    if isinstance(coupling, Coupling) and not port.electrode_resistance:  # whatever the ion path is
        c = coupling
        motion = (c.gain, c.zero, c.damping_ratio, c.natural_frequency, lumped.bending_ratio)
        free = _superposed("displacement", drive, t, [motion])
        forms |= {"displacement": free * lumped.hanging_share} if tip == "free" else {"force": free * lumped.stiffness}
    return forms


def _closed_by_current(response: Response, tip: str) -> dict[str, Array]:
    """Return voltage, displacement and clamped force under a current, for a port of one ionic branch.

    The motion under a sine has none.
    """
    lumped, drive, t = lumped_elements(response.actuator), response.drive, response.time
    port, c = lumped.port, lumped.coupling
    if not port.linear or len(port.branches) != 1:
        return {}
    whole, inner = (
        formulas.voltage_constants(port.dc_resistance, *port.branches[0], electrodes)
        for electrodes in (port.electrode_resistance, 0.0)
    )
    forms = {"voltage": _superposed("current", drive, t, [whole])}
    if not isinstance(c, Coupling) or drive.angular_frequency():
        return forms
    motion = (c.gain, c.zero, c.damping_ratio, c.natural_frequency, lumped.bending_ratio, *inner)
    free = _superposed("moved", drive, t, [motion])
    return forms | (
        {"displacement": free * lumped.hanging_share} if tip == "free" else {"force": free * lumped.stiffness}
    )


def _superposed(quantity: str, drive: Drive, t: Array, parts: Sequence[tuple[float, ...]]) -> Array:
    """Return a quantity under ``drive``: the sum of its closed form over sets of constants."""

    def total(kind: str, time: Array, *more: float) -> Array:
        form = getattr(formulas, f"{quantity}_{kind}")
        return np.asarray(sum(form(time, *part, *more) for part in parts))

    return superpose(drive, t, total)


def _difference(values: Array, reference: Array, floor: float = 0.0) -> float:
    scale = max(float(np.abs(reference).max()), floor)
    return float(np.abs(values - reference).max() / scale) if scale else float(np.abs(values).max())
