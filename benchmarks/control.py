"""How long `tune`, `track`, `learn` and `close` take, and what a position loop of the paper's strip reaches.

Writes CONTROL.md beside this file. python benchmarks/control.py
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from figure import Figure
from machine import conditions

import ilg_circuit as ilg

RESULTS = Path(__file__).with_name("CONTROL.md")
RUNS = 3
PI = "gain=20V/mm,reset_time=10s"
#: The paper's strip, its electrodes cut into four.
FOUR = ilg.PAPER.with_(
    electrodes={"sheet_resistance_1": 0.25, "sheet_resistance_2": 0.25, "segments_1": 4, "segments_2": 4, "gap": 5e-4,
                "contact": "each"}
)  # fmt: skip


def fitted() -> Any:
    """The paper's strip, fitted to its own step of 4 V with 1 % noise."""
    times = np.linspace(0.0, 300.0, 201)
    run = ilg.simulate("paper", "step:4V", times=times, engine="exact", beam="static")
    noise = 0.01 * np.random.default_rng(1).normal(size=(2, len(times)))
    data = {"time_s": times, "voltage_V": run.voltage}
    data["current_A"] = run.current + noise[0] * np.abs(run.current).max()
    data["displacement_m"] = run.displacement + noise[1] * np.abs(run.displacement).max()
    return ilg.identify(data, "paper", model="rc", onset="first-level", engine="exact").actuator


def cost(call: Callable[[], Any]) -> float:
    """Least time [s] of some calls, the first one apart."""
    found = []
    for _ in range(RUNS + 1):
        begin = perf_counter()
        call()
        found.append(perf_counter() - begin)
    return min(found[1:])


def settlings() -> list[tuple[str, str, float, float]]:
    """Settling [s] and overshoot of a step of 3 mm within 4 V, by controller and beam."""
    rows = []
    for beam in ("static", "dynamic"):
        volts = 3e-3 / ilg.simulate("paper", "step:1V", "600 s", beam=beam, engine="exact").displacement[-1]
        run = ilg.simulate("paper", f"step:{volts}V", "300 s", samples=30001, beam=beam, engine="exact")
        outside = np.abs(run.displacement - 3e-3) > 0.02 * 3e-3
        over = run.displacement.max() / 3e-3 - 1
        rows.append((f"{volts:.4f} V, open loop", beam, float(run.time[outside][-1]), over))
    for name, changed in (
        ("PI 20 V/mm, 10 s", {}),
        ("the same without anti-windup", {"anti_windup": "none"}),
        ("the same, tracking time 1 s", {"tracking_time": "1 s"}),
        ("the same, clamped integrator", {"anti_windup": "clamping"}),
        ("PI 5 V/mm, 15 s", {"gains": "gain=5V/mm,reset_time=15s"}),
        ("PI 30 V/mm, 25 s", {"gains": "gain=30V/mm,reset_time=25s"}),
    ):
        how: dict[str, Any] = {"gains": PI, "beam": "static"} | changed
        tuned = ilg.tune("paper", "3 mm", **how)
        rows.append((name, "static", tuned.settling, tuned.overshoot))
    dynamic = ilg.tune("paper", "3 mm", gains=PI, beam="dynamic")
    rows.append((f"PI 20 V/mm, 10 s; largest abs(S) {dynamic.margins.sensitivity[0]:.2f}", "dynamic",
                 dynamic.settling, dynamic.overshoot))  # fmt: skip
    for beam, judged in (("static", tuned), ("dynamic", dynamic)):
        rows.append(("no voltage settles sooner than", beam, judged.wish.bound, 0.0))
    return rows


