"""The strip's equations EC (10)-(17) solved without any circuit: what stated errors are measured against.

Linear strips are sums of modes. Those of R-C branches are found with thirty digits by mpmath and summed with eighteen;
an element of diffusion or constant phase is taken as its integral of relaxations, several times finer and many decades
wider than any ladder. Nonlinear ones are solved in `nonlinear_equations`.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import Any

import mpmath
import numpy as np

from ilg_circuit.circuit import Load
from ilg_circuit.drive import Drive, PiecewiseLinear, Sine
from ilg_circuit.strip.actuator import Actuator

GAMMA, GRAVITY = "1.875104068711961", "9.80665"
#: Panels of ln(lambda) in an integral of relaxations: where its density is smooth, and where it has peaks.
_PANEL, _NARROW = 2.0, 0.25
#: Modes of a finite Warburg element that are taken one by one.
_DISCRETE = 100
#: Relaxations up to so many a run are sections, faster ones a resistor; and for displacements, which those hardly
#: change, but to which the rounding of so many modes adds as much as 1e-4.
_FASTEST, _FASTEST_MOVING = 1e10, 1e7


@dataclass(frozen=True)
class Run:
    """One run of a strip: ``tip``, ``beam`` and ``load`` as for `simulate`."""

    strip: Actuator
    drive: Drive
    times: Any
    tip: str = "free"
    beam: str = "dynamic"
    load: Load | None = None


@dataclass(frozen=True)
class Ions:
    """An ion path: parallel (R, C) branches, or ``series`` [ohm] and (R, C) sections behind one ``capacitor`` [F].

    ``series`` stands for relaxations too that are faster than any sample; without these it is ``at_once``.
    """

    pairs: tuple[tuple[Any, Any], ...]
    series: Any = None
    capacitor: Any = None
    at_once: Any = None


def lumped(run: Run, number: Any) -> dict[str, Any]:
    """Elements by EC (10)-(14), as numbers of a kind such as `mpmath.mpf` or `float`."""
    g, m = run.strip.geometry, run.strip.material
    length, free, width, b = (number(x) for x in (g.length, g.free_length, g.width, g.thickness))
    at = number(g.free_length if g.load_position is None else g.load_position)
    ohm, farad = b / (length * width), length * width / b
    load = run.load or Load()
    k = number(m.youngs_modulus) * width * b**3 / (4 * at**3)
    mass = 3 * free**4 * number(m.density) * width * b / (at**3 * number(GAMMA) ** 4)
    hanging = run.strip.mounting.orientation == "hanging"
    electrodes = number(m.electrode_resistivity_1) * number(m.electrode_thickness_1)
    electrodes += number(m.electrode_resistivity_2) * number(m.electrode_thickness_2)
    return {
        "dc": number(m.dc_resistivity) * ohm,
        "re": electrodes / (length * width),
        "branches": [(number(x.dynamic_resistivity) * ohm, number(x.permittivity) * farad) for x in m.branches],
        "k": k,
        "mass": mass + number(load.mass),
        "damping": 2 * number(m.beam_damping_ratio) * (k * mass) ** number("0.5") + number(load.damping),
        "spring": number(load.stiffness) + (k * number(1 / hanging_share(run) - 1) if hanging else 0),
        "ratio": 3 * at**2 / b**2,
        "constants": {name: number(x) for name, x in m.electrical_constants().items()},
        "ohm": ohm,
    }


def hanging_share(run: Run) -> mpmath.mpf:
    """Share of its free deflection at the load that its own and the load's weight leave a strip that hangs.

    The slope of EI (y'' - k0)'' = (T y')' is a sum of Airy's functions of the way up, in units of (EI/(mu g))^(1/3).
    """
    number, g, m = mpmath.mpf, run.strip.geometry, run.strip.material
    free, at = number(g.free_length), number(g.free_length if g.load_position is None else g.load_position)
    weight = number(m.density) * g.width * g.thickness * number(GRAVITY)  # [N/m]
    load = number((run.load or Load()).mass) * number(GRAVITY)
    bending = number(m.youngs_modulus) * g.width * number(g.thickness) ** 3 / 12
    unit = (bending / weight) ** (number(1) / 3)

    def up(x: Any) -> Any:
        return (free - x + load / weight) / unit

    airy = mpmath.airyai, mpmath.airybi
    clamp = [f(up(0)) for f in airy]
    bent = [f(up(free), derivative=1) for f in airy]
    amounts = [clamp[1], -clamp[0]]  # no slope at the clamp
    curvature = -sum(a * d for a, d in zip(amounts, bent, strict=True)) / unit
    x, w = np.polynomial.legendre.leggauss(12)
    edges = [at * (1 - number(2) ** -k) for k in range(40)] + [at]
    total = number(0)
    for left, right in itertools.pairwise(edges):
        half = (right - left) / 2
        slopes = [sum(a * f(up(left + half * (1 + p))) for a, f in zip(amounts, airy, strict=True)) for p in x.tolist()]
        total += half * sum(v * s for v, s in zip(w.tolist(), slopes, strict=True))
    return total / (curvature * at**2 / 2)


def ion_path(e: dict[str, Any], end: float, most: float = _FASTEST) -> Ions:
    """The ion path; an integral of relaxations fine enough for a run of ``end`` [s], up to so many a run."""
    given, (rs, farad) = e["constants"], e["branches"][0]
    if "interface_time" in given:
        tau, a = given["diffusion_time"], given["diffusion_exponent"]
        rw, r = tau / farad, given["interface_resistivity"] * e["ohm"]
        t, alpha = given["interface_time"], given["interface_exponent"]

        def randles(x: Any) -> Any:
            arc, diffusion = (x * t) ** alpha, (x * tau) ** a
            return r / (1 + arc) + rw * (1 + np.exp(-2 * diffusion)) / -np.expm1(-2 * diffusion) / diffusion

        return _integral(rs, randles, end, most, fine=(1.0 / tau, 3e3 / tau))
    if "diffusion_time" in given:
        return _warburg(rs, given["diffusion_time"], farad, end, most)
    if "cpe_exponent" in given:
        return _integral(rs, lambda x: x ** -given["cpe_exponent"] / farad, end, most)
    return Ions(tuple(e["branches"]))


def _warburg(rs: float, tau: float, farad: float, end: float, most: float) -> Ions:
    """Rw coth(x)/x, x = sqrt(s tau): a capacitor and modes k of rate (k pi)^2/tau, beyond some a continuum of k."""
    x, w = np.polynomial.legendre.leggauss(6)
    last = max(math.sqrt(most * tau / end) / np.pi, _DISCRETE)
    edges = (_DISCRETE + 0.5) * 2.0 ** np.arange(math.ceil(math.log2(last / _DISCRETE)) + 1)
    k = (edges[:-1, None] + np.diff(edges)[:, None] * (x + 1) / 2).ravel()
    counts = (np.diff(edges)[:, None] * w / 2).ravel()
    numbers = np.append(np.arange(1, _DISCRETE + 1), k)
    counts = np.append(np.ones(_DISCRETE), counts)
    rates = (numbers * np.pi) ** 2 / tau
    capacitances = farad / (2 * counts)
    above = 2 * tau / farad / (np.pi**2 * edges[-1])
    return Ions(_descending(1 / (rates * capacitances), capacitances), rs + above, farad, rs)


def _descending(r: Any, c: Any) -> tuple[tuple[float, float], ...]:
    """Pairs with the fastest first: eigenvalues of a graded matrix are good to their own digits in this order."""
    order = np.argsort(r * c)
    return tuple(zip(r[order], c[order], strict=True))


def _integral(rs: float, z: Any, end: float, most: float, fine: tuple[float, float] | None = None) -> Ions:
    """Z(s) = integral of w/(s + lambda) over lambda, w = -Im Z(-lambda + i0)/pi, on panels of ln(lambda).

    Panels have eight points each; they are narrow between the rates ``fine``, where the density has peaks.
    """
    edges = np.arange(math.log(1e-7 / end), math.log(most / end), _PANEL)
    if fine is not None:
        first, last = (int(np.searchsorted(edges, math.log(f))) for f in fine)
        narrow = np.arange(edges[first - 1], edges[last], _NARROW)
        edges = np.concatenate([edges[: first - 1], narrow, edges[last:]])
    x, w = np.polynomial.legendre.leggauss(8)
    widths = np.diff(edges)[:, None]
    nodes, steps = (edges[:-1, None] + widths * (x + 1) / 2).ravel(), (widths * w / 2).ravel()

    def density(log: Any) -> Any:
        rates = np.exp(log)
        return -z(-rates + 0j).imag / np.pi * rates

    rates, weights = np.exp(nodes), density(nodes) * steps
    # what is below is one capacitor, what is above one resistor: both are powers there
    low, high = density(edges[0] + np.array([0.0, 0.1])), density(edges[-1] - np.array([0.0, 0.1]))
    elastance = low[0] / (np.log(low[1] / low[0]) / 0.1)
    resistance = high[0] / np.exp(edges[-1]) / (1 - np.log(high[0] / high[1]) / 0.1)
    return Ions(_descending(weights / rates, 1 / weights), rs + resistance, 1 / elastance, rs)


def linear_system(run: Run, e: dict[str, Any], ions: Ions, dtype: Any) -> tuple[Any, Any, Any, Any]:
    """A (n, n), B (n,) of x' = A x + B u, and rows C (2, n), D (2,) of current and displacement."""
    pairs, coupling, c = ions.pairs, run.strip.coupling, e["constants"]
    inductance = c.get("inductance")
    parallel = ions.series is None
    count = len(pairs)
    dynamic = run.beam == "dynamic" and coupling is not None
    sizes = {"ion": count + (not parallel), "lead": bool(inductance), "d": 2 * (coupling is not None)}
    sizes |= {"tip": 2 * (dynamic and run.tip == "free"), "s": 2 * dynamic, "copy": (count - parallel) * dynamic}
    first = dict(zip(sizes, np.cumsum([0, *sizes.values()])[:-1].tolist(), strict=True))
    n = sum(sizes.values())
    zero, one = dtype(0), dtype(1)

    def row(at: int | None = None) -> Any:
        made = np.full(n + 1, zero)
        if at is not None:
            made[at] = one
        return made

    state = {name: [row(first[name] + j) for j in range(size)] for name, size in sizes.items()}
    u, rates = row(n), [row() for _ in range(n)]
    # the ion path's voltage is hold i1 + rest(charges or voltages)
    conductance = sum((1 / r for r, _ in pairs), zero) if parallel else zero
    hold = 1 / conductance if parallel else ions.series

    def rest(of: Any) -> Any:
        if parallel:
            return sum((q / (r * cap) for q, (r, cap) in zip(of, pairs, strict=True)), row()) / conductance
        return sum(of, row())

    u1, motion, y1 = row(), row(), row()
    if coupling is not None:
        wn, zeta, zd = (dtype(getattr(coupling, x)) for x in ("natural_frequency", "damping_ratio", "zero"))
        gain = e["ratio"] * dtype(coupling.gain) * zd / wn**2
        x1, x2 = state["d"]
        y1 = gain * (x1 + x2 / zd)
        motion = y1 * (e["k"] / (e["k"] + e["spring"])) if run.tip == "free" else row()  # of a beam without inertia
    if dynamic:
        tip = state["tip"][0] if run.tip == "free" else row()
        force = e["k"] * (y1 - tip)
        if run.tip == "free":
            at = first["tip"]
            rates[at] = state["tip"][1]
            rates[at + 1] = (force - e["damping"] * state["tip"][1] - e["spring"] * tip) / e["mass"]
            motion = tip
        w1, w2 = state["s"]
        at = first["s"]
        rates[at] = w2
        rates[at + 1] = wn**2 * (force - w1) - 2 * zeta * wn * w2
        charge, current = gain * (w1 + w2 / zd), gain * (w2 + rates[at + 1] / zd)
        copies, at = state["copy"], first["copy"]
        if parallel:
            held = [*copies, charge - sum(copies, row())]
            u1 = hold * current + rest(held)
            for j in range(count - 1):
                rates[at + j] = (u1 - held[j] / pairs[j][1]) / pairs[j][0]
        else:
            u1 = hold * current + charge / ions.capacitor + sum(copies, row())
            for j, (r, cap) in enumerate(pairs):
                rates[at + j] = current / cap - copies[j] / (r * cap)
    behind = rest(state["ion"]) + u1
    total = 1 / e["dc"] + 1 / hold if e["dc"] else 1 / hold
    if inductance:
        through = state["lead"][0]
        v = (through + behind / hold) / total
        rates[first["lead"]] = (u - e["re"] * through - v) / inductance
    elif e["re"]:
        v = (u / e["re"] + behind / hold) / (1 / e["re"] + total)
        through = (u - v) / e["re"]
    else:
        v = u
        through = total * u - behind / hold
    i1, across = (v - behind) / hold, v - u1
    at = first["ion"]
    if parallel:
        for j, (r, cap) in enumerate(pairs):
            rates[at + j] = (across - state["ion"][j] / cap) / r
    else:
        for j, (r, cap) in enumerate(pairs):
            rates[at + j] = i1 / cap - state["ion"][j] / (r * cap)
        rates[at + count] = i1 / ions.capacitor
    if coupling is not None:
        at = first["d"]
        rates[at] = x2
        rates[at + 1] = wn**2 * (across - x1) - 2 * zeta * wn * x2
    matrix, outputs = np.array(rates).reshape(n, n + 1), np.array([through, motion])
    return matrix[:, :n], matrix[:, n], outputs[:, :n], outputs[:, n]


@dataclass(frozen=True)
class Modes:
    """Outputs of a linear strip: sum of ``amounts`` (2, m) times modes z' = pole z + u, and ``direct`` (2,) u.

    On a jump of u the outputs jump by ``at_once`` (2,).
    """

    poles: Any
    amounts: Any
    direct: Any
    at_once: Any


def modes_of(run: Run, *, electrons: bool = True) -> Modes:
    """The modes of a run's strip near 0 V; without ``electrons`` those of the ions alone, Rdc left out."""
    exact = set(run.strip.material.electrical_constants()) <= {"inductance"}
    number = mpmath.mpf if exact else float
    e = lumped(run, number)
    if not electrons:
        e["dc"] = 0
    if not exact:
        current, moving = (_rounded(run, e, most) for most in (_FASTEST, _FASTEST_MOVING))
        apart = [np.pad(current.amounts[0], (0, len(moving.poles))), np.pad(moving.amounts[1], (len(current.poles), 0))]
        direct, once = (np.array([x[0], y[1]]) for x, y in ((current.direct, moving.direct),
                                                           (current.at_once, moving.at_once)))  # fmt: skip
        return Modes(np.append(current.poles, moving.poles), np.array(apart), direct, once)
    a, b, c, d = linear_system(run, e, ion_path(e, float(run.times[-1])), number)
    with mpmath.workdps(30):
        found, vectors = mpmath.eig(mpmath.matrix(a.tolist()))
        excited = mpmath.lu_solve(vectors, mpmath.matrix(b.tolist()))
        amounts = mpmath.matrix(c.tolist()) * vectors
        made = [[amounts[i, j] * excited[j] for j in range(len(found))] for i in range(2)]
    direct = np.array([np.longdouble(str(x)) for x in d])
    return Modes(_wide(found), np.array([_wide(x) for x in made]), direct, direct)


def _rounded(run: Run, e: dict[str, Any], most: float) -> Modes:
    """The modes with an integral of relaxations up to so many (``most``) a run, found in doubles."""
    ions, wide = ion_path(e, float(run.times[-1]), most), np.clongdouble
    a, b, c, d = linear_system(run, e, ions, float)
    poles, shapes = np.linalg.eig(np.asarray(a, dtype=float))
    excited = np.linalg.solve(shapes, np.asarray(b, dtype=complex))
    amounts = (np.asarray(c, dtype=float) @ shapes) * excited
    once = linear_system(run, e, replace(ions, series=ions.at_once), float)[3]
    direct, at_once = (np.asarray(x, dtype=np.longdouble) for x in (d, once))
    return Modes(poles.astype(wide), amounts.astype(wide), direct, at_once)


def _wide(values: Any) -> Any:
    """Numbers of mpmath in numpy's eighteen digits."""
    parts = [(np.longdouble(mpmath.nstr(v.real, 22)), np.longdouble(mpmath.nstr(v.imag, 22))) for v in values]
    return np.array([x + np.clongdouble(1j) * y for x, y in parts], dtype=np.clongdouble)


def linear_reference(run: Run, modes: Modes) -> dict[str, Any]:
    """Current, displacement and energy at the run's times."""
    t = np.asarray(run.times, dtype=np.longdouble)
    if isinstance(run.drive, Sine):
        found = _under_sine(run.drive, modes, t)
    else:
        assert isinstance(run.drive, PiecewiseLinear)
        found = _underlines_of(run.drive, modes, t)
    return dict(zip(("current", "displacement", "energy"), np.asarray(found, dtype=float), strict=True))


def _under_sine(drive: Sine, modes: Modes, t: Any) -> Any:
    p, size = modes.poles, np.longdouble(drive.amplitude)
    omega = np.longdouble(drive.frequency) * 2 * np.arctan(np.longdouble(1)) * 4
    j = np.clongdouble(1j)
    gain = (modes.amounts / (j * omega - p)).sum(axis=1) + modes.direct  # Y(j omega)
    own = modes.amounts * omega / (p**2 + omega**2)
    grown = np.exp(p * t[:, None])
    steady = gain.real[:, None] * np.sin(omega * t) + gain.imag[:, None] * np.cos(omega * t)
    y = size * (steady + (own @ grown.T).real)
    up, down = (np.expm1((p + sign * j * omega) * t[:, None]) / (p + sign * j * omega) for sign in (1, -1))
    work = ((up - down) / (2 * j)) @ own[0]
    a, b = gain[0].real, gain[0].imag
    held = a * (t / 2 - np.sin(2 * omega * t) / (4 * omega)) + b * np.sin(omega * t) ** 2 / (2 * omega)
    return np.vstack([y, size**2 * (work.real + held)])


def lines_of(drive: PiecewiseLinear, end: float) -> list[tuple[float, float, float, float]]:
    """Start, end, value and slope of the straight pieces of a drive from 0 to ``end`` [s]."""
    times, values = drive.times, drive.values
    pieces = []
    if times[0] > 0:
        pieces.append((0.0, float(times[0]), float(values[0]), 0.0))
    for k in range(len(times) - 1):
        a, b = float(times[k]), float(times[k + 1])
        if b > a and b > 0:
            slope = (np.longdouble(values[k + 1]) - values[k]) / (np.longdouble(b) - a)
            value = values[k] + slope * (max(a, 0.0) - a)
            pieces.append((max(a, 0.0), b, value, slope))
    if not pieces or pieces[-1][1] <= end:
        pieces.append((max(float(times[-1]), 0.0), np.inf, float(values[-1]), 0.0))
    if drive.times[0] > 0 and len(times) > 1 and times[0] == times[1]:
        pieces[0] = (0.0, float(times[0]), float(values[0]), 0.0)
    return [p for p in pieces if p[0] <= end]


def _underlines_of(drive: PiecewiseLinear, modes: Modes, t: Any) -> Any:
    p = modes.poles
    state, work = np.zeros(len(p), dtype=np.clongdouble), np.longdouble(0)
    found = np.zeros((3, len(t)), dtype=np.longdouble)
    before = np.longdouble(0)
    for begin, end, a, b in lines_of(drive, float(t[-1])):
        r = -b / p
        q = -a / p - b / p**2
        z = state - q
        inside = (t >= begin) & (t < end)
        local = t[inside] - np.longdouble(begin)
        s = np.append(local, np.longdouble(end) - begin if np.isfinite(end) else local[-1:] if len(local) else 0)
        grown = np.expm1(p * s[:, None])
        moved = z * (grown + 1) + q + r * s[:, None]
        u = a + b * s
        y = (modes.amounts @ moved.T).real + modes.direct[:, None] * u
        mode_work = z * (a * grown / p + b * (s[:, None] * (grown + 1) / p - grown / p**2))
        mode_work = mode_work + q * (a * s + b * s**2 / 2)[:, None] + r * (a * s**2 / 2 + b * s**3 / 3)[:, None]
        e = work + (mode_work @ modes.amounts[0]).real
        e = e + modes.direct[0] * (a**2 * s + a * b * s**2 + b**2 * s**3 / 3)
        found[:2, inside], found[2, inside] = y[:, :-1], e[:-1]
        found[:2, t == begin] += ((modes.at_once - modes.direct) * (a - before))[:, None]
        state, work, before = moved[-1], e[-1], u[-1]
    return found
