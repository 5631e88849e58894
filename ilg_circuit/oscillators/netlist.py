"""A network as an ngspice netlist of behavioural sources, and its solution by ngspice.

Each neuron is two capacitors, Cx = Tr and Cv = Ta, so that 1 V is 1 and 1 A is what fills Tr in a second:

    Rx = 1 ohm          the decay -x            Gv: the fatigue, - d v         Gw: the inhibition, - W_ij y_j
    Bi: the tonic input as a current            Rv = 1 ohm, Gy: Ta v' = -v + y
    By: y = max(0, x), a voltage

The tonic input is a number, never a parameter named e: SPICE would read Euler's number.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..circuit.netlist import GROUND, Element
from ..errors import InputError, SolveError
from ..provenance import Provenance
from ..units import require_positive
from .network import Network, checked_start
from .outcome import Rhythm

#: Newton's method must converge to rounding, so that the grid decides the error; a later line overrides an earlier one.
TOLERANCES = ".options reltol=1e-9 abstol=1e-12 vntol=1e-12"
DECK_OPTIONS = ".options reltol=1e-6 trtol=1 abstol=1e-10 vntol=1e-9 chgtol=1e-14 method=trap numdgt=9"

#: Steps of the coarsest grid in a time constant.
_STEPS_PER_CONSTANT = 100
_MOST_POINTS = 2_000_000
#: Error of period and amplitude, relative, that `measured` asks for.
ACCURACY = 1e-5
_MOST_GRIDS = 8
_MOST_PERIODS = 100
#: Three grids may by chance agree better than they are right.
_CAUTION = 2.0


def netlist_text(network: Network, start: ArrayLike | None = None) -> str:
    """Return the netlist without analysis: nodes x1.., v1.., y1.. and out, the output y_1 - y_2; 1 V stands for 1."""
    state = checked_start(network, start)
    n = network.size
    lines = [f"Matsuoka network of {n} neurons"]
    for i in range(n):
        k = i + 1
        x, v, y = f"x{k}", f"v{k}", f"y{k}"
        lines += [
            Element(f"Cx{k}", (x, GROUND), network.rise_time, start=state[i]).line(),
            Element(f"Rx{k}", (x, GROUND), 1.0).line(),
            Element(f"Gv{k}", (x, GROUND, v, GROUND), network.adaptation).line(),
            Element(f"It{k}", (GROUND, x), network.tonics[i]).line(),
            Element(f"Cv{k}", (v, GROUND), network.adaptation_time, start=state[n + i]).line(),
            Element(f"Rv{k}", (v, GROUND), 1.0).line(),
            Element(f"Gy{k}", (GROUND, v, y, GROUND), 1.0).line(),
            f"By{k} {y} {GROUND} V = max(0, v({x}))",  # a law that no other engine reads
        ]
        weights = [(j + 1, w) for j, w in enumerate(network.matrix[i]) if w]
        lines += [Element(f"Gw{k}_{j}", (x, GROUND, f"y{j}", GROUND), w).line() for j, w in weights]
    plus, minus = (f"y{k + 1}" for k in network.units[0])
    lines += [Element("Eout", ("out", GROUND, plus, minus), 1.0).line(), Element("Rout", ("out", GROUND), 1.0).line()]
    return "\n".join(lines) + "\n"


def deck(
    network: Network,
    duration: float,
    start: ArrayLike | None = None,
    samples: int = 2001,
    provenance: Provenance | None = None,
) -> str:
    """Return a deck for plain ``ngspice -b``: the netlist, a transient over ``duration`` [s], a printed table.

    Raises InputError for a duration that is not positive.
    """
    require_positive("duration", duration, "s")
    title, _, body = netlist_text(network, start).partition("\n")
    step = duration / (samples - 1)
    longest = min(step, min(network.rise_time, network.adaptation_time) / 200)
    shown = " ".join(f"v(y{k + 1})" for k in range(network.size))
    written, *more = (provenance or Provenance()).lines()
    header = [
        f"* {written}; 1 V stands for 1",
        *(f"* {line}" for line in more),
        "* nodes: x (state), v (fatigue), y = max(0, x) of each neuron; out, the drive output",
        "* run with: ngspice -b FILE",
    ]
    analysis = [DECK_OPTIONS, f".tran {_number(step)} {_number(duration)} 0 {_number(longest)} uic"]
    return "\n".join([title, *header, body.rstrip(), *analysis, f".print tran {shown} v(out)", ".end", ""])


def _number(value: float) -> str:
    return repr(float(value))


def solve(network: Network, duration: float, points: int, start: ArrayLike | None = None) -> tuple[Array, Array]:
    """Return a uniform grid of ``points`` steps over ``duration`` [s], and x (n, points + 1) by the trapezoidal rule.

    x, not y: it is smooth enough to interpolate, and max(0, x) then has its corners where they are. Raises SolveError
    when ngspice fails.
    """
    grid, states = _states(network, duration, points, start)
    return grid, states[: network.size]


def _states(network: Network, duration: float, points: int, start: ArrayLike | None) -> tuple[Array, Array]:
    """Return the grid and all states, x and v (2 n, points + 1), as `solve`."""
    from ..solve.ngspice import session

    require_positive("duration", duration, "s")
    if points > _MOST_POINTS:
        raise InputError(
            f"{duration:g} s takes {points} steps of ngspice; at most {_MOST_POINTS} are possible: shorten the "
            "duration or use the engine ode"
        )
    state = checked_start(network, start)
    grid = np.linspace(0, float(duration), points + 1)
    vectors = [f"{kind}{k + 1}" for kind in "xv" for k in range(network.size)]
    with session().loaded(netlist_text(network, state) + TOLERANCES, float(duration), vectors) as run:
        later = run(grid, np.zeros(points + 1))
    return grid, np.hstack([state[:, None], later])


def measured(rhythm: Rhythm, accuracy: float = ACCURACY) -> tuple[float, float, float]:
    """Return period [s], amplitude and their relative error for the cycle of ``rhythm``, by ngspice from its start.

    The amplitude is half the peak-to-peak of y_1 - y_2.

    The run goes on until the cycle's multiplier has left 1e-8 of the start, and four periods more; where that takes
    more than a hundred periods, it starts on the cycle and takes a hundred at most. The trapezoidal error goes with
    the square of the step, but a switch falls anywhere in a step, so nothing is extrapolated. The run is repeated on
    three grids, each finer by about the root of two; it goes on where the one before has come to its own cycle, until
    a thousandth of what the two cycles differ by is left. The finest is returned; its error is twice the largest
    difference from it. Finer grids follow until that meets ``accuracy``; SolveError when it does not.
    """
    cycle = rhythm.cycle
    if cycle is None:
        raise InputError("there is no cycle to measure; only a network that repeats itself has a period")
    network = rhythm.network
    slowest = np.log(np.clip(cycle.multiplier, 1e-8, 1 - 1e-6))
    wait, again = 4 + np.log(1e-8) / slowest, 4 + np.log(1e-3) / slowest
    start, end = rhythm.start, float(rhythm.settled + wait * cycle.period)
    if end > _MOST_PERIODS * cycle.period:
        start, end = cycle.state, float(min(wait, _MOST_PERIODS) * cycle.period)
    step = min(network.rise_time, network.adaptation_time, cycle.period / 4) / _STEPS_PER_CONSTANT
    found: list[Array] = []
    for k in range(_MOST_GRIDS):
        time, states = _states(network, end, int(np.ceil(end / step * 2 ** (k / 2))), start)
        found.append(_read_off(time, states[: network.size], network, cycle.period))
        start, end = states[:, -1], float(min(end, again * cycle.period))
        if k >= 2:
            period, amplitude, size = found[-1]
            scale = np.array([period, amplitude if amplitude > 1e-6 * size else size])
            error = _CAUTION * max(float((np.abs(f - found[-1])[:2] / scale).max()) for f in found[-3:-1])
            if error <= accuracy:
                return float(period), float(amplitude), error
    raise SolveError(f"ngspice left a relative error of {error:.1e} where {accuracy:g} was asked for")


def _read_off(time: Array, inner: Array, network: Network, period: float) -> Array:
    """Return period, amplitude and half the swing of the x that moves most, for the last periods of settled waves."""
    from scipy.interpolate import CubicSpline

    last = time > time[-1] - 2.5 * period - 8 * time[1]
    time, inner = time[last], inner[:, last]
    reference = inner[int(np.argmax(np.ptp(inner, axis=1)))]
    wave = CubicSpline(time, reference - (reference.max() + reference.min()) / 2)
    ups = [r for r in wave.roots(extrapolate=False) if wave(r, 1) > 0]
    # a wave may pass its middle more than once in a period: take the passage one period before the last
    length = min((ups[-1] - r for r in ups[:-1]), key=lambda passed: abs(passed - period), default=np.inf)
    if not abs(length - period) <= 0.05 * period:
        raise SolveError(f"ngspice's waves do not repeat after {period:.6g} s")
    extensor, flexor = network.units[0]
    first, second = (CubicSpline(time, inner[k]) for k in (extensor, flexor))
    difference = CubicSpline(time, inner[extensor] - inner[flexor])
    # y_1 - y_2 is extreme at a corner of either, or where what is active of it has no slope
    curves = (first, second, first.derivative(), second.derivative(), difference.derivative())
    at = np.concatenate([time, *(c.roots(extrapolate=False) for c in curves)])
    output = np.maximum(first(at), 0) - np.maximum(second(at), 0)
    return np.array([length, np.ptp(output) / 2, np.ptp(reference) / 2])


def sampled_by_ngspice(network: Network, times: Array, start: ArrayLike | None = None) -> tuple[Array, float]:
    """Return x (times, n) at ``times`` [s] by ngspice, and the difference of two grids relative to the largest x."""
    from scipy.interpolate import CubicSpline

    end = float(times[-1])
    step = min(network.rise_time, network.adaptation_time) / (4 * _STEPS_PER_CONSTANT)
    points = max(100, int(np.ceil(end / step)))
    _, coarse = solve(network, end, points, start)
    time, fine = solve(network, end, 2 * points, start)
    largest = max(float(np.abs(fine).max()), 1e-300)
    error = float(np.abs(fine[:, ::2] - coarse).max() / largest)
    return np.asarray(CubicSpline(time, fine.T)(times)), error