def times(strip: Any) -> list[tuple[str, float]]:
    """What was done, and its time [s]."""
    tuned = ilg.tune("paper", "3 mm", gains=PI, beam="static")
    sine = ("sine:3mm,5mHz", "400 s")

    def wave(size: float) -> dict[int, Any]:
        time = np.linspace(0.0, 200.0, 201)
        return {
            k: (time, size * np.sin(2 * np.pi * (time / 100 - k / 4)) * np.minimum(time / 40, 1)) for k in range(1, 5)
        }

    def close(**how: Any) -> Callable[[], Any]:
        asked: dict[str, Any] = {"period": "0.1 s", "beam": "static"} | how
        return lambda: ilg.close_loop("paper", tuned, "step:3mm", "60 s", **asked)

    calls: tuple[tuple[str, Callable[[], Any]], ...] = (
        ("`tune`, PI over 200 samples, static beam", lambda: ilg.tune(strip, "3 mm", beam="static")),
        ("`tune`, LQG over 200 samples, dynamic beam", lambda: ilg.tune(strip, "3 mm", "lqg", beam="dynamic")),
        ("`tune --gains`, judged over 200 samples", lambda: ilg.tune(strip, "3 mm", gains=PI, beam="static")),
        ("`track`, a path that can be followed", lambda: ilg.track("paper", *sine, beam="static")),
        ("`track`, at the limit", lambda: ilg.track("paper", "sine:3mm,20mHz", "200 s", beam="static")),
        ("`track`, a shape of four segments, 101 nodes", lambda: ilg.track(FOUR, wave(4.0), nodes=101)),
        ("`track`, the same at the limit", lambda: ilg.track(FOUR, wave(12.0), nodes=101)),
        ("`learn`, 200 samples, 10 trials", lambda: ilg.learn(strip, *sine)),
        ("`close`, 600 calls, exact", close(engine="exact")),
        ("`close`, 600 calls, ngspice", close(engine="ngspice")),
        ("`close --pwm 1kHz`, 60000 cycles", close(pwm="1 kHz")),
        ("`close --adapt`, 600 calls", close(adapt=True, drift="gain=-40%")),
        ("`close --form behavioural`, 60 s", close(form="behavioural", period=None)),
    )
    return [(name, cost(call)) for name, call in calls]


def learning(strip: Any) -> list[str]:
    """Lines on the trials of a fitted strip."""
    found = ilg.learn(strip, "sine:3mm,5mHz", "400 s", trials=4)
    falls = found.distances[:, 1] / found.distances[:, 0]
    count, good = len(found.errors), int(found.promised.sum())
    lines = [
        f"A sine of 3 mm and 5 mHz over 400 s, learnt up to {1e3 * found.bandwidth:.0f} mHz, {count - 1} samples of",
        f"the fit: {good} of {count} strips are promised to converge, the largest contraction is",
        f"{found.contraction.max():.3f}, the largest fall of a first trial {falls[1:].max():.3f}.",
        "",
        "| trial | largest error, rms | promised at most |",
        "|---|---|---|",
    ]
    rows = zip(found.errors.max(axis=0), found.bounds, strict=True)
    return lines + [f"| {k} | {1e6 * error:.2f} um | {1e6 * bound:.2f} um |" for k, (error, bound) in enumerate(rows)]


def shaped() -> list[tuple[str, str]]:
    """What was asked of four segments, and the answer: known drives, and OSQP on a path faster than the strip."""
    nodes, fine = np.linspace(0.0, 200.0, 101), np.linspace(0.0, 200.0, 201)
    random = np.random.default_rng(3)
    known = {k: np.interp(nodes, nodes[::10], random.uniform(-4.0, 4.0, 11)) for k in (1, 2, 3, 4)}
    found = []
    for beam in ("static", "dynamic"):
        made = ilg.simulate(FOUR, {k: (nodes, v) for k, v in known.items()}, times=fine, engine="exact", beam=beam)
        wave = {k: (fine, made.segments[f"curvature_{k}"]) for k in known}
        for name, path in (("their curvatures", wave), ("all columns of their run", made)):
            back = ilg.track(FOUR, path, nodes=101, beam=beam, quantity="shape")
            off = max(np.abs(back.voltages[str(k)][::2] - v).max() for k, v in known.items())
            found.append((f"drives up to 4 V from {name}, {beam} beam: largest difference", f"{off:.1e} V"))
    fast = {k: (fine, 6 * np.sin(2 * np.pi * (fine / 50 - k / 4)) * np.minimum(fine / 20, 1)) for k in known}
    found += [(f"a wave of 6 1/m, 20 mHz, {name}: rms error by Clarabel", f"{own:.6f} 1/m") if referee is None else
              (f"a wave of 6 1/m, 20 mHz, {name}: rms error by Clarabel, and relative difference by OSQP",
               f"{own:.6f} 1/m, {abs(own / referee - 1):.1e}")
              for name, own, referee in against_osqp(fast)]  # fmt: skip
    return found


