"""Nonlinear strips solved without any circuit, beside `strip_equations`: what stated errors are measured against.

They are integrated by scipy's DOP853, from one corner of the drive or zero of a branch's charge to the next.
"""

from __future__ import annotations

import math
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq
from strip_equations import Run, linear_reference, lines_of, lumped, modes_of

from ilg_circuit.drive import PiecewiseLinear, Sine

#: Tolerance of an integration in time.
_RTOL = 2e-13
#: Fewest steps of a piece, between which values are interpolated.
_FEWEST = 50


def nonlinear_reference(run: Run) -> dict[str, Any]:
    """The same of a strip with a sinh electron path or growing capacitances (R-C branches), or sinh without Re."""
    given = run.strip.material.electrical_constants()
    if {"diffusion_time", "cpe_exponent"} & set(given):
        return _beside_sinh(run, float(given["emission_voltage"]))
    e = lumped(run, float)
    equations = _Equations(run, e)
    t = np.asarray(run.times, dtype=float)
    found = np.zeros((3, len(t)))
    x = np.zeros(equations.size)
    if isinstance(run.drive, Sine):
        omega, size = 2 * math.pi * run.drive.frequency, run.drive.amplitude
        pieces: list[Any] = [(0.0, np.inf, lambda s: size * math.sin(omega * s))]
    else:
        assert isinstance(run.drive, PiecewiseLinear)
        pieces = [(a, b, partial(_line, a, float(u), float(v))) for a, b, u, v in lines_of(run.drive, float(t[-1]))]
    for begin, end, u in pieces:
        stop = min(end, float(t[-1]))
        inside = np.flatnonzero((t >= begin) & ((t < end) if np.isfinite(end) else True))
        for k in inside[t[inside] == begin]:
            found[:, k] = equations.outputs(begin, x, u)
        at = begin
        while at < stop:
            at, x = _integrated(equations, u, at, stop, x, t, inside, found)
    return dict(zip(("current", "displacement", "energy"), found, strict=True))


def _integrated(
    equations: _Equations, u: Any, at: float, stop: float, x: Any, t: Any, inside: Any, found: Any
) -> tuple[float, Any]:
    """Integrate to ``stop`` or to the first zero of a charge; the end and the states there."""
    count = equations.count if equations.slope else 0
    longest, sizes = (stop - at) / _FEWEST, equations.scale * 1e-13
    solver = DOP853(partial(equations.rates, u=u), at, x, stop, rtol=_RTOL, atol=sizes, max_step=longest)
    while solver.status == "running":
        message = solver.step()
        if solver.status == "failed":
            raise RuntimeError(message)
        dense, now, y = solver.dense_output(), solver.t, solver.y.copy()
        before = dense(solver.t_old)[:count] if solver.t_old > at else x[:count]
        crossed = [
            (brentq(lambda s, k=k, of=dense: of(s)[k], solver.t_old, now, xtol=1e-16, rtol=1e-15), k)
            for k in np.flatnonzero(before * y[:count] < 0)
        ]
        if crossed:
            now, k = min(crossed)
            y = dense(now)
            y[k] = 0.0
        for j in inside[(t[inside] > solver.t_old) & (t[inside] <= now)]:
            found[:, j] = equations.outputs(float(t[j]), dense(t[j]), u)
        if crossed:
            return now, y
    return stop, solver.y.copy()


def _line(begin: float, value: float, slope: float, t: float) -> float:
    return value + slope * (t - begin)


