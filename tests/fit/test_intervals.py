"""Intervals as a user asks for them: --intervals, in the table, the JSON and the report; and their coverage."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from command import Run
from synthetic import record, step

from ilg_circuit.errors import InputError
from ilg_circuit.fit.estimate import Parameter
from ilg_circuit.identify import identify, identify_spectrum, prepare_spectrum
from ilg_circuit.identify.report import interval_text
from ilg_circuit.strip.models import electrical_model

NAMES = ("dc_resistance", "dynamic_resistance", "capacitance")


@pytest.fixture(scope="module")
def csv(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(step(), 120.0, 121, rest=5, noise=0.01, seed=12).write(tmp_path_factory.mktemp("data") / "step.csv")


@pytest.mark.parametrize("method", ["bootstrap", "profile", "mcmc"])
def test_the_method_asked_for_is_in_table_json_and_report(method: str, csv: Path, run: Run) -> None:
    if method == "mcmc":
        pytest.importorskip("emcee")
    rc = ("--model", "rc", "--engine", "exact", "--intervals", method)
    done = run("identify", str(csv), *rc, "--json", "fit.json", "--report", "fit.html")
    assert done.code == 0, done.err
    assert {"bootstrap": "block bootstrap", "profile": "profile likelihood", "mcmc": "Markov chain"}[method] in done.out
    fit = json.loads(Path("fit.json").read_text())
    for name in NAMES:
        entry = fit["parameters"][name]
        assert entry["method"] == method
        low, high = entry[f"ci95_{method}"]
        assert low < entry["value"] < high
        # white residuals: all methods agree
        assert high - low == pytest.approx(entry["ci95"][1] - entry["ci95"][0], rel=0.25)
    assert f"({method})" in Path("fit.html").read_text(encoding="utf-8")


def test_the_covariance_is_the_default(csv: Path, run: Run) -> None:
    done = run("identify", str(csv), "--model", "rc", "--engine", "exact", "--json", "fit.json")
    assert done.code == 0, done.err
    entry = json.loads(Path("fit.json").read_text())["parameters"]["capacitance"]
    assert entry["method"] == "covariance"
    assert "ci95_profile" not in entry


@pytest.mark.parametrize("arguments", [("--intervals", "guess"), ("--intervals", "profile", "again.csv")])
def test_what_cannot_be_is_refused(arguments: tuple[str, ...], csv: Path, run: Run) -> None:
    Path("again.csv").write_text(csv.read_text())
    done = run("identify", str(csv), *arguments, "--model", "rc")
    assert done.code == 2
    assert "intervals" in done.err


def test_an_unknown_method_from_python(csv: Path) -> None:
    with pytest.raises(InputError, match="covariance, bootstrap, profile, mcmc"):
        identify(record(step(), 120.0, 121).measurement(), model="rc", intervals="guess")


def test_a_spectrum_s_profile() -> None:
    f = np.geomspace(1e-3, 1e3, 41)
    z = electrical_model("rc").port((233.0, 6.8, 0.02), 1.0).impedance(2j * np.pi * f, ideal=True)
    random = np.random.default_rng(4)
    noise = 1 + 0.005 * (random.standard_normal(41) + 1j * random.standard_normal(41))
    found = identify_spectrum(prepare_spectrum(f, z * noise), model="rc", electrode_resistance=1.0, intervals="profile")
    for name, truth in zip(NAMES, (233.0, 6.8, 0.02), strict=True):
        p = found.parameters[name]
        assert p.method == "profile"
        assert p.ci95_profile == pytest.approx(p.ci95, rel=0.01)
        assert p.ci95_profile is not None
        assert p.ci95_profile[0] < truth < p.ci95_profile[1]
    json.dumps(found.to_json(), allow_nan=False)


@pytest.mark.parametrize(
    ("ends", "text"),
    [((1.0, float("inf")), "1 ohm or more"), ((0.0, 2.0), "2 ohm or less"), ((0.0, float("inf")), "no limits")],
)
def test_open_ends_are_told_in_words(ends: tuple[float, float], text: str) -> None:
    p = Parameter(1.5, "ohm", 0.5, (1.0, 2.0), ci95_profile=ends, method="profile")
    assert interval_text(p) == text
    assert json.loads(json.dumps(p.to_json(), allow_nan=False))["ci95_profile"][0] == ends[0]


def _benchmark(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """benchmarks/intervals.py, whose trials these tests run fewer of."""
    path = Path(__file__).parents[2] / "benchmarks" / "intervals.py"
    monkeypatch.syspath_prepend(path.parent)
    spec = importlib.util.spec_from_file_location("benchmark_intervals", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("model", ["rc", "rc2"])
def test_ninety_five_percent_means_that(model: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 60 data sets 51 to 60 intervals hold the truth: less has a chance of 7e-4 if the 95 % are honest."""
    benchmark = _benchmark(monkeypatch)
    truth = benchmark.truth_of(model, benchmark.STEPS[model])
    found, failed = benchmark.coverage(benchmark.step_trial(model), truth, 60, seed=1, quiet=True)
    assert failed == 0
    assert all(part >= 51 / 60 for part in found.values()), found
