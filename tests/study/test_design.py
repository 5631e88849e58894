"""Designs against closed forms: a static strip's free displacement 3 d0 U L_F^2/b^2, blocked force E w b^3/(4 L_F^3)
times that; what binds and by how much; wishes that cannot be met."""

from dataclasses import replace

import numpy as np
import pytest

from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.study.constraints import active_constraints, without_each_requirement
from ilg_circuit.study.parameters import ScenarioTemplate
from ilg_circuit.study.problem import Design, DesignProblem, Objective, best_design
from ilg_circuit.study.requirements import GUARD, parse_requirements, quantity
from ilg_circuit.study.space import Space, parse_ranges, resolve_engine

pytestmark = pytest.mark.usefixtures("brisk")

#: Long enough for d(s) to have come to rest: exp(-0.046 * 600) is 1e-12.
STATIC = ScenarioTemplate(PAPER, "step:4V", 600.0, beam="static")
SIZES = ("thickness=0.2mm:1mm", "free_length=15mm:40mm")
D0 = PAPER.coupling.static if PAPER.coupling else np.nan
E, W = PAPER.material.youngs_modulus, PAPER.geometry.width


def problem(
    requirements: list[str],
    varied: tuple[str, ...],
    aim: str = "",
    template: ScenarioTemplate = STATIC,
    engine: str = "auto",
    seed: int = 0,
) -> DesignProblem:
    ranges, fixed = parse_ranges(varied)
    space = Space(template, ranges, fixed, resolve_engine(template, ranges, fixed, engine))
    sense, name = (1 if aim.startswith("min") else -1), aim.partition(" ")[2]
    objective = Objective(quantity(name, space.names), sense) if aim else None
    return DesignProblem(space, parse_requirements(requirements, space.names, template.actuator), objective, seed)


def design(*arguments: object, **more: object) -> Design:
    return best_design(problem(*arguments, **more))  # type: ignore[arg-type]


def test_least_voltage_for_a_displacement() -> None:
    """U = y b^2/(3 d0 L^2), least at the thinnest and longest."""
    found = design(["displacement_final>=4mm"], (*SIZES, "voltage=0.01V:4V"), "min voltage")
    least = 4e-3 * 0.2**2 / (3 * D0 * 40**2)
    assert found.feasible
    assert found.values["voltage"] == pytest.approx(least * (1 + GUARD), rel=1e-4)
    assert found.values == pytest.approx({"thickness": 0.2e-3, "free_length": 40e-3, "voltage": least}, rel=2e-4)
    assert found.search.agreeing == len(found.search.ends)
    assert 4e-3 < found.simulated["displacement_final"] < 4e-3 * (1 + 3 * GUARD)


def test_largest_margin_where_displacement_and_force_trade() -> None:
    """y F^2 = (3 d0 U)^3 (E w/4)^2 whatever the sizes: the same factor over both limits."""
    found = design(["displacement_final>=4mm", "force_blocked>=0.1uN"], SIZES)
    constant = (12 * D0) ** 3 * (E * W / 4) ** 2
    factor = (constant / (4e-3 * 1e-14)) ** (1 / 3)
    assert found.worst_margin == pytest.approx(factor - 1, abs=1e-4)
    assert [found.margin(r) for r in found.problem.requirements] == pytest.approx([factor - 1] * 2, abs=1e-4)
    # only L/b matters, so the design is not unique and the search says so
    assert found.search.spread.max() > 0.1


def test_multipliers_are_the_closed_form_s() -> None:
    """Least energy for y and F: U^2 w/b is fixed by y F, and so is energy but for L/(L + clamped part)."""
    found = design(
        ["displacement_final>=4mm", "force_blocked>=0.1uN"], (*SIZES, "voltage=0.1V:4V", "width=2mm:10mm"), "min energy"
    )
    assert found.feasible
    gains = {limit.text: limit.gain for limit in active_constraints(found)}
    assert gains["displacement_final >= 4 mm"] == pytest.approx(0.01, abs=3e-4)
    assert gains["force_blocked >= 100 nN"] == pytest.approx(0.01, abs=3e-4)
    # (L + 5 mm)/L at 40 mm and 40.4 mm; the transient charge, C U^2, goes the same way
    assert gains["free_length <= 40 mm"] == pytest.approx(1 - (45.4 / 40.4) / (45 / 40), rel=0.02)
    assert all(not limit.binds for limit in active_constraints(found) if limit.text.startswith(("width", "voltage")))


def test_equality_and_an_end_of_a_range() -> None:
    found = design(["displacement_final=4mm"], (*SIZES, "voltage=1V:4V"), "max force_blocked")
    # F = 3 d0 U E w b/(4 L), b/L fixed by y: F rises with U
    ratio = np.sqrt(12 * D0 / 4e-3)
    assert found.feasible
    assert found.values["voltage"] == pytest.approx(4.0, rel=1e-6)
    assert found.values["thickness"] / found.values["free_length"] == pytest.approx(ratio, rel=6e-4)
    assert {limit.parameter for limit in active_constraints(found) if limit.binds} >= {"voltage", None}


