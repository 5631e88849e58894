"""Spectra by several models, beside pyimpspec in one run: how long, and how often the answer is the right one.

pyimpspec is called as its documentation does, which tries every method and weighting it has (on all cores), and with
one method, least squares weighted by modulus, as ours. A fit is right if what a spectrum's own model leaves is noise.
Prints a table and writes it to SPECTRA.md.

python benchmarks/spectra.py
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
from figure import Figure
from machine import conditions
from numpy.typing import NDArray

from ilg_circuit.identification import identify_each
from ilg_circuit.strip.models import electrical_model

RESULTS = Path(__file__).with_name("SPECTRA.md")
PACKAGES = ("ilg-circuit", "pyimpspec", "lmfit", "numpy")

MODELS = {
    "rc": (233.0, 6.8, 0.02),
    "rc2": (400.0, 20.0, 0.01, 100.0, 0.02),
    "warburg": (300.0, 10.0, 50.0, 2.0),
    "cpe": (1000.0, 10.0, 0.02, 0.8),
}
#: The same circuits in pyimpspec's notation: () parallel, [] series, Wo a finite Warburg element with an open end.
CODES = {"rc": "(R[RC])", "rc2": "(R[RC][RC])", "warburg": "(R[RWo])", "cpe": "(R[RQ])"}
SPECTRA, POINTS, NOISE, LIMIT = 20, 61, 0.005, 20.0
#: pyimpspec's default takes minutes for all; so many are measured and scaled.
SLOW_SPECTRA = 4
#: Beyond this many times the noise a fit has missed.
MISSED = 1.5


@dataclass(frozen=True)
class Row:
    """One way's batch: seconds for ``spectra`` by every model, and to how many of them their own model was fitted."""

    way: str
    seconds: float
    right: int
    spectra: int


def write_spectra(folder: Path) -> list[Path]:
    """Files of noisy spectra, the four models in turn, each parameter spread by 20 %."""
    random = np.random.default_rng(1)
    f = np.geomspace(1e-3, 1e4, POINTS)
    paths = []
    for k in range(SPECTRA):
        name = tuple(MODELS)[k % len(MODELS)]
        factors = np.exp(0.2 * random.standard_normal(len(MODELS[name])))
        limits = [p.upper for p in electrical_model(name).parameters]
        values = [min(v * x, 0.95 * b) for v, x, b in zip(MODELS[name], factors, limits, strict=True)]
        z = electrical_model(name).port(values).impedance(2j * np.pi * f, ideal=True)
        z = z * (1 + NOISE * (random.standard_normal(POINTS) + 1j * random.standard_normal(POINTS)))
        rows = [f"{a!r},{b.real!r},{b.imag!r}" for a, b in zip(f.tolist(), z.tolist(), strict=True)]
        paths.append(folder / f"{k}_{name}.csv")
        paths[-1].write_text("\n".join(["frequency_Hz,re_ohm,im_ohm", *rows]) + "\n")
    return paths


def own_model(path: Path) -> str:
    """The model that a file's spectrum was made of."""
    return path.stem.partition("_")[2]


def ours(paths: list[Path]) -> Row:
    """Every spectrum by every model, by `identify_each`."""
    begin = perf_counter()
    outcomes = identify_each(paths, tuple(MODELS))
    seconds = perf_counter() - begin
    rms = [o.result.statistics["relative_rms"] for o in outcomes if o.result and o.model == own_model(o.path)]
    return Row("ilg_circuit", seconds, sum(x <= MISSED * NOISE for x in rms), len(paths))


def theirs(paths: list[Path], method: str, weight: str) -> Row:
    """The same by pyimpspec."""
    from pyimpspec import DataSet, fit_circuit, parse_cdc

    data = []
    for path in paths:
        f, re, im = np.loadtxt(path, delimiter=",", skiprows=1, unpack=True)
        data.append((own_model(path), DataSet(f[::-1], (re + 1j * im)[::-1])))
    right = 0
    begin = perf_counter()
    for own, spectrum in data:
        for model, code in CODES.items():
            found = fit_circuit(parse_cdc(code), spectrum, method=method, weight=weight)
            if model == own:
                right += rms_over_modulus(found.get_impedances(), spectrum.get_impedances()) <= MISSED * NOISE
    how = "its default" if method == "auto" else f"{method}, {weight}"
    return Row(f"pyimpspec, {how}", perf_counter() - begin, right, len(paths))


def rms_over_modulus(fitted: NDArray[np.complex128], measured: NDArray[np.complex128]) -> float:
    """What a fit leaves: rms of real and imaginary parts, each relative to abs(Z)."""
    relative = (fitted - measured) / np.abs(measured)
    return float(np.sqrt(np.mean(np.concatenate([relative.real, relative.imag]) ** 2)))


def markdown(rows: list[Row]) -> str:
    """The page: conditions, table, notes."""
    lines = ["# Spectra beside pyimpspec", "", "Written by `python benchmarks/spectra.py`.", ""]
    lines += [*conditions(PACKAGES), "", "| | a spectrum, s | over ours | own model found |", "|---|---|---|---|"]
    each = [r.seconds / r.spectra for r in rows]
    lines += [
        f"| {r.way} | {seconds:.2f} | {seconds / each[0]:.1f} | {r.right} of {r.spectra} |"
        for r, seconds in zip(rows, each, strict=True)
    ]
    return "\n".join(
        [
            *lines,
            "",
            f"- {SPECTRA} spectra of {POINTS} points, 1 mHz to 10 kHz, {NOISE:.1%} noise, by {len(MODELS)} models "
            f"each: {rows[0].seconds:.1f} s for all of ours, the Kramers-Kronig check included.",
            f"- Found: what the spectrum's own model leaves is noise, at most {MISSED} times of it.",
            "",
        ]
    )


def main() -> list[Figure]:
    """Measure, print and write the table; fail where ours misses a model or is slow."""
    with tempfile.TemporaryDirectory() as folder:
        paths = write_spectra(Path(folder))
        rows = [
            ours(paths),
            theirs(paths, "least_squares", "modulus"),
            theirs(paths[:SLOW_SPECTRA], "auto", "auto"),
        ]
    page = markdown(rows)
    RESULTS.write_text(page, encoding="utf-8")
    print(page)
    if rows[0].right < SPECTRA:
        raise SystemExit("a spectrum was not fitted by its own model")
    if rows[0].seconds > LIMIT:
        raise SystemExit(f"slower than {LIMIT:.0f} s")
    each = [f"{r.seconds / r.spectra:.2f} s a spectrum, {r.right} of {r.spectra} found" for r in rows]
    peers = "; ".join(f"{r.way}: {told}" for r, told in zip(rows[1:], each[1:], strict=True))
    return [Figure(f"{SPECTRA} spectra by {len(MODELS)} models", f"{rows[0].seconds:.1f} s: {each[0]}", peers)]


if __name__ == "__main__":
    main()
