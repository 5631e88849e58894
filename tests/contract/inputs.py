"""The files that the contract's runs read: synthetic measurements from closed forms, the same on every machine.

Nothing here uses the package. Noise comes from numpy's `RandomState`, whose numbers never change, and every number is
written with nine digits, so that the last bits of an exponential do not show. A fit ends where the sum of squares
stands still, some 1e-8 from the least: of several seeds those were taken whose fits end at the same place with other
rounding, such as that of another processor.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Answer = Callable[[Array], Array]
Jumps = tuple[tuple[float, float], ...]

#: The strip: electron path [ohm], ion branches [(ohm, F)], largest voltage of the sinh law [V], growth [1/V].
RDC, BRANCHES, EMISSION, GROWTH = 640.0, ((21.0, 0.33), (160.0, 0.15)), 0.8, 0.4
#: The coupling d(s) = gain (s + zero)/(s^2 + 2 damping frequency s + frequency^2) and 3 L_F^2/b^2 of the paper's strip.
GAIN, ZERO, DAMPING, FREQUENCY, LEVER = 2.3e-9, 0.21, 0.6, 0.08, 10800.0
#: Size of the noise, relative to the largest value of a column.
NOISE = 3e-3

#: A fitted strip as 0.1.0 writes it; bands and confidences are made from its covariance.
STRIP = """\
name = "strip"

[geometry]
length = "35 mm"
free_length = "30 mm"
width = "5 mm"
thickness = "500 um"

[material]
dc_resistivity = "221.8 ohm m"
dynamic_resistivity = "7.353 ohm m"
permittivity = "0.9423 F/m"
youngs_modulus = "7.6 kPa"
density = "1250 kg/m^3"
beam_damping_ratio = 0.3
electrode_resistivity_1 = "0 ohm m"
electrode_thickness_1 = "0 m"
electrode_resistivity_2 = "0 ohm m"
electrode_thickness_2 = "0 m"

[coupling]
gain = "2.293e-09 m/(V s)"
zero = "0.2109 1/s"
damping_ratio = 0.5999
natural_frequency = "0.08009 rad/s"
beam = "static"

[mounting]
orientation = "weightless"

[uncertainty]
model = "rc"
names = ["dc_resistance", "dynamic_resistance", "capacitance", "coupling_gain", "coupling_zero"]
covariance = [
    [4.4e-05, -2.0e-07, 5.8e-06, 0.0, 0.0],
    [-2.0e-07, 2.2e-06, -3.0e-08, 0.0, 0.0],
    [5.8e-06, -3.0e-08, 3.3e-06, 0.0, 0.0],
    [0.0, 0.0, 0.0, 6.2e-05, -9.0e-05],
    [0.0, 0.0, 0.0, -9.0e-05, 1.4e-04],
]
"""


def write(folder: Path, words: Iterable[str]) -> None:
    """Write into ``folder`` every input file whose name stands in one of ``words``."""
    words = tuple(words)
    for name, text in _files().items():
        if any(name in word for word in words):
            (folder / name).write_text(text(), encoding="utf-8")


def _files() -> dict[str, Callable[[], str]]:
    """What makes the text of each input file, by the file's name."""
    one, two, moving = _current(BRANCHES[:1]), _current(BRANCHES), _displacement()
    square = ((0.0, 2.0), (30.0, -2.0), (60.0, 2.0), (90.0, -2.0))
    files: dict[str, Callable[[], str]] = {
        "step.csv": partial(_record, ((0.0, 4.0),), (0.5, 20, 240), one, moving, seed=1),
        "two_branches.csv": partial(_record, ((0.0, 4.0),), (1.0, 20, 200), two, seed=2),
        "square.csv": partial(_record, square, (0.5, 10, 240), one, moving, seed=3),
        "ramps.csv": partial(_ramps, seed=4),
        "spectrum.csv": partial(_spectrum, BRANCHES, seed=5),
        "low.csv": partial(_record, ((0.0, 2.0),), (0.5, 20, 160), one, moving, seed=106),
        "high.csv": partial(_record, ((0.0, 4.0),), (0.5, 20, 160), one, moving, seed=107),
        "impedance.csv": partial(_spectrum, BRANCHES[:1], seed=108),
        "other.csv": partial(_record, ((0.0, 3.0),), (0.5, 20, 160), _current(((23.0, 0.3),)), seed=109),
        "strip.toml": lambda: STRIP,
    }
    for k in (1, 2, 3):
        files[f"sinh_{k}V.csv"] = partial(_record, ((0.0, float(k)),), (2.0, 5, 40), _emission(float(k)), seed=10 + k)
        files[f"growing_{k}V.csv"] = partial(_record, ((0.0, float(k)),), (2.0, 5, 40), _growing(float(k)), seed=20 + k)
    for k, (kind, power) in enumerate((("uniaxial", -0.5), ("equibiaxial", -2.0), ("planar", -1.0))):
        files[f"{kind}.csv"] = partial(_stresses, power, seed=30 + k)
    return files


