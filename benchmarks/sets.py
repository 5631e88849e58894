"""Noisy data sets of known strips as instruments give them: onset anywhere between two readings, offset, rest, drift.

Every set has a seed of its own, so that one that stands out can be looked at: `random_of(label, k)`.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.identification import Identification, identify
from ilg_circuit.identification.modal import modal_currents, modal_voltages
from ilg_circuit.identification.motion import Motion
from ilg_circuit.identification.open_path import largest_conductance
from ilg_circuit.identification.port_model import DC
from ilg_circuit.identification.port_response import engine_currents
from ilg_circuit.measurements.film import film_of
from ilg_circuit.measurements.prepare import prepare
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.measurements.table import Table
from ilg_circuit.measurements.track import Track, with_track
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_port
from ilg_circuit.strip.models import electrical_model
from ilg_circuit.strip.port import Port

Array = NDArray[np.float64]
Interval = tuple[float, float]

SEED = 2026
#: Where in the interval between the last reading at rest and the first one at the level the onset lies.
FRACTIONS = (0.0, 0.5, 1.0)
REST_LEVELS = (0.0, 0.15)
#: The current's offset is up to so many deviations of its noise.
MOST_OFFSET = 3.0


@dataclass(frozen=True)
class Case:
    """A model's true ``values``, Re ``held`` [ohm], and the noise, relative to abs(Z) or to the largest current."""

    values: tuple[float, ...]
    held: float
    noise: float


@dataclass(frozen=True)
class Drawn:
    """What one set gave: the interval of each quantity, and of those that the onset moves the most that it may span.

    ``fraction`` is that of the onset, None where there is none.
    """

    intervals: dict[str, Interval]
    fraction: float | None = None
    allowed: dict[str, float] = field(default_factory=dict)


#: Number of the set -> what came of it.
Trial = Callable[[int], Drawn]


def random_of(label: str, k: int) -> np.random.Generator:
    """The generator of set ``k`` of those named ``label``."""
    return np.random.default_rng([SEED, zlib.crc32(label.encode()), k])


def truth_of(model: str, case: Case) -> dict[str, float]:
    """Parameters, and what follows from them, by the names under which an identification reports them."""
    kind = electrical_model(model)
    derived = {name: value for name, (value, _) in kind.derived(case.values).items()}
    steady = {"steady_resistance": kind.port(case.values, case.held).steady_resistance} if kind.linear else {}
    return dict(zip(kind.names, case.values, strict=True)) | steady | derived


def intervals_of(found: Identification) -> dict[str, Interval]:
    """The interval that is reported of every quantity that was fitted or follows, or of a path that is not seen."""
    every = {**found.derived, **found.parameters}
    known = {name: e.reported[1] for name, e in every.items() if e.stderr is not None and e.ci95 is not None}
    if found.port is not None and found.port.model.opened:
        known[DC] = (1 / (largest_conductance(found.port.fit, found.port.data) or np.inf), np.inf)
    return known


