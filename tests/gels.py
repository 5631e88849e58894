"""Materials and load tests that the tests of hyperelastic fits share."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from strategies import log_floats

from ilg_circuit.hyperelastic import MODES, LoadTest, Ogden

MODE = st.sampled_from(list(MODES))
STRETCH = log_floats(0.3, 5.0)
ALPHA = st.one_of(st.floats(0.3, 9.0), st.floats(-9.0, -0.3))

#: A gel with two terms of both signs, and one that stiffens; moduli of the paper's size.
TWO = Ogden((4000.0, -300.0), (2.4, -3.0))
STRETCHES = {"uniaxial": np.linspace(1.02, 3.0, 25), "equibiaxial": np.linspace(1.02, 2.2, 15)} | {
    "planar": np.linspace(1.03, 2.6, 12)
}


@st.composite
def materials(draw: st.DrawFn) -> Ogden:
    """Stable materials of one to four terms: mu_i alpha_i > 0."""
    alpha = draw(st.lists(ALPHA, min_size=1, max_size=4))
    return Ogden.from_moduli([draw(log_floats(1e2, 1e6)) for _ in alpha], alpha)


def readings(material: Ogden, *modes: str, noise: float = 0.0, seed: int = 3) -> list[LoadTest]:
    """Tests of a known material; ``noise`` in parts of each test's largest stress."""
    random = np.random.default_rng(seed)
    tests = []
    for mode in modes or MODES:
        stress = material.nominal(mode, STRETCHES[mode])
        tests.append(
            LoadTest(mode, STRETCHES[mode], stress + noise * stress.max() * random.standard_normal(len(stress)))
        )
    return tests


def cycles(*peaks: float, rows: int = 30, loss: float = 0.25, soft: float = 0.12, noise: float = 0.002) -> LoadTest:
    """A uniaxial test of `TWO` to each of ``peaks`` and back: it softens once it was stretched, and loses work."""
    stretch, stress, farthest = [], [], 1.0
    for peak in peaks:
        up, down = np.linspace(1.0, peak, rows), np.linspace(peak, 1.0, rows)[1:]
        known = np.clip(np.abs(up - 1) / abs(farthest - 1), 0, 1) if farthest != 1 else np.ones(rows)
        stretch += [up, down]
        stress += [
            TWO.nominal("uniaxial", up) * (1 - soft * (1 - known**4)),
            TWO.nominal("uniaxial", down) * (1 - loss * (1 - (np.abs(down - 1) / abs(peak - 1)) ** 3)),
        ]
        farthest = peak if abs(peak - 1) > abs(farthest - 1) else farthest
    p = np.concatenate(stress)
    scatter = noise * np.abs(p).max() * np.random.default_rng(11).standard_normal(len(p))
    return LoadTest("uniaxial", np.concatenate(stretch), p + scatter)


def principal(mode: str, stretch: float) -> np.ndarray:
    free = stretch ** MODES[mode]
    return np.array([stretch, {"uniaxial": free, "equibiaxial": stretch, "planar": 1.0}[mode], free])