def _current(branches: tuple[tuple[float, float], ...]) -> Answer:
    """The current [A] that a step of 1 V makes."""
    return lambda t: 1 / RDC + sum(np.exp(-t / (r * c)) / r for r, c in branches)


def _emission(voltage: float) -> Answer:
    """The current [A] by the sinh law, for each volt of a step of ``voltage``."""
    (r, c), path = BRANCHES[0], EMISSION / RDC * np.sinh(voltage / EMISSION) / voltage
    return lambda t: path + np.exp(-t / (r * c)) / r


def _growing(voltage: float) -> Answer:
    """The current [A] of a capacitance that grows, q = C (v + k v^2/2), for each volt of a step of ``voltage``.

    The time at which it has charged to v is a closed form; the way back is a table.
    """
    r, c = BRANCHES[0]
    left = np.exp(-np.linspace(0.0, 30.0, 300001))  # of the step, on the series resistance
    times = -r * c * ((1 + GROWTH * voltage) * np.log(left) + GROWTH * voltage * (1 - left))
    return lambda t: 1 / RDC + np.interp(t, times, left) / r


def _displacement() -> Answer:
    """The displacement [m] that a step of 1 V makes: partial fractions of d(s)/s."""
    pole = FREQUENCY * complex(-DAMPING, np.sqrt(1 - DAMPING**2))
    residue = GAIN * (pole + ZERO) / (pole * 2j * pole.imag)
    return lambda t: np.asarray(LEVER * (GAIN * ZERO / FREQUENCY**2 + 2 * (residue * np.exp(pole * t)).real))


def _record(
    jumps: Jumps, sampling: tuple[float, int, int], current: Answer, displacement: Answer | None = None, *, seed: int
) -> str:
    """A record of ``jumps`` [(s, to V)]; ``sampling``: interval [s], samples at rest, samples after them."""
    interval, rest, samples = sampling
    t = interval * np.arange(-rest, samples)

    def superposed(answer: Answer) -> Array:
        total, before = np.zeros(len(t)), 0.0
        for at, level in jumps:
            total[t >= at] += (level - before) * answer(t[t >= at] - at)
            before = level
        return total

    columns = {
        "time_s": t - t[0],
        "voltage_V": superposed(np.ones_like),
        "current_mA": _noisy(1e3 * superposed(current), seed),
    }
    if displacement is not None:
        columns["displacement_mm"] = 0.7 + _noisy(1e3 * superposed(displacement), seed + 100)
    return _csv(columns)


def _ramps(seed: int) -> str:
    """A record of a triangle, up and down at 0.1 V/s: every bend is answered as a ramp."""
    t = 0.5 * np.arange(-10, 200)
    r, c = BRANCHES[0]
    voltage, current = np.zeros(len(t)), np.zeros(len(t))
    for at, bend in ((0.0, 0.1), (20.0, -0.2), (60.0, 0.2)):
        after = np.maximum(t - at, 0.0)
        voltage += bend * after
        current += bend * (after / RDC - c * np.expm1(-after / (r * c)))
    return _csv({"time_s": t - t[0], "voltage_V": voltage, "current_mA": _noisy(1e3 * current, seed)})


def _spectrum(branches: tuple[tuple[float, float], ...], seed: int) -> str:
    """The impedance of the strip at 36 frequencies, from the highest down as instruments sweep."""
    frequency = np.geomspace(1e2, 1e-3, 36)
    s = 2j * np.pi * frequency
    random = np.random.RandomState(seed)
    noise = NOISE * (random.standard_normal(36) + 1j * random.standard_normal(36))
    z = (1 + noise) / (1 / RDC + sum(1 / (r + 1 / (c * s)) for r, c in branches))
    return _csv({"frequency_Hz": frequency, "re_ohm": z.real, "im_ohm": z.imag})


def _stresses(power: float, seed: int) -> str:
    """Nominal stress of an Ogden material of one term; its thickness follows the stretch to ``power``."""
    stretch, mu, alpha = np.linspace(1.05, 3.0, 16), 0.35, 2.6
    stress = mu * (stretch ** (alpha - 1) - stretch ** (power * alpha - 1))
    return _csv({"stretch": stretch, "stress_MPa": _noisy(stress, seed)})


def _noisy(values: Array, seed: int) -> Array:
    return values + NOISE * np.abs(values).max() * np.random.RandomState(seed).standard_normal(len(values))


def _csv(columns: dict[str, Array]) -> str:
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    return "\n".join([",".join(columns), *(",".join(f"{x:.9g}" for x in row) for row in rows)]) + "\n"