SPECTRA = {
    "rc": Case((233.0, 6.8, 0.02), 1.0, 0.005),
    "rc2": Case((400.0, 20.0, 0.01, 100.0, 0.02), 2.0, 0.005),
    "rc3": Case((1000.0, 10.0, 0.001, 50.0, 0.01, 100.0, 0.1), 0.0, 0.005),
    "warburg": Case((300.0, 10.0, 50.0, 2.0), 2.0, 0.005),
    "cpe": Case((1000.0, 10.0, 0.02, 0.8), 0.0, 0.005),
    "randles": Case((500.0, 10.0, 8.0, 0.01, 0.8, 50.0, 5.0, 0.46), 0.0, 0.003),
}
STEPS = {
    "rc": Case((233.0, 20.0, 0.2), 1.0, 0.01),
    "rc2": Case((400.0, 40.0, 0.02, 100.0, 0.1), 2.0, 0.002),
    "rc3": Case((1000.0, 60.0, 0.004, 100.0, 0.02, 150.0, 0.15), 0.0, 0.0005),
    "warburg": Case((300.0, 10.0, 50.0, 8.0), 2.0, 0.002),
}
#: Practically without an electron path.
OPEN = {name: replace(STEPS[name], values=(1e9, *STEPS[name].values[1:])) for name in ("rc", "rc2")}
#: Of which a record of 20 s shows little more than one time constant.
SLOW = {"rc": Case((300.0, 25.0, 0.6), 0.0, 0.005), "rc2": Case((100.0, 30.0, 0.1, 50.0, 0.3), 0.0, 0.005)}
#: Under both signs and two sizes of voltage, as a nonlinear model needs it.
LEVELS = {
    "rc+sinh": Case((400.0, 20.0, 0.2, 0.8), 0.0, 0.005),
    "rc+growing": Case((400.0, 20.0, 0.2, 0.3), 0.0, 0.005),
}
#: Under levels whose jumps lie between readings.
JUMPS = {name: STEPS[name] for name in ("rc", "rc2", "warburg")} | {"rc+growing": LEVELS["rc+growing"]}
#: Under a current [A]: the paper's strip, and two branches.
FORCED = {
    "rc": Case((666.667, 19.43635, 0.35), 0.0, 1e-3),
    "rc2": Case((400.0, 20.0, 0.1, 100.0, 0.3), 0.0, 1e-3),
}
FORCED_CURRENT, FORCED_SAMPLES, FORCED_RESTING = 0.01, 301, 20
POINTS, SAMPLES, RESTING, SPACING, STEP = 61, 301, 50, 0.2, 2.0
#: Under noise whose neighbours correlate by phi, after so many samples of rest: ten correlation times or more.
CORRELATED = {f"{model}, phi {phi}": STEPS[model] for model in ("rc", "rc2", "warburg") for phi in (0.7, 0.9)}
CORRELATED_SAMPLES, CORRELATED_RESTING, CORRELATED_SPACING, LARGER_STEP = 400, 100, 0.12, 4.0
#: Of the paper's strip: samples, their distance [s], their noise over the span, drift over the record and the span.
MOVED, MOVED_RESTING, MOVED_SPACING, MOVED_STEP, MOVED_NOISE, MOST_DRIFT = 301, 60, 1.0, 4.0, 0.01, 0.05


@dataclass(frozen=True)
class Clock:
    """When readings were taken [s], the first ``resting`` of them at rest, and when the excitation began."""

    t: Array
    resting: int
    fraction: float

    @classmethod
    def of(cls, samples: int, resting: int, spacing: float, fraction: float) -> Clock:
        return cls(spacing * np.arange(samples + resting), resting, fraction)

    @property
    def onset(self) -> float:
        return float(self.t[self.resting - 1] + self.fraction * (self.t[1] - self.t[0]))

    @property
    def after(self) -> Array:
        """Times since the onset of the readings behind it."""
        return np.maximum(self.t[self.resting :] - self.onset, 0.0)

    def readings(self, rest: float, after: Array) -> Array:
        return np.concatenate([np.full(self.resting, rest), after])


def noise_of(random: np.random.Generator, count: int, phi: float = 0.0) -> Array:
    """Noise of deviation 1 whose neighbours correlate by ``phi``."""
    noise = random.standard_normal(count)
    for k in range(1, count) if phi else ():
        noise[k] = phi * noise[k - 1] + np.sqrt(1 - phi**2) * noise[k]
    return np.asarray(noise)


def current_table(port: Port, clock: Clock, volts: PiecewiseLinear, noise: float, random: np.random.Generator) -> Table:
    """A record of the current under ``volts`` with an offset; ``noise`` is relative to the largest current."""
    return Table(_columns(port, clock, volts, noise, random), "synthetic.csv")


def _columns(
    port: Port, clock: Clock, volts: PiecewiseLinear, noise: float, random: np.random.Generator, phi: float = 0.0
) -> dict[str, Array]:
    if port.linear:
        clean = clock.readings(volts.rest / port.steady_resistance, modal_currents([port], volts, clock.after)[0])
    else:
        clean = clock.readings(0.0, engine_currents([port], volts, clock.after, "ngspice")[0])
    size = noise * float(np.abs(clean).max())
    measured = clean + size * (noise_of(random, len(clean), phi) + random.uniform(0.0, MOST_OFFSET))
    # the voltage's reading is taken with the current's: behind a jump it is the new level
    voltage = clock.readings(volts.rest, volts.value(clock.after))
    return {"time": clock.t, "voltage": voltage, "current": measured}


