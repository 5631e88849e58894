"""Uncertainty of a fit at a design, against closed forms; Sobol indices against Ishigami's function and powers."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm
from test_design import SIZES, STATIC, design, problem

from ilg_circuit.errors import InputError
from ilg_circuit.strip.actuator import PAPER, Uncertainty
from ilg_circuit.study.sensitivity import confident_design, indices, sensitivity, sobol_indices

pytestmark = pytest.mark.usefixtures("brisk")

NAMES = ("coupling_gain", "coupling_zero", "dc_resistance", "dynamic_resistance", "capacitance")
_SPREAD = np.array([0.03, 0.04, 0.02, 0.01, 0.01])
_CORRELATION = np.eye(5)
_CORRELATION[0, 1] = _CORRELATION[1, 0] = -0.5
COVARIANCE = _CORRELATION * np.outer(_SPREAD, _SPREAD)
FITTED = replace(PAPER, uncertainty=Uncertainty("rc", NAMES, tuple(map(tuple, COVARIANCE.tolist()))))
BASE = replace(STATIC, actuator=FITTED)
#: d0 = Kd Zd/wn'^2, so the logarithm of a static displacement has the variance of Kd's and Zd's sum.
_DISPLACEMENT = float(np.sqrt(0.03**2 + 0.04**2 - 2 * 0.5 * 0.03 * 0.04))
ASKED = (["displacement_final>=4mm", "thickness<=0.9mm"], SIZES, "min energy")


def test_errors_and_probabilities_are_the_closed_forms() -> None:
    found = sensitivity(design(*ASKED, template=BASE))
    assert found.stderr["displacement_final"] == pytest.approx(4e-3 * _DISPLACEMENT, rel=1e-3)
    assert found.shares["displacement_final"]["coupling_zero"] == pytest.approx(16 / 25, abs=1e-4)
    assert found.matters_most("displacement_final") == "coupling_zero"
    assert found.matters_most("energy") == "dc_resistance"
    # at the edge of its requirement a design meets it every other time
    assert found.met["displacement_final >= 4 mm"] == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(found.drawn))
    assert found.met["thickness <= 900 um"] == 1.0
    assert found.failed == 0


def test_a_design_with_confidence() -> None:
    found = confident_design(problem(*ASKED, template=BASE), 0.95)
    reserve = norm.ppf(0.95) * _DISPLACEMENT
    assert found.feasible
    assert found.margin(found.problem.requirements[0]) == pytest.approx(np.expm1(reserve), rel=5e-3)
    sure = sensitivity(found)
    assert sure.all_met == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / sure.drawn))


def test_without_a_fit_there_is_nothing_to_carry() -> None:
    with pytest.raises(InputError, match="no \\[uncertainty\\]"):
        sensitivity(design(*ASKED))
    varied = problem(["displacement_final>=4mm"], ("dc_resistivity=100ohm m:200ohm m",), template=BASE)
    with pytest.raises(InputError, match="neither material nor coupling"):
        confident_design(varied, 0.95)
    with pytest.raises(InputError, match="50% or more"):
        confident_design(problem(*ASKED, template=BASE), 0.3)


def test_ishigami() -> None:
    a, b, pi = 7.0, 0.1, np.pi

    def function(points: np.ndarray) -> np.ndarray:
        x = pi * (2 * points - 1)
        y = np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0])
        return np.stack([y, np.ones(len(y))], axis=1)

    found = indices(function, ("x1", "x2", "x3"), ("ishigami", "constant"), samples=2048, seed=1)
    first, second = 0.5 * (1 + b * pi**4 / 5) ** 2, a**2 / 8
    crossed = b**2 * pi**8 * (1 / 18 - 1 / 50)
    total = first + second + crossed
    assert found.first[0] == pytest.approx([first / total, second / total, 0.0], abs=0.02)
    assert found.total[0] == pytest.approx([(first + crossed) / total, second / total, crossed / total], abs=0.02)
    assert np.isnan(found.first[1]).all()
    assert (found.total_error[0] < 0.1).all()


def test_indices_of_a_static_displacement() -> None:
    """y ~ U L^2/b^2, each even in its logarithm: a product of independent factors, whose indices are closed forms."""
    asked = problem(["displacement_final>=4mm"], ("thickness=0.5mm:1mm", "free_length=20mm:30mm", "voltage=2V:4V"))
    found = sobol_indices(asked.space, asked.quantities, samples=512, seed=2)
    parts = []
    for power, ratio in ((-2, 2.0), (2, 1.5), (1, 2.0)):
        reach = power * np.log(ratio)  # factor exp(reach u), u even on [0, 1]
        mean, square = np.expm1(reach) / reach, np.expm1(2 * reach) / (2 * reach)
        parts.append(square / mean**2 - 1)
    variance = np.prod([1 + v for v in parts]) - 1
    assert found.first[0] == pytest.approx([v / variance for v in parts], abs=0.03)
    totals = [v * np.prod([1 + w for w in parts]) / (1 + v) / variance for v in parts]
    assert found.total[0] == pytest.approx(totals, abs=0.03)


def test_samples_are_a_power_of_two() -> None:
    with pytest.raises(InputError, match="power of two"):
        indices(lambda points: points, ("x",), ("y",), samples=100)