def against_osqp(path: dict[int, Any]) -> list[tuple[str, float, float | None]]:
    """The rms error [1/m] of a path under limits, by `track`, and by OSQP where it is installed."""
    from ilg_circuit.circuit.strip import strip_netlist
    from ilg_circuit.circuit.wiring import wiring
    from ilg_circuit.control.programme import SMOOTHING, answers, trapezoid
    from ilg_circuit.simulation.curvature import along_segments
    from ilg_circuit.simulation.response import line_of, transient_band
    from ilg_circuit.solve.state_space import state_space

    fine = path[1][0]
    nodes, n, count = fine[::2], (len(fine) + 1) // 2, len(path)
    wires = wiring(FOUR.electrodes, [str(k) for k in path])
    line, _ = line_of(FOUR, transient_band(fine), wires, 4.0)
    bent = along_segments(line["layout"])
    rows = [{f"curvature_{c + 1}": float(w) for c, w in enumerate(bent[f"curvature_{k}"]) if w} for k in path]
    net = strip_netlist(FOUR, beam="static", band=transient_band(fine), **line)
    matrix = answers(state_space([net]), nodes, rows).output * 4.0
    goal, weight = np.concatenate([wave for _, wave in path.values()]), np.tile(trapezoid(len(fine)), count)
    scale = np.abs(goal).max()
    change = np.kron(np.eye(count), np.eye(n) - np.eye(n, k=-1))
    between = np.delete(change, np.arange(0, count * n, n), axis=0)
    hessian = 2 * (matrix.T * weight) @ matrix / (len(fine) * scale**2) + 2 * SMOOTHING * between.T @ between
    linear = -2 * (matrix.T * weight) @ goal / (len(fine) * scale**2)
    found: list[tuple[str, float, float | None]] = []
    for name, slew in (("4 V", None), ("4 V and 1 V/s", 1.0)):
        tracked = ilg.track(FOUR, path, nodes=n, beam="static", slew=slew)
        own = float(np.sqrt(sum(e**2 for e in tracked.rms.values()) / count))
        try:
            import osqp
        except ImportError:
            found.append((name, own, None))
            continue
        from scipy import sparse

        most = np.full(count * n, np.inf if slew is None else slew * float(nodes[1]) / 4.0)
        if slew is not None:
            most[::n] = 0.0
        bound = np.concatenate([np.ones(count * n), most])
        solver = osqp.OSQP()
        wide = sparse.csc_matrix(np.vstack([np.eye(count * n), change]))
        how: dict[str, Any] = {"eps_abs": 1e-10, "eps_rel": 1e-10, "max_iter": 400_000, "polishing": True}
        solver.setup(sparse.csc_matrix(hessian), linear, wide, -bound, bound, verbose=False, **how)
        off = (matrix @ solver.solve(raise_error=False).x - goal) ** 2
        found.append((name, own, float(np.sqrt(np.average(off, weights=weight)))))
    return found


def main() -> list[Figure]:
    """Measure, print and write the tables."""
    strip = fitted()
    reached, spent, bent = settlings(), times(strip), shaped()
    lines = [
        "# A position loop",
        "",
        *conditions(("numpy", "scipy", "clarabel")),
        "",
        "The paper's strip, a step of 3 mm from rest within 4 V, settled within 2 %. Remade by",
        "`python benchmarks/control.py`.",
        "",
        "| controller | beam | settles in | overshoot |",
        "|---|---|---|---|",
        *(f"| {name} | {beam} | {time:.2f} s | {over:.2%} |" for name, beam, time, over in reached),
        "",
        *learning(strip),
        "",
        "The strip with its electrodes cut into four segments of 0.25 ohm per square, 101 nodes over 200 s:",
        "",
        "| a path of the shape | |",
        "|---|---|",
        *(f"| {name} | {value} |" for name, value in bent),
        "",
        f"Least time of {RUNS} calls:",
        "",
        "| what | time |",
        "|---|---|",
        *(f"| {name} | {1e3 * time:.0f} ms |" for name, time in spent),
    ]
    text = "\n".join(lines) + "\n"
    RESULTS.write_text(text, encoding="utf-8")
    print(text)
    return [Figure(name, f"{1e3 * time:.0f} ms") for name, time in spent] + [Figure(*row) for row in bent]


if __name__ == "__main__":
    main()
