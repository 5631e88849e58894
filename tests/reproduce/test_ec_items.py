"""EC's items: every one agrees with what the paper's equations recompute to, to the digits given there."""

from __future__ import annotations

import pytest

from ilg_circuit.reproduce import ITEMS, Outcome, Reproduction, run
from ilg_circuit.reproduce.ec_sizes import at_rest, sized
from ilg_circuit.reproduce.ec_tables import coupling_of_curve, spread
from ilg_circuit.reproduce.published import table

EC = [item for item in ITEMS if item.id.startswith("EC-")]
#: Given, and nothing that a run could show.
INPUTS = {("ec_points", "voltage"), ("ec_points", "youngs_modulus")}


@pytest.fixture(scope="module")
def outcomes() -> dict[str, Outcome]:
    return {outcome.item.id: outcome for outcome in run(EC)}


def made(outcomes: dict[str, Outcome], name: str) -> Reproduction:
    found = outcomes[name].reproduction
    assert found is not None, outcomes[name].failure
    return found


@pytest.mark.parametrize("name", [item.id for item in EC])
def test_it_agrees(outcomes: dict[str, Outcome], name: str) -> None:
    assert outcomes[name].status != "fails", outcomes[name].to_dict()


def test_no_recomputed_number_is_left_out(outcomes: dict[str, Outcome]) -> None:
    shown = {(row.paper.table, row.paper.item) for name in outcomes for row in made(outcomes, name).rows}
    names = ("ec_table1", "ec_table2", "ec_table3", "ec_curves", "ec_points")
    wanted = {(row.table, row.item) for name in names for row in table(name) if row.recomputed}
    assert shown == wanted - INPUTS


@pytest.mark.parametrize("name", ["EC-F9", "EC-F10", "EC-F11", "EC-F12", "EC-F13"])
def test_every_figure_is_drawn(outcomes: dict[str, Outcome], name: str) -> None:
    figure = made(outcomes, name).figure
    assert figure is not None
    assert all("[" in panel.get_ylabel() for panel in figure.axes)
    assert "[" in figure.axes[-1].get_xlabel()


@pytest.mark.parametrize(
    ("name", "status"),
    [("EC-T2", "differs"), ("EC-T3", "differs"), ("EC-E39", "differs"), ("EC-F11", "agrees"), ("EC-F12", "agrees")],
)
def test_statuses(outcomes: dict[str, Outcome], name: str, status: str) -> None:
    assert outcomes[name].status == status


def test_force_and_constants_as_corrected(outcomes: dict[str, Outcome]) -> None:
    values = {row.paper.item: row.ours for name in outcomes for row in made(outcomes, name).rows}
    assert values["force_prefactor"] == pytest.approx(1.3935e-2, rel=5e-5)
    assert values["force_steady"] == pytest.approx(0.1751, rel=5e-4)
    assert values["displacement_maximum"] == pytest.approx(4.339, abs=5e-4)


def test_the_record_of_the_fitted_curves_can_be_identified(outcomes: dict[str, Outcome]) -> None:
    text = made(outcomes, "EC-T1").files["EC-curves.csv"]
    header, first, *_ = text.splitlines()
    assert header == "time_s,voltage_V,current_A,displacement_m"
    assert first == "0.0,0.0,0.0,0.0"
    assert len(text.splitlines()) == 1 + 5 + 401


def test_sizes_follow_the_closed_form() -> None:
    wide, narrow, long = at_rest([sized(width=9e-3), sized(width=3e-3), sized(free_length=60e-3)])
    assert wide == pytest.approx(narrow, rel=1e-9)
    assert long == pytest.approx(4 * narrow, rel=1e-6)
    thin, thick = at_rest([sized(thickness=0.25e-3), sized()], tip="clamped")
    assert thick == pytest.approx(2 * thin, rel=1e-6)


def test_the_curve_is_inverted() -> None:
    """EC (35)'s own coefficients, unrounded, give Table 3 back."""
    gain, zero, ratio, natural = 2.4448e-9, 0.2075, 0.6212, 0.0742
    damped = natural * (1 - ratio**2) ** 0.5
    steady = 4 * 10800 * gain * zero / natural**2
    sine = 4 * 10800 * gain * (zero * ratio - natural) / (natural * damped)
    found = coupling_of_curve(steady, sine, ratio * natural, damped)
    assert found == pytest.approx((gain, zero, ratio, natural), rel=1e-12)


def test_spread_of_rounded_numbers() -> None:
    off = spread(lambda a, b: [a + b, a - b, a * b], ["1.0", "20"], [1.0, 1.0])
    assert off == pytest.approx([0.55, 0.55, 1.05 * 20.5 - 20], rel=1e-12)
