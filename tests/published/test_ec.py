"""Every recomputed number of data/ec_*.csv remade by the package, to the digits given there.

What EC prints and cannot be right stays in the files with its reason; these tests say what is right instead.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from ilg_circuit.reproduce.published import Published, folder, half_a_digit, published, table
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import Response, simulate
from ilg_circuit.strip.actuator import PAPER, Coupling
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.units import parse

TABLES = ("ec_curves", "ec_points", "ec_table1", "ec_table2", "ec_table3")
ROWS = [row for name in TABLES for row in table(name)]
BOTH = [pytest.param(row, id=f"{row.table}-{row.item}") for row in ROWS if row.printed and row.recomputed]


@cache
def coupling() -> Coupling:
    assert PAPER.coupling is not None
    return PAPER.coupling


@cache
def static() -> Response:
    """EC (34) by ngspice: the massless strip under 4 V, fine enough to find the peak."""
    return simulate(PAPER, parse_drive("step:4V", 300.0), np.linspace(0, 300, 6001), beam="static")


@cache
def clamped() -> Response:
    return simulate(PAPER, parse_drive("step:4V", 300.0), np.linspace(0, 300, 601), beam="static", tip="clamped")


def fitted_current() -> tuple[float, float, float]:
    """a0, a1 [A] and lambda [1/s] read off the simulated current: two values of its decay, and its end."""
    current, step = static().current, static().time[1]
    a0 = current[-1]
    rate = np.log((current[0] - a0) / (current[200] - a0)) / (200 * step)
    return float(a0), float(current[0] - a0), float(rate)


def resistances() -> tuple[float, float, float]:
    """R_dc, R_d, C from the printed curve EC (30), R_e = 0."""
    return formulas.resistances_from_step(0.0060, 0.2058, 0.1470, 4.0)


def first_within(values: np.ndarray, end: float, margin: float) -> float:
    """Time [s] from which on values stay within the margin of the end."""
    return float(static().time[np.flatnonzero(np.abs(values - end) > margin)[-1] + 1])


#: file stem, item -> the package's value in SI units
MADE: dict[tuple[str, str], Callable[[], float]] = {
    ("ec_table1", "dc_resistance"): lambda: resistances()[0],
    ("ec_table1", "dynamic_resistance"): lambda: resistances()[1],
    ("ec_table1", "capacitance"): lambda: resistances()[2],
    ("ec_table1", "electrode_resistance"): lambda: lumped_elements(PAPER).port.electrode_resistance,
    ("ec_table1", "length"): lambda: PAPER.geometry.length,
    ("ec_table1", "free_length"): lambda: PAPER.geometry.free_length,
    ("ec_table1", "width"): lambda: PAPER.geometry.width,
    ("ec_table1", "thickness"): lambda: PAPER.geometry.thickness,
    ("ec_table2", "dc_resistivity"): lambda: resistances()[0] * 35e-3 * 5e-3 / 0.5e-3,
    ("ec_table2", "dynamic_resistivity"): lambda: resistances()[1] * 35e-3 * 5e-3 / 0.5e-3,
    ("ec_table2", "permittivity"): lambda: resistances()[2] * 0.5e-3 / (35e-3 * 5e-3),
    ("ec_table3", "coupling_gain"): lambda: coupling().gain,
    ("ec_table3", "coupling_zero"): lambda: coupling().zero,
    ("ec_table3", "coupling_damping_ratio"): lambda: coupling().damping_ratio,
    ("ec_table3", "coupling_natural_frequency"): lambda: coupling().natural_frequency,
    ("ec_curves", "step_current_steady"): lambda: fitted_current()[0],
    ("ec_curves", "step_current_decaying"): lambda: fitted_current()[1],
    ("ec_curves", "step_current_rate"): lambda: fitted_current()[2],
    ("ec_curves", "displacement_steady"): lambda: float(static().displacement[-1]),
    ("ec_curves", "displacement_cosine"): lambda: 4 * 10800 * coupling().static,
    ("ec_curves", "displacement_sine"): lambda: 4 * 10800 * coupling().gain * bracket_sine(),
    ("ec_curves", "displacement_decay"): lambda: coupling().damping_ratio * coupling().natural_frequency,
    ("ec_curves", "displacement_frequency"): lambda: damped_frequency(),
    ("ec_curves", "displacement_prefactor"): lambda: 3 * coupling().gain,
    ("ec_curves", "bracket_steady"): lambda: coupling().zero / coupling().natural_frequency ** 2,
    ("ec_curves", "bracket_sine"): lambda: bracket_sine(),
    ("ec_curves", "displacement_steady_factor"): lambda: 3 * coupling().static,
    ("ec_curves", "force_prefactor"): lambda: 3 / 4 * PAPER.material.youngs_modulus * coupling().gain,
    ("ec_curves", "force_steady_factor"): lambda: 3 / 4 * PAPER.material.youngs_modulus * coupling().static,
    ("ec_curves", "force_steady"): lambda: float(clamped().force[-1]),
    ("ec_points", "displacement_maximum"): lambda: float(static().displacement.max()),
    ("ec_points", "displacement_maximum_time"): lambda: float(static().time[static().displacement.argmax()]),
    ("ec_points", "displacement_steady"): lambda: float(static().displacement[-1]),
    ("ec_points", "displacement_steady_from"): lambda: first_within(
        static().displacement, float(static().displacement[-1]), 0.1e-3
    ),
    ("ec_points", "current_steady_from"): lambda: first_within(static().current, 0.006, 0.00006),
    ("ec_points", "voltage"): lambda: float(static().voltage[-1]),
    ("ec_points", "youngs_modulus"): lambda: PAPER.material.youngs_modulus,
}


def damped_frequency() -> float:
    return coupling().natural_frequency * float(np.sqrt(1 - coupling().damping_ratio ** 2))


def bracket_sine() -> float:
    """Coefficient of the sine in EC (36)."""
    k = coupling()
    return (k.zero * k.damping_ratio - k.natural_frequency) / (k.natural_frequency * damped_frequency())


def si(row: Published, text: str) -> float:
    """A number of a row in SI units."""
    return float(text) * row.si_factor


# -- the files themselves ----------------------------------------------------------------------------------------------


def test_all_files_are_there() -> None:
    assert sorted(path.stem for path in folder().glob("ec_*.csv")) == list(TABLES)


def test_every_recomputed_number_is_remade() -> None:
    assert {(row.table, row.item) for row in ROWS if row.recomputed} == set(MADE)
    assert len(ROWS) == len({(row.table, row.item) for row in ROWS})


@pytest.mark.parametrize("row", [pytest.param(r, id=f"{r.table}-{r.item}") for r in ROWS])
def test_rows_are_whole(row: Published) -> None:
    assert row.item
    assert row.where
    assert row.printed or row.recomputed
    for text in (row.printed, row.recomputed):
        assert text == "" or np.isfinite(float(text))
    if row.unit and row.unit != "%":
        parse(f"1 {row.unit}", row.unit)  # a unit that the package reads


@pytest.mark.parametrize("row", BOTH)
def test_what_differs_has_a_reason(row: Published) -> None:
    printed, recomputed = float(row.printed), float(row.recomputed)
    rounding = half_a_digit(row.printed) + half_a_digit(row.recomputed)
    if abs(printed - recomputed) > rounding * 0.5000001:
        assert row.reason, f"{row.item}: {printed} against {recomputed}"


# -- the numbers -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("row", [pytest.param(r, id=f"{r.table}-{r.item}") for r in ROWS if r.recomputed])
def test_recomputed(row: Published) -> None:
    made = MADE[row.table, row.item]()
    margin = abs(si(row, repr(half_a_digit(row.recomputed))))
    # the solver's own error is far below any digit given
    assert made == pytest.approx(si(row, row.recomputed), abs=margin * 1.000001, rel=0)


@pytest.mark.parametrize(
    ("stem", "item", "value"),
    [
        ("ec_table1", "dc_resistance", lambda: lumped_elements(PAPER).port.dc_resistance),
        ("ec_table1", "dynamic_resistance", lambda: lumped_elements(PAPER).port.dynamic_resistance),
        ("ec_table1", "capacitance", lambda: lumped_elements(PAPER).port.capacitance),
        ("ec_table2", "dc_resistivity", lambda: PAPER.material.dc_resistivity),
        ("ec_table2", "dynamic_resistivity", lambda: PAPER.material.dynamic_resistivity),
        ("ec_table2", "permittivity", lambda: PAPER.material.permittivity),
    ],
)
def test_the_preset_uses_the_recomputed_numbers(stem: str, item: str, value: Callable[[], float]) -> None:
    assert value() == pytest.approx(MADE[stem, item](), rel=1e-12)


# -- what the printed numbers say about themselves ---------------------------------------------------------------------


def printed(stem: str, item: str) -> float:
    return float(published(stem, item).printed)


def test_table_2_took_the_thickness_for_5_mm() -> None:
    wrong = 35e-3 * 5e-3 / 5e-3
    for resistance in ("dc_resist", "dynamic_resist"):
        lumped, specific = printed("ec_table1", f"{resistance}ance"), printed("ec_table2", f"{resistance}ivity")
        assert lumped * wrong == pytest.approx(specific, rel=1e-4)
    assert printed("ec_table1", "capacitance") / wrong == pytest.approx(printed("ec_table2", "permittivity"), rel=1e-4)


def test_equation_38_is_5_percent_high_and_39_takes_millimetres_for_metres() -> None:
    prefactor, bracket = printed("ec_curves", "force_prefactor"), printed("ec_curves", "bracket_steady")
    assert prefactor / (3 / 4 * 7600 * printed("ec_table3", "coupling_gain")) == pytest.approx(1.05, abs=1e-3)
    assert prefactor * bracket == pytest.approx(printed("ec_curves", "force_steady_factor"), rel=1e-4)
    right = 3 / 4 * PAPER.material.youngs_modulus * coupling().static
    assert printed("ec_curves", "force_steady_factor") / right == pytest.approx(1050, rel=1e-3)


def test_table_1_fits_no_electrode_resistance() -> None:
    """EC (30) with any Re > 0 would have given a lower R_d than Table 1 has."""
    for electrode in (0.001, 0.5, 5.0):
        _, dynamic, _ = formulas.resistances_from_step(0.0060, 0.2058, 0.1470, 4.0, electrode)
        assert dynamic < printed("ec_table1", "dynamic_resistance") - 0.9 * electrode


def test_the_fitted_curve_against_the_stated_points() -> None:
    """The fit's own residual: it misses the measured peak and rest by more than the coordinate paper's 0.1 mm."""
    y = static().displacement
    assert printed("ec_points", "displacement_maximum") - 1e3 * y.max() == pytest.approx(0.26, abs=0.01)
    assert printed("ec_points", "displacement_steady") - 1e3 * y[-1] == pytest.approx(0.22, abs=0.01)


@pytest.mark.parametrize("beam", ["static", "dynamic"])
@pytest.mark.parametrize("engine", ["ngspice", "exact"])
def test_curve_35_point_by_point(engine: str, beam: str) -> None:
    """EC (35) as printed, rounding and all, within what its four digits allow."""
    t = np.linspace(0, 300, 301)
    response = simulate(PAPER, parse_drive("step:4V", 300.0), t, beam=beam, engine=engine)
    curve = 3.9805 - np.exp(-0.0461 * t) * (3.9805 * np.cos(0.0581 * t) + 1.3392 * np.sin(0.0581 * t))
    # the dynamic beam lags by its own resonance, 1.39 rad/s
    assert 1e3 * response.displacement == pytest.approx(curve, abs=0.005 if beam == "static" else 0.1)


@pytest.mark.parametrize("engine", ["ngspice", "exact"])
def test_curve_30_point_by_point(engine: str) -> None:
    t = np.linspace(0, 300, 301)
    response = simulate(PAPER, parse_drive("step:4V", 300.0), t, engine=engine)
    assert response.current == pytest.approx(0.006 + 0.2058 * np.exp(-0.147 * t), abs=1e-6)
