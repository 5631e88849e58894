"""Finds the voltages of a strip's segments that make its shape follow a path; says how well, and what limits it.

A shape is told by its targets: the mean curvature of each segment, the angle of the free end, the displacement. With
fewer of them than segments the voltages are not determined: those of least effort are taken.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..arrays import Array
from ..circuit.load import Load
from ..circuit.strip import strip_netlist
from ..circuit.wiring import wiring
from ..drive import Drive, Drives, PiecewiseLinear, drive_findings
from ..errors import InputError, argument
from ..findings import Finding
from ..simulation.curvature import along_segments
from ..simulation.prediction_band import prediction_band
from ..simulation.response import Response, line_of, simulate, transient_band
from ..solve.balance import balanced
from ..solve.state_space import StateSpace, state_space
from ..strip.actuator import Actuator
from ..strip.cells import Layout
from .bound import fastest_shape, least_at_rest
from .loop import BAND
from .programme import EFFORT, Answers, Limits, answers, nearest_voltage
from .track import NODES, largest_rates, newton, require_path, touched
from .tracked_shape import TrackedShape, currents_of, farthest_of, output_of, sizes_of

#: Most values of all voltages together.
MOST_VALUES = 4004
#: Singular value of the targets over the voltages, in parts of the largest, below which they leave a voltage open.
_OPEN = 1e-6
_NUMBERED = re.compile(r"curvature_(\d+)")


def track_shape(
    actuator: Actuator,
    paths: Mapping[str, Drive],
    duration: float,
    limits: Sequence[Limits],
    *,
    alike: bool = False,
    nodes: int = NODES,
    beam: str | None = None,
    load: Load | None = None,
    band: bool = False,
    engine: str = "exact",
) -> TrackedShape:
    """Return the voltages through ``nodes`` whose targets are nearest to their ``paths`` over ``duration`` [s].

    Squares of errors in parts of `TrackedShape.sizes` are added. ``limits`` are of one for all segments, or of each;
    ``alike`` gives all one voltage. ``engine`` simulates the answer, and a nonlinear strip in each of its steps. Raises
    InputError for values out of range, SolveError where no voltage keeps the limits.
    """
    count = _require(actuator, paths)
    bounds = _bounds(limits, 1 if alike else count)
    for of in bounds:
        require_path(of, nodes, duration)
    if nodes * len(bounds) > MOST_VALUES:
        raise InputError(
            f"{argument('nodes')} {nodes} of {len(bounds)} voltages are more than {MOST_VALUES} values; give "
            f"{MOST_VALUES // len(bounds)} nodes at most"
        )
    assert actuator.electrodes is not None
    wires = None if alike else wiring(actuator.electrodes, [str(k) for k in range(1, count + 1)])
    at, fine = np.linspace(0.0, duration, nodes), np.linspace(0.0, duration, 2 * nodes - 1)
    wanted = {name: path.value(fine) for name, path in paths.items()}
    text = ", ".join(f"{name} {path.text}" for name, path in paths.items())
    mounted: dict[str, Any] = {"beam": beam, "load": load}
    line, _ = line_of(actuator, transient_band(fine), wires, max(of.voltage for of in bounds))
    net = strip_netlist(actuator, **mounted, band=transient_band(fine), **line)
    system, rows = state_space([net.linearised()]), _rows(line["layout"], paths)
    gains, (a, b, c) = _reduced(system, rows, bounds)
    reach = dict(zip(paths, np.abs(gains).sum(axis=1).tolist(), strict=True))
    sizes = sizes_of(wanted, reach)
    scale = np.array([sizes[name] if len(paths) > 1 else 1.0 for name in paths])
    singular = np.linalg.svd(gains / scale[:, None], compute_uv=False)
    determined = int((singular > _OPEN * singular[0]).sum()) == len(bounds)
    effort = 0.0 if determined else EFFORT
    about = _in_sizes(answers(system, at, list(rows.values())), scale)
    goal = np.concatenate([path / s for path, s in zip(wanted.values(), scale, strict=True)])
    how: dict[str, Any] = {**mounted, "engine": engine, "wires": wires}

    def run(values: Array) -> Response:
        parts = [PiecewiseLinear(at, volts, f"voltage for {text}") for volts in values.reshape(-1, nodes)]
        named = Drives(tuple((str(k + 1), part) for k, part in enumerate(parts)))
        return simulate(actuator, parts[0] if alike else named, fine, **how)

    def seen(response: Response) -> tuple[Array, Array]:
        moved = [output_of(response, name) / s for name, s in zip(paths, scale, strict=True)]
        return np.concatenate(moved), currents_of(response, len(bounds))[:, ::2].ravel()

    values = nearest_voltage(about, goal, at, bounds, effort=effort)
    response = run(values)
    if not net.linear:
        values, response = newton(values, response, about, goal, at, bounds, run, seen, effort=effort)
    drive = response.drive
    assert isinstance(drive, Drives | PiecewiseLinear)
    shares = zip(values.reshape(-1, nodes), currents_of(response, len(bounds))[:, ::2], bounds, strict=True)
    each = np.array(list(sizes.values()))
    far = farthest_of(wanted, sizes)
    steps = np.array([path[far] for path in wanted.values()]) / each
    at_rest = least_at_rest(gains / each[:, None], steps)
    return _told(
        TrackedShape(
            actuator=actuator,
            path_text=text,
            paths=wanted,
            drive=drive,
            limits=bounds,
            response=response,
            at_limit=tuple(float(touched(volts, flowing, at, of).mean()) for volts, flowing, of in shares),
            reach=reach,
            rate=dict(zip(paths, largest_rates(a, b, c).tolist(), strict=True)),
            at_rest=at_rest,
            bound=fastest_shape(a, b, c / each[:, None], steps) if steps.any() and at_rest <= BAND else None,
            determined=determined,
            stderr=_stderr(actuator, drive, fine, rows, how) if band else {},
        ),
        paths,
    )


def _require(actuator: Actuator, paths: Mapping[str, Drive]) -> int:
    """Return the number of segments. Raises InputError for a strip without them, and for targets that are not there."""
    if actuator.electrodes is None:
        raise InputError(
            f"actuator '{actuator.name}' has no [electrodes], so no segments and no shape to choose; "
            f"leave {argument('quantity', 'shape')} out for a path of its tip"
        )
    if actuator.coupling is None:
        raise InputError(f"actuator '{actuator.name}' has no [coupling]; its shape cannot be controlled")
    count = actuator.electrodes.segments(1)
    for name in paths:
        match = _NUMBERED.fullmatch(name)
        if match is None and name not in ("displacement", "angle"):
            raise InputError(f"a shape has no '{name[:40]}'; its targets are displacement, angle, curvature_1, ...")
        if match is not None and not 1 <= int(match[1]) <= count:
            known = f"{count} segments, 1 to {count}" if count > 1 else "one segment, 1"
            raise InputError(f"{name} is of a segment that is not there: side 1 has {known}")
    if not paths:
        raise InputError("a path of a shape needs a target: displacement, angle, curvature_1, ...")
    return count


def _bounds(limits: Sequence[Limits], count: int) -> tuple[Limits, ...]:
    """Return the limits of each voltage. Raises InputError for as many as there are no voltages."""
    if len(limits) not in (1, count):
        raise InputError(
            f"{len(limits)} limits were given for {count} voltage{'s' * (count > 1)}; give one for all, or one for each"
        )
    return tuple(limits) * count if len(limits) == 1 else tuple(limits)


def _rows(layout: Layout, paths: Mapping[str, Drive]) -> dict[str, dict[str, float]]:
    """Return the outputs of the circuit that make each target, with their weights."""
    bent = along_segments(layout)
    found: dict[str, dict[str, float]] = {}
    for name in paths:
        if name == "displacement":
            found[name] = {name: 1.0}
        else:
            found[name] = {f"curvature_{k + 1}": float(w) for k, w in enumerate(bent[name]) if w}
    return found


def _reduced(
    system: StateSpace, rows: Mapping[str, Mapping[str, float]], bounds: Sequence[Limits]
) -> tuple[Array, tuple[Array, Array, Array]]:
    """Return the targets at rest (T, N) under each voltage at its limit, and a small state space of them."""
    wanted = np.zeros((len(rows), len(system.output_names)))
    for row, weights in enumerate(rows.values()):
        for name, weight in weights.items():
            wanted[row, system.output_names.index(name)] = weight
    volts = np.array([of.voltage for of in bounds])
    gains = wanted @ system.gains()[0] * volts
    sizes = np.abs(gains).sum(axis=1)
    sizes[sizes == 0.0] = 1.0
    a, b, c = balanced(system.a[0], system.b[0, :, :-1] * volts, wanted @ system.c[0] / sizes[:, None])
    return gains, (a, b, c * sizes[:, None])


def _in_sizes(about: Answers, scale: Array) -> Answers:
    """Return the answers of targets in parts of a ``scale`` (T,)."""
    each = np.repeat(scale, len(about.output) // len(scale))
    return replace(about, output=about.output / each[:, None])


def _stderr(
    actuator: Actuator, drive: Drive, fine: Array, rows: Mapping[str, Mapping[str, float]], how: Mapping[str, Any]
) -> dict[str, Array]:
    found = prediction_band(actuator, drive, fine, misfit=False, sums=rows, **how).stderr
    return {name: found[name] for name in rows}


def _told(tracked: TrackedShape, paths: Mapping[str, Drive]) -> TrackedShape:
    """Return the result with what the voltages should be known for."""
    found = list({finding.code: finding for path in paths.values() for finding in drive_findings(path)}.values())
    sizes = tracked.sizes
    if tracked.at_rest > BAND:
        at = float(tracked.time[tracked.farthest])
        found.append(Finding("shape-too-far", values={"time": at, "share": tracked.at_rest}))
    if not tracked.followed:
        shares = {name: float(np.abs(e).max()) / sizes[name] for name, e in tracked.errors.items()}
        worst = max(shares, key=lambda name: shares[name])
        values = {"target": worst, "share": shares[worst], "limited": max(tracked.at_limit)}
        found.append(Finding("shape-not-followed", values=values))
    if not tracked.determined:
        found.append(Finding("shape-left-open", values={"targets": len(paths), "voltages": len(tracked.limits)}))
    return replace(tracked, findings=tuple(found))