class _Equations:
    """Charges of the branches, filters, beam and energy as states; the node behind Re by Newton's method."""

    def __init__(self, run: Run, e: dict[str, Any]) -> None:
        given = e["constants"]
        self.vt, self.slope = given.get("emission_voltage"), given.get("capacitance_slope", 0.0)
        self.run, self.e, self.r, self.c = run, e, *np.array(e["branches"]).T
        self.count = len(self.r)
        self.coupled = run.strip.coupling is not None
        self.dynamic = run.beam == "dynamic" and self.coupled
        self.size = self.count + 2 * self.coupled + 2 * (self.dynamic and run.tip == "free")
        self.size += (2 + self.count - 1) * self.dynamic + 1
        top = run.drive.largest()
        scales = [*(self.c * top)]
        gain = 0.0
        if self.coupled:
            k = run.strip.coupling
            assert k is not None
            self.wn, self.zeta, self.zd = k.natural_frequency, k.damping_ratio, k.zero
            self.gain = gain = e["ratio"] * k.gain * self.zd / self.wn**2
            scales += [top, top * self.wn]
        if self.dynamic:
            moved = gain * top
            if run.tip == "free":
                scales += [moved, moved * self.wn]
            force = e["k"] * moved
            scales += [force, force * self.wn, *([gain * force] * (self.count - 1))]
        scales.append(top**2 * sum(self.c))
        self.scale = np.array(scales)
        self.guess = 0.0

    def voltages(self, q: Any) -> Any:
        return 2 * q / self.c / (1 + np.sqrt(1 + 2 * self.slope * np.abs(q) / self.c))

    def solve(self, t: float, x: Any, u: Any) -> tuple[Any, float, float, Any]:
        """Rates of the states, current, displacement."""
        n, e, rates = self.count, self.e, np.zeros(self.size)
        q, u1, y = x[:n], 0.0, 0.0
        if self.coupled:
            d1, d2 = x[n], x[n + 1]
            free = self.gain * (d1 + d2 / self.zd)
            y = free * e["k"] / (e["k"] + e["spring"])  # of a beam without inertia
            if self.run.tip == "clamped":
                y = 0.0
        at = n + 2 * self.coupled
        if self.dynamic:
            if self.run.tip == "free":
                y, speed = x[at], x[at + 1]
                force = e["k"] * (free - y)
                rates[at], rates[at + 1] = speed, (force - e["damping"] * speed - e["spring"] * y) / e["mass"]
                at += 2
            else:
                force = e["k"] * free
            w1, w2 = x[at], x[at + 1]
            rates[at], rates[at + 1] = w2, self.wn**2 * (force - w1) - 2 * self.zeta * self.wn * w2
            charge, current = self.gain * (w1 + w2 / self.zd), self.gain * (w2 + rates[at + 1] / self.zd)
            at += 2
            p = np.append(x[at : at + n - 1], charge - x[at : at + n - 1].sum())
            u1 = float((current + (p / (self.r * self.c)).sum()) / (1 / self.r).sum())
            rates[at : at + n - 1] = ((u1 - p / self.c) / self.r)[:-1]
        v_k = self.voltages(q) + u1
        terminal = u(t)
        v = self.node(terminal, float((v_k / self.r).sum()), float((1 / self.r).sum()))
        rates[:n] = (v - v_k) / self.r
        total = self.electrons(v) + float(rates[:n].sum())
        if self.coupled:
            rates[n], rates[n + 1] = d2, self.wn**2 * (v - u1 - d1) - 2 * self.zeta * self.wn * d2
        rates[-1] = terminal * total
        return rates, total, y, None

    def electrons(self, v: float) -> float:
        if self.vt is None:
            return float(v / self.e["dc"])
        return float(self.vt / self.e["dc"] * math.sinh(v / self.vt))

    def node(self, terminal: float, driven: float, conductance: float) -> float:
        re = self.e["re"]
        if not re:
            return terminal
        a, b = terminal / re + driven, 1 / re + conductance
        if self.vt is None:
            return float(a / (b + 1 / self.e["dc"]))
        v, scale = self.guess, self.vt / self.e["dc"]
        for _ in range(60):
            step = (b * v + scale * math.sinh(v / self.vt) - a) / (b + math.cosh(v / self.vt) / self.e["dc"])
            v -= max(-self.vt, min(self.vt, step))
            if abs(step) <= 1e-15 * abs(v):
                break
        else:
            v = brentq(lambda x: b * x + scale * math.sinh(x / self.vt) - a, -abs(a / b), abs(a / b), xtol=1e-16)
        self.guess = float(v)
        return self.guess

    def rates(self, t: float, x: Any, u: Any) -> Any:
        return self.solve(t, x, u)[0]

    def outputs(self, t: float, x: Any, u: Any) -> list[float]:
        _, current, y, _ = self.solve(t, x, u)
        return [current, y, float(x[-1])]


def _beside_sinh(run: Run, vt: float) -> dict[str, Any]:
    """An ion path without Re is not touched by its electron path: linear modes beside Is sinh(u/Vt)."""
    assert not lumped(run, float)["re"]
    found = linear_reference(run, modes_of(run, electrons=False))
    scale = vt / lumped(run, float)["dc"]
    t = np.asarray(run.times, dtype=float)
    found["current"] = found["current"] + scale * np.sinh(run.drive.value(t) / vt)
    bounds = np.unique(np.concatenate([[0.0], run.drive.breakpoints(float(t[-1])), t]))
    if omega := run.drive.angular_frequency():
        more = np.arange(0, float(t[-1]), 0.3 / omega)
        bounds = np.union1d(bounds, more)
    parts = np.concatenate([np.linspace(a, b, 5)[:-1] for a, b in pairwise(bounds)] + [bounds[-1:]])
    x, w = np.polynomial.legendre.leggauss(10)
    widths = np.diff(parts)[:, None]
    u = run.drive.value(parts[:-1, None] + widths * (x + 1) / 2)
    work = np.append(0.0, np.cumsum((scale * u * np.sinh(u / vt) * w * widths / 2).sum(axis=1)))
    found["energy"] = found["energy"] + work[np.searchsorted(parts, t)]
    return found
