"""Do the 95 % intervals of spectrum fits hold the truth 95 times in a hundred? Noisy spectra of known strips tell.

python benchmarks/intervals.py [spectra a model, default 500]
"""

from __future__ import annotations

import sys

import numpy as np
from tqdm import tqdm

from ilg_circuit.identify.spectrum_files import Spectrum
from ilg_circuit.identify.spectrum_fit import fit_spectrum
from ilg_circuit.models import electrical_model

#: model -> (values, electrode resistance)
TRUTHS = {
    "rc": ((233.0, 6.8, 0.02), 1.0),
    "rc2": ((400.0, 20.0, 0.01, 100.0, 0.02), 2.0),
    "rc3": ((1000.0, 10.0, 0.001, 50.0, 0.01, 100.0, 0.1), 0.0),
    "warburg": ((300.0, 10.0, 50.0, 2.0), 2.0),
    "cpe": ((1000.0, 10.0, 0.02, 0.8), 0.0),
}
NOISE, POINTS, BOUNDS = 0.005, 61, (0.93, 0.97)


def coverage(model: str, spectra: int, seed: int = 0, quiet: bool = False) -> dict[str, float]:
    """Part of the spectra in whose 95 % interval the truth lies, for each parameter."""
    random = np.random.default_rng(seed)
    values, held = TRUTHS[model]
    kind = electrical_model(model)
    f = np.geomspace(1e-3, 1e4, POINTS)
    z = kind.port(values, held).impedance(2j * np.pi * f, ideal=True)
    hits = dict.fromkeys(kind.names, 0)
    for _ in tqdm(range(spectra), desc=model, leave=False, disable=quiet or None):
        noise = random.standard_normal(POINTS) + 1j * random.standard_normal(POINTS)
        fit = fit_spectrum(Spectrum(model, f, z * (1 + NOISE * noise)), model, held)
        for name, truth in zip(kind.names, values, strict=True):
            low, high = fit.intervals.get(name, (np.inf, -np.inf))
            hits[name] += low <= truth <= high
    return {name: count / spectra for name, count in hits.items()}


def main() -> None:
    spectra = int(sys.argv[1]) if len(sys.argv) > 1 else 500
    outside = []
    for model in TRUTHS:
        found = coverage(model, spectra)
        mean = float(np.mean(list(found.values())))
        each = ", ".join(f"{name} {100 * part:.1f}" for name, part in found.items())
        print(f"{model:<8} {100 * mean:.1f} % of {spectra} spectra ({each})", flush=True)
        if not BOUNDS[0] <= mean <= BOUNDS[1]:
            outside.append(model)
    if outside:
        raise SystemExit(f"outside {BOUNDS[0]:.0%} to {BOUNDS[1]:.0%}: {', '.join(outside)}")


if __name__ == "__main__":
    main()