def spectrum_trial(model: str) -> Trial:
    """Spectra of 61 points from 1 mHz to 10 kHz."""
    case, kind = SPECTRA[model], electrical_model(model)
    f = np.geomspace(1e-3, 1e4, POINTS)
    z = kind.port(case.values, case.held).impedance(2j * np.pi * f, ideal=True)

    def trial(k: int) -> Drawn:
        random = random_of(f"spectrum:{model}", k)
        noise = random.standard_normal(POINTS) + 1j * random.standard_normal(POINTS)
        data = Spectrum(model, f, z * (1 + case.noise * noise))
        return Drawn(intervals_of(identify(data, model=model, electrode_resistance=case.held)))

    return trial


def step_trial(model: str, *, given: bool = False, cases: dict[str, Case] = STEPS, samples: int = SAMPLES) -> Trial:
    """Currents after a step to 2 V, the onset ``given`` or not, of strips among ``cases``."""
    case, kind = cases[model], electrical_model(model)
    port = kind.port(case.values, case.held)

    def trial(k: int) -> Drawn:
        random = random_of(f"step:{model}", k)
        clock = Clock.of(samples, RESTING, SPACING, FRACTIONS[k % len(FRACTIONS)])
        volts = replace(PiecewiseLinear.step(STEP), rest=float(random.choice(REST_LEVELS)))
        table = current_table(port, clock, volts, case.noise, random)
        record = prepare(table, clock.onset if given else None)
        found = identify(record, model=model, electrode_resistance=case.held, engine="exact")
        allowed = {} if given or cases is not STEPS else _allowed(found, case, SPACING)
        return Drawn(intervals_of(found), clock.fraction, allowed)

    return trial


def _allowed(found: Identification, case: Case, interval: float) -> dict[str, float]:
    """Widths of what the onset moves in R-C branches: all that the ``interval`` [s] allows, and 3.92 standard errors.

    A shift d is a factor exp(d/tau) of the branch.
    """
    kind = electrical_model(found.model)
    pairs = kind.pairs(case.values)
    names = kind.names[1:]
    errors = dict(zip(found.fit.labels, found.fit.errors.tolist(), strict=True))
    allowed = {}
    for k, (r, c) in enumerate(pairs):
        for name in names[2 * k : 2 * k + 2]:
            span = 2 * np.sinh(interval / (2 * r * c)) * found.parameters[name].value
            allowed[name] = float(span) + 3.92 * errors[name]
    return allowed


def level_trial(model: str, *, given: bool = True) -> Trial:
    """Currents under six levels of both signs, 301 samples over 60 s; nonlinear ones are judged by ngspice.

    ``given``: the onset is stated, and the levels are of one length; else all jumps lie anywhere between readings.
    """
    case, kind = (LEVELS if given else JUMPS)[model], electrical_model(model)
    port, engine = kind.port(case.values, case.held), "exact" if kind.linear else "ngspice"
    length = (SAMPLES - 1) * SPACING / 6
    levels = np.repeat([0.5, 2.0, -1.0, 1.0, -2.0, 0.0], 2)[:-1]

    def trial(k: int) -> Drawn:
        random = random_of(f"levels:{model}" if given else f"jumps:{model}", k)
        clock = Clock.of(SAMPLES, RESTING, SPACING, 1.0 if given else FRACTIONS[k % len(FRACTIONS)])
        jumps = length * (np.arange(1, 6) + (0.0 if given else random.uniform(-0.2, 0.2, 5)))
        volts = PiecewiseLinear(np.append(0.0, np.repeat(jumps, 2)), levels)
        record = prepare(current_table(port, clock, volts, case.noise, random), clock.onset if given else None)
        found = identify(record, model=model, electrode_resistance=case.held, engine=engine)
        return Drawn(intervals_of(found), clock.fraction)

    return trial


