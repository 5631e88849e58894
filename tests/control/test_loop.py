"""Loops over time, their margins, the bound: numbers of the paper's strip, closed forms, python-control."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ilg_circuit.control.bound import fastest_settling
from ilg_circuit.control.laws import Law, adrc, law_of, lqg, pi, pid
from ilg_circuit.control.loop import Loop, Run
from ilg_circuit.control.margins import curve_margins, frequencies, largest_delay, margins
from ilg_circuit.control.plant import Plant, first_mode, plants_of
from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.strip.actuator import PAPER

STATIC = plants_of(PAPER, beam="static")[0]
DYNAMIC = plants_of(PAPER, beam="dynamic")[0]


def stepped(plant: Plant, law: Law, duration: float = 100.0, delay: float = 0.0, points: int = 600) -> Run:
    return Loop(plant, law, 4.0, delay).run(np.zeros(1), np.array([3e-3]), duration, points)


def open_loop(plant: Plant) -> Law:
    none = np.zeros(0)
    return Law("open", {}, np.zeros((0, 0)), none, none, none, none, reference=1 / plant.gain)


@pytest.mark.parametrize(
    ("law", "settled", "overshoot"),
    [
        (open_loop(STATIC), "75.3", "9.0"),
        (pi(STATIC, 2e4, 10.0), "27.19", "3.87"),
        (pi(STATIC, 2e4, 10.0).guarded("none"), "72.7", "43"),
        (pi(STATIC, 2e4, 10.0).guarded("back-calculation", 1.0), "43.7", "0"),
        (pi(STATIC, 2e4, 10.0).guarded("clamping"), "28", "4.5"),
        (pi(STATIC, 5e3, 15.0), "53.9", "7.1"),
        (pi(STATIC, 3e4, 25.0), "20.63", "1.7"),
    ],
)
def test_numbers_of_the_static_beam(law: Law, settled: str, overshoot: str) -> None:
    run = stepped(STATIC, law)

    def digits(text: str) -> int:
        return len(text.partition(".")[2])

    assert f"{run.settled():.{digits(settled)}f}" == settled
    assert f"{100 * run.overshoot:.{digits(overshoot)}f}" == overshoot


def test_numbers_of_the_dynamic_beam() -> None:
    run = stepped(DYNAMIC, open_loop(DYNAMIC))
    assert f"{run.settled():.1f}" == "75.7"
    assert run.displacement.max() == pytest.approx(3.271e-3, abs=5e-7)
    run = stepped(DYNAMIC, pi(DYNAMIC, 2e4, 10.0), 300.0, points=3000)
    assert run.displacement.max() == pytest.approx(3.159e-3, abs=5e-7)
    assert run.time[run.displacement.argmax()] == pytest.approx(23.7, abs=0.05)
    assert run.displacement[-1] == pytest.approx(3e-3, abs=1e-9)
    assert first_mode(PAPER, "dynamic") == pytest.approx(0.2213, abs=5e-5)
    assert (STATIC.leading()[0], DYNAMIC.leading()[0]) == (1, 3)


def test_the_bound() -> None:
    assert f"{fastest_settling(STATIC, 3e-3, 4.0):.2f}" == "20.63"
    assert 21.04 <= round(fastest_settling(DYNAMIC, 3e-3, 4.0), 2) <= 21.25
    with pytest.raises(InputError, match=r"out of reach: 4 V holds at most 3\.98 mm"):
        fastest_settling(STATIC, 5e-3, 4.0)


@pytest.mark.parametrize(
    ("plant", "law", "delay"),
    [
        (STATIC, pi(STATIC, 2e4, 10.0), 0.0),
        (DYNAMIC, pid(DYNAMIC, 7e3, 20.0, 1.0, 0.5), 0.5),
        (DYNAMIC, lqg(DYNAMIC, 1.4, 0.5, 0.04), 0.0),
        (DYNAMIC, adrc(DYNAMIC, 0.3), 0.0),
    ],
)
def test_a_run_is_that_of_an_ode_solver(plant: Plant, law: Law, delay: float) -> None:
    n, width, r = len(plant.b), 0.025, 3e-3
    duration = 10.0 if delay else 40.0
    run = stepped(plant, law, duration, delay, round(duration / width))
    late = round(delay / width)

    def seen(t: float) -> float:
        return float(np.interp(t - delay, times, ys)) if t > delay else 0.0

    def rates(t: float, z: np.ndarray) -> np.ndarray:
        x, w = z[:n], z[n:]
        y = float(plant.c @ x) if not late else seen(t)
        asked = float(law.out @ w) + law.reference * r + law.measured * y
        u = min(max(asked, -4.0), 4.0)
        own = law.a @ w + law.into_reference * r + law.into_measured * y + law.into_excess * (u - asked)
        return np.concatenate([plant.a @ x + plant.b * u, own])

    z, times, ys = np.zeros(n + len(law.out)), [0.0], [0.0]
    for k in range(round(duration / width) if late else 1):
        span = (k * width, (k + 1) * width) if late else (0.0, duration)
        found = solve_ivp(rates, span, z, rtol=1e-9, atol=1e-13, max_step=0.1, method="RK45" if late else "LSODA")
        z = found.y[:, -1]
        times.append(span[1])
        ys.append(float(plant.c @ z[:n]))
    assert run.displacement[-1] == pytest.approx(ys[-1], abs=2e-5 * r if late else 3e-8 * r)


def test_margins_by_hand_and_by_brute_force() -> None:
    delay = 0.04
    law = pi(STATIC, 2e4, 10.0)
    assert f"{margins([STATIC], law).sensitivity[0]:.3f}" == "1.000"
    assert f"{margins([STATIC], law, delay).sensitivity[0]:.3f}" == "1.021"
    assert f"{largest_delay([STATIC], law, 1.6):.2f}" == "0.77"
    sensitive = margins([DYNAMIC], pi(DYNAMIC, 2e4, 10.0))
    assert f"{sensitive.sensitivity[0]:.2f}" == "3.55"
    # one pole, one gain, one delay: closed forms
    w = np.geomspace(1e-3, 1e3, 20001)
    loop = (4.0 / (1 + 1j * w) * np.exp(-0.2j * w))[None]
    found = curve_margins(w, loop)
    crossing = np.sqrt(15.0)
    phase = np.pi - np.arctan(crossing) - 0.2 * crossing
    assert found.phase[0] == pytest.approx(phase, rel=1e-6)
    assert found.delay[0] == pytest.approx(phase / crossing, rel=1e-6)
    assert found.sensitivity[0] == pytest.approx(1 / np.abs(1 + loop).min(), rel=1e-6)
    turned = w[np.argmax(np.arctan(w) + 0.2 * w >= np.pi)]
    assert found.gain[0] == pytest.approx(np.hypot(1, turned) / 4, rel=1e-3)


def test_python_control_finds_the_same() -> None:
    control = pytest.importorskip("control", reason="an extra of the package")
    plant = control.ss(DYNAMIC.a, DYNAMIC.b[:, None], DYNAMIC.c[None], 0)
    law = pid(DYNAMIC, 4e3, 20.0, 1.0)
    own = control.ss(law.a, -law.into_measured[:, None], law.out[None], -law.measured)
    gain, phase, _, _ = control.margin(plant * own)
    found = margins([DYNAMIC], law)
    assert found.gain[0] == pytest.approx(gain, rel=1e-4)
    assert np.degrees(found.phase[0]) == pytest.approx(phase, rel=1e-4)
    # the gains of the regulator and of the filter
    speed, observer = 1.4, 0.5
    degree, b0 = DYNAMIC.leading()
    k, _, _ = control.lqr(plant, np.outer(DYNAMIC.c, DYNAMIC.c), np.array([[(b0 / speed**degree) ** 2]]))
    law = lqg(DYNAMIC, speed, observer, 1e-9)
    np.testing.assert_allclose(-law.out[:-1], k[0], rtol=1e-6)
    disturbed = DYNAMIC.b[:, None] * observer**degree / b0
    gain, _, _ = control.lqe(DYNAMIC.a, disturbed, DYNAMIC.c[None], np.eye(1), np.eye(1))
    np.testing.assert_allclose(law.into_measured[:-1], gain[:, 0], rtol=1e-4)
    # the unlimited step response
    time = np.linspace(0.0, 30.0, 301)
    small = pi(DYNAMIC, 2e3, 15.0)
    loop = plant * control.ss(small.a, -small.into_measured[:, None], small.out[None], -small.measured)
    answer = control.forced_response(control.feedback(loop), time, np.full(301, 1e-4))
    run = Loop(DYNAMIC, small, 4.0).run(np.zeros(1), np.array([1e-4]), 30.0, 300)
    np.testing.assert_allclose(run.displacement, answer.outputs, atol=1e-12)


def test_a_response_is_that_of_the_netlist_and_a_loop_that_runs_away_is_told() -> None:
    w = frequencies([DYNAMIC], pi(DYNAMIC, 2e3, 10.0), 50)
    at_rest = DYNAMIC.response(np.array([1e-9]))[0]
    assert at_rest.real == pytest.approx(DYNAMIC.gain, rel=1e-9)
    assert len(w) > 50
    with pytest.raises(SolveError, match="unstable"):
        Loop(DYNAMIC, pi(DYNAMIC, 1e9, 10.0), 1e12).run(np.zeros(1), np.array([3e-3]), 100.0, 100)
    with pytest.raises(InputError, match="pi needs reset_time too"):
        law_of("pi", DYNAMIC, {"gain": 1.0})
