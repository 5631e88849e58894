"""How long spectra take: 20 of them, each by 4 models, as `identify_spectra` fits them. Prints seconds.

python benchmarks/spectra.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np

from ilg_circuit.identify import identify_spectra
from ilg_circuit.models import electrical_model

MODELS = {
    "rc": (233.0, 6.8, 0.02),
    "rc2": (400.0, 20.0, 0.01, 100.0, 0.02),
    "warburg": (300.0, 10.0, 50.0, 2.0),
    "cpe": (1000.0, 10.0, 0.02, 0.8),
}
SPECTRA, POINTS, NOISE, LIMIT = 20, 61, 0.005, 20.0


def write_spectra(folder: Path) -> list[Path]:
    """Files of noisy spectra, the four models in turn, each parameter spread by 20 %."""
    random = np.random.default_rng(1)
    f = np.geomspace(1e-3, 1e4, POINTS)
    paths = []
    for k in range(SPECTRA):
        name = tuple(MODELS)[k % len(MODELS)]
        factors = np.exp(0.2 * random.standard_normal(len(MODELS[name])))
        limits = [p.below for p in electrical_model(name).parameters]
        values = [min(v * x, 0.95 * b) for v, x, b in zip(MODELS[name], factors, limits, strict=True)]
        z = electrical_model(name).port(values).impedance(2j * np.pi * f, ideal=True)
        z = z * (1 + NOISE * (random.standard_normal(POINTS) + 1j * random.standard_normal(POINTS)))
        rows = [f"{a!r},{b.real!r},{b.imag!r}" for a, b in zip(f.tolist(), z.tolist(), strict=True)]
        paths.append(folder / f"{k}_{name}.csv")
        paths[-1].write_text("\n".join(["frequency_Hz,re_ohm,im_ohm", *rows]) + "\n")
    return paths


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        paths = write_spectra(Path(folder))
        begin = perf_counter()
        outcomes = identify_spectra(paths, tuple(MODELS))
        seconds = perf_counter() - begin
    own = [o for o in outcomes if o.path.stem.endswith("_" + o.model)]
    rms = [o.result.fit.relative_rms for o in own if o.result]
    print(
        f"{len(paths)} spectra by {len(MODELS)} models: {seconds:.1f} s; {sum(bool(o.error) for o in outcomes)} errors"
    )
    print(f"the {len(own)} spectra of the model fitted: rms {min(rms):.2%} to {max(rms):.2%}, noise {NOISE:.2%}")
    if len(rms) < len(own) or max(rms) > 1.5 * NOISE:
        raise SystemExit("a spectrum was not fitted by its own model")
    if seconds > LIMIT:
        raise SystemExit(f"slower than {LIMIT:.0f} s")


if __name__ == "__main__":
    main()