def forced_trial(model: str) -> Trial:
    """Voltages under a current of +-10 mA or a step of it, 20 s of rest and 300 s every second; the onset is stated.

    The voltage's noise is that of the case, relative to the largest; the current is read with a tenth of it.
    """
    case, kind = FORCED[model], electrical_model(model.partition(",")[0])
    port = kind.port(case.values, case.held)

    def trial(k: int) -> Drawn:
        random = random_of(f"forced:{model}", k)
        clock = Clock.of(FORCED_SAMPLES, FORCED_RESTING, 1.0, 1.0)
        source = PiecewiseLinear.step(FORCED_CURRENT, unit="A")
        if k % 2:
            source = PiecewiseLinear.square(-FORCED_CURRENT, FORCED_CURRENT, 100.0, 400.0, unit="A")
        clean = clock.readings(0.0, modal_voltages([port], source, clock.after)[0])
        voltage = clean + case.noise * float(np.abs(clean).max()) * noise_of(random, len(clean))
        set_to = clock.readings(0.0, source.value(clock.after))
        current = set_to + 0.1 * case.noise * FORCED_CURRENT * noise_of(random, len(clean))
        table = Table({"time": clock.t, "voltage": voltage, "current": current}, "synthetic.csv")
        record = prepare(table, clock.onset)
        found = identify(record, model=kind.name, electrode_resistance=case.held, engine="exact")
        return Drawn(intervals_of(found))

    return trial


def correlated_trial(name: str) -> Trial:
    """Currents after a step to 4 V, 500 samples over 60 s, the first 100 at rest, under AR(1) noise, onset stated."""
    model, phi, case = name.split(",")[0], float(name.split()[-1]), CORRELATED[name]
    port = electrical_model(model).port(case.values, case.held)

    def trial(k: int) -> Drawn:
        random = random_of(f"autocorrelated:{name}", k)
        fraction = FRACTIONS[k % len(FRACTIONS)]
        clock = Clock.of(CORRELATED_SAMPLES, CORRELATED_RESTING, CORRELATED_SPACING, fraction)
        volts = replace(PiecewiseLinear.step(LARGER_STEP), rest=float(random.choice(REST_LEVELS)))
        table = Table(_columns(port, clock, volts, case.noise, random, phi), "synthetic.csv")
        record = prepare(table, clock.onset)
        found = identify(record, model=model, electrode_resistance=case.held, engine="exact")
        return Drawn(intervals_of(found), fraction)

    return trial


def displacement_truth() -> dict[str, float]:
    coupling = PAPER.coupling
    assert coupling is not None
    names = ("gain", "zero", "damping_ratio", "natural_frequency")
    return {f"coupling_{name}": float(getattr(coupling, name)) for name in names}


def displacement_trial(_: str, *, given: bool = False, resting: int = MOVED_RESTING) -> Trial:
    """Displacements of the paper's strip after a step to 4 V: 301 samples over 300 s, rest of 60 s, with a drift.

    ``resting`` is another number of samples at rest, one a second.
    """
    truth = np.array(list(displacement_truth().values()))
    port, motion = lumped_port(PAPER), Motion(PAPER, "static", "exact")

    def trial(k: int) -> Drawn:
        random = random_of("displacement", k)
        clock = Clock.of(MOVED, resting, MOVED_SPACING, FRACTIONS[k % len(FRACTIONS)])
        volts = replace(PiecewiseLinear.step(MOVED_STEP), rest=float(random.choice(REST_LEVELS)))
        columns = _columns(port, clock, volts, 0.002, random)
        moved = clock.readings(0.0, motion.displacements(volts, clock.after, truth[None])[0])
        span = float(np.ptp(moved))
        drift = random.uniform(-MOST_DRIFT, MOST_DRIFT) * span * clock.t / clock.t[-1]
        noise = MOVED_NOISE * span * noise_of(random, len(moved))
        columns["displacement"] = moved + drift + random.uniform(-1.0, 1.0) * span + noise
        record = prepare(Table(columns, "synthetic.csv"), clock.onset if given else None)
        return Drawn(intervals_of(identify(record, model="rc", base=PAPER, engine="exact")), clock.fraction)

    return trial


