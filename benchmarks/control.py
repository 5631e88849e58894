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

    def close(**how: Any) -> Callable[[], Any]:
        asked: dict[str, Any] = {"period": "0.1 s", "beam": "static"} | how
        return lambda: ilg.close_loop("paper", tuned, "step:3mm", "60 s", **asked)

    calls: tuple[tuple[str, Callable[[], Any]], ...] = (
        ("`tune`, PI over 200 samples, static beam", lambda: ilg.tune(strip, "3 mm", beam="static")),
        ("`tune`, LQG over 200 samples, dynamic beam", lambda: ilg.tune(strip, "3 mm", "lqg", beam="dynamic")),
        ("`tune --gains`, judged over 200 samples", lambda: ilg.tune(strip, "3 mm", gains=PI, beam="static")),
        ("`track`, a path that can be followed", lambda: ilg.track("paper", *sine, beam="static")),
        ("`track`, at the limit", lambda: ilg.track("paper", "sine:3mm,20mHz", "200 s", beam="static")),
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


def main() -> list[Figure]:
    """Measure, print and write the tables."""
    strip = fitted()
    reached, spent = settlings(), times(strip)
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
        f"Least time of {RUNS} calls:",
        "",
        "| what | time |",
        "|---|---|",
        *(f"| {name} | {1e3 * time:.0f} ms |" for name, time in spent),
    ]
    text = "\n".join(lines) + "\n"
    RESULTS.write_text(text, encoding="utf-8")
    print(text)
    return [Figure(name, f"{1e3 * time:.0f} ms") for name, time in spent]


if __name__ == "__main__":
    main()