def test_wishes_that_cannot_be_met() -> None:
    found = design(["displacement_final>=4mm", "force_blocked>=0.3uN", "settling_time<=60s"], (*SIZES, "voltage=1V:4V"))
    constant = (12 * D0) ** 3 * (E * W / 4) ** 2
    factor = (constant / (4e-3 * 9e-14)) ** (1 / 3)
    assert not found.feasible
    assert found.worst_margin == pytest.approx(factor - 1, abs=1e-4)
    binding = {limit.text for limit in active_constraints(found) if limit.binds}
    assert binding == {"displacement_final >= 4 mm", "force_blocked >= 300 nN", "voltage <= 4 V"}
    without = {o.requirement.quantity.name: o.margin for o in without_each_requirement(found)}
    assert without["settling_time"] == pytest.approx(found.worst_margin, abs=1e-3)
    low, high = found.reach["settling_time"]
    assert high - low < 1e-3 * high  # a static strip settles as its coupling does, whatever its size
    assert max(without["displacement_final"], without["force_blocked"]) == pytest.approx(60 / low - 1, abs=1e-3)


def test_one_of_two_requirements_stands_in_the_way() -> None:
    found = design(["displacement_final>=4mm", "energy<=1mJ"], SIZES)
    assert not found.feasible
    without = {o.requirement.quantity.name: o.margin for o in without_each_requirement(found)}
    assert without["energy"] > 0
    assert without["displacement_final"] < 0  # 1 mJ is too little for any size


def test_the_answer_is_what_simulate_gives() -> None:
    """A full strip, simulated by ngspice as a user would, does what was required."""
    template = ScenarioTemplate(PAPER, "step:4V", 300.0)
    found = design(
        ["displacement_peak>=5mm", "current_peak<=0.15A", "valid"], (*SIZES, "voltage=1V:4V"), "min energy", template
    )
    run = simulate(
        found.scenario.actuator, parse_drive(f"step:{found.values['voltage']!r}V", 300.0), np.linspace(0, 300, 6001)
    )
    assert found.feasible
    assert run.displacement.max() == pytest.approx(found.simulated["displacement_peak"], rel=1e-5)
    assert run.displacement.max() >= 5e-3
    assert run.current.max() <= 0.15
    assert found.difference < 1e-5


def test_a_nonlinear_strip_is_searched_by_ngspice() -> None:
    """Charge q = C U (1 + k U/2) of a capacitance that grows with voltage; C = eps L w/b."""
    strip = replace(PAPER, coupling=None, material=replace(PAPER.material, capacitance_slope=0.1))
    found = design(["charge_final>=1C"], ("voltage=0.5V:4V",), "min voltage", ScenarioTemplate(strip, "step:4V", 150.0))
    assert found.problem.space.engine == "ngspice"
    voltage = (np.sqrt(1 + 2 * 0.1 * (1 + GUARD) / 0.35) - 1) / 0.1
    assert found.values["voltage"] == pytest.approx(voltage, rel=2e-4)
    assert found.feasible


def test_the_same_seed_gives_the_same_design() -> None:
    asked = (["displacement_final>=4mm", "force_blocked>=0.1uN"], SIZES)
    first, second, other = design(*asked), design(*asked), design(*asked, seed=7)
    assert first.values == second.values
    assert other.worst_margin == pytest.approx(first.worst_margin, abs=1e-4)


def test_what_cannot_be_judged_is_told() -> None:
    strip = replace(PAPER, coupling=None)
    with pytest.raises(SolveError, match="no coupling"):
        design(["displacement_final>=4mm"], SIZES, template=replace(STATIC, actuator=strip))
    with pytest.raises(InputError, match="can be"):
        design(["energy<=1J"], ("free_length=50mm:90mm", "length=1mm:20mm"))
    with pytest.raises(InputError, match="linear circuits only"):
        design(["energy<=1J"], (*SIZES, "capacitance_slope=0.1 1/V"), engine="exact")


def test_a_displacement_of_the_wrong_sign_is_far_from_any_right_one() -> None:
    found = design(["displacement_final>=4mm"], ("voltage=-4V:-1V",))
    assert not found.feasible
    assert found.values["voltage"] == pytest.approx(-1.0)
    assert -1 < found.worst_margin < -0.9
    mirrored = design(["displacement_final<=-4mm"], ("voltage=-4V:4V", "thickness=0.2mm:1mm"), "min energy")
    assert mirrored.feasible
    assert mirrored.values["voltage"] < 0