#: A camera beside a potentiostat: rest and record [s], readings a second of both, how late its clock reads [s], its
#: rate, and what the drive is.
FILMED_REST, FILMED_TIME, FILMED_RATES, FILMED_LATE, FILMED_RATE = 10.0, 90.0, (10.0, 25.0), 0.37, 1.002
#: As `FRACTIONS`; no jump lies at a reading, where it would be read before or behind it.
FILMED_FRACTIONS = (0.05, 0.5, 0.95)
FILMED = {"step": PiecewiseLinear.step(MOVED_STEP), "square": PiecewiseLinear.square(0.0, MOVED_STEP, 30.0, 90.0)}


def filmed_truth(model: str) -> dict[str, float]:
    rate = {} if model == "step" else {"displacement_clock_rate": FILMED_RATE}
    return {**displacement_truth(), "displacement_delay": FILMED_LATE, **rate}


def filmed_trial(model: str) -> Trial:
    """The paper's strip filmed at 25 Hz by a camera whose clock reads 0.37 s more, its voltage and current at 10 Hz.

    Under a square wave that clock also goes faster by 0.2 %. The film begins 5 to 8 s before the voltage.
    """
    coupling = np.array(list(displacement_truth().values()))
    port, motion, volts = lumped_port(PAPER), Motion(PAPER, "static", "exact"), FILMED[model]
    count, resting = (int(FILMED_RATES[0] * length) for length in (FILMED_TIME, FILMED_REST))
    rate = filmed_truth(model).get("displacement_clock_rate", 1.0)

    def trial(k: int) -> Drawn:
        random = random_of(f"filmed {model}", k)
        clock = Clock.of(count, resting, 1 / FILMED_RATES[0], FILMED_FRACTIONS[k % len(FILMED_FRACTIONS)])
        record = prepare(Table(_columns(port, clock, volts, 0.002, random), "current.csv"))
        t = np.arange(-random.uniform(5.0, 8.0), FILMED_TIME - 1.0, 1 / FILMED_RATES[1])
        moved = np.zeros(len(t))
        moved[t >= 0] = motion.displacements(volts, t[t >= 0], coupling[None])[0]
        moved += MOVED_NOISE * float(np.ptp(moved)) * noise_of(random, len(t)) + 1e-3 * random.uniform(-1.0, 1.0)
        film = Track("camera.csv", clock.onset + FILMED_LATE + rate * t, moved)
        found = identify(with_track(record, film), model="rc", base=PAPER, engine="exact")
        return Drawn(intervals_of(found), clock.fraction)

    return trial


#: Displacements alone: the drive of `FILMED` that is stated, which beam moves, and whether the onset is stated too.
ALONE = {
    "step": ("step", "static", False),
    "square": ("square", "static", False),
    "step, dynamic beam": ("step", "dynamic", False),
    "step, onset stated": ("step", "static", True),
}


def alone_truth(model: str) -> dict[str, float]:
    delay = {} if ALONE[model][2] else {"displacement_delay": ALONE_LATE}
    return {**displacement_truth(), **delay}


#: How much later a camera's clock reads [s] than that of a drive which nobody measured.
ALONE_LATE = 12.3


def alone_trial(model: str) -> Trial:
    """The paper's strip filmed at 25 Hz for 90 s under a drive that is stated, from 5 to 8 s before it on."""
    coupling = np.array(list(displacement_truth().values()))
    drive, beam, stated = ALONE[model]
    motion, volts = Motion(PAPER, beam, "exact"), FILMED[drive]

    def trial(k: int) -> Drawn:
        random = random_of(f"alone {model}", k)
        t = np.arange(-random.uniform(5.0, 8.0), FILMED_TIME - 1.0, 1 / FILMED_RATES[1])
        moved = np.zeros(len(t))
        moved[t >= 0] = motion.displacements(volts, t[t >= 0], coupling[None])[0]
        moved += MOVED_NOISE * float(np.ptp(moved)) * noise_of(random, len(t)) + 1e-3 * random.uniform(-1.0, 1.0)
        film = film_of(Track("camera.csv", ALONE_LATE + t, moved), volts)
        found = identify(replace(film, delay=ALONE_LATE if stated else None), base=PAPER, engine="exact")
        return Drawn(intervals_of(found), 0.0)

    return trial
