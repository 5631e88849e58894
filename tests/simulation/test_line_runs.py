"""Runs of a strip with segments: several drives at once, by both engines; powers, symmetries, refusals."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import ilg_circuit as ilg
from ilg_circuit.drive import Drives, PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.simulation.drives import segment_drives
from ilg_circuit.simulation.response import Response
from ilg_circuit.strip.actuator import PAPER, Actuator, Electrodes

Array = np.ndarray

FOUR = replace(PAPER, electrodes=Electrodes(5.0, 2.0, segments_1=4, segments_2=4, cells=8))
SHEETS = {"sheet_resistance_1": 50.0, "sheet_resistance_2": 5.0}
MIXED = {1: "step:4V", 2: "square:-4V..4V,7s", 3: "sine:2V,0.1Hz", 4: "open"}


def run(strip: Actuator, drive: Any, until: str = "20 s", samples: int = 41, **how: Any) -> Response:
    return ilg.simulate(strip, drive, until, samples=samples, **{"engine": "exact", **how})


def apart(a: Array, b: Array) -> float:
    return float(np.abs(a - b).max() / np.abs(b).max())


@pytest.mark.parametrize(
    ("changes", "tolerance"),
    [({}, 1e-8), ({"emission_voltage": 1.5, "capacitance_slope": 0.2}, 1e-5)],
    ids=["linear", "nonlinear"],
)
def test_engines_agree_and_powers_balance(changes: dict[str, float], tolerance: float) -> None:
    strip = FOUR.with_(cells=4, **changes)
    found = run(strip, MIXED, engine="ngspice", accuracy=tolerance / 10)
    assert found.account.electrical_imbalance <= 1e-6
    assert found.account.mechanical_imbalance <= 1e-6
    assert set(found.account.dissipated) > {"Rsheet1", "Rsheet2", "Rd1"}
    if changes:
        ohmic = run(FOUR, MIXED).account.dissipated["Rdc"][-1]
        assert found.account.dissipated["Bdc"][-1] > 1.5 * ohmic
        return
    exact = run(strip, MIXED)
    assert exact.account.electrical_imbalance <= 1e-9
    for name in ("current", "charge", "displacement", "energy"):
        assert apart(found.waveforms[name], exact.waveforms[name]) <= tolerance
    for name in ("voltage_4", "current_1", "current_2", "current_3"):
        assert apart(found.segments[name], exact.segments[name]) <= tolerance
    assert apart(found.curvatures.values, exact.curvatures.values) <= tolerance
    assert not found.segments["current_4"].any()


def test_several_drives_are_the_sum_of_each_alone() -> None:
    drives = {1: "step:4V", 2: "sine:2V,0.1Hz", -3: "ramp:0.1V/s", "4:-1": "step:-1V"}
    whole, parts = run(FOUR, drives), [run(FOUR, {key: drive}) for key, drive in drives.items()]
    for name in ("current", "displacement", "charge"):
        assert apart(sum(part.waveforms[name] for part in parts), whole.waveforms[name]) <= 1e-9
    assert apart(sum(part.curvatures.values for part in parts), whole.curvatures.values) <= 1e-9
    for found in (whole, *parts):
        assert found.account.electrical_imbalance <= 1e-9


def test_four_segments_of_both_signs_without_sheet_resistance() -> None:
    strip = replace(PAPER, electrodes=replace(FOUR.electrodes, sheet_resistance_1=0.0, sheet_resistance_2=0.0))
    end = run(strip, {1: "step:4V", 2: "step:-4V", 3: "step:4V", 4: "step:-4V"}, "3000 s", 2, beam="static").curvatures
    turned = end.values[-1] * end.lengths
    middle = np.cumsum(turned) - turned / 2
    size = end.lengths * np.sinc(turned / 2 / np.pi)
    tip = 1e3 * (size * np.cos(middle)).sum(), 1e3 * (size * np.sin(middle)).sum()
    assert tip == (pytest.approx(29.97800, abs=6e-6), pytest.approx(0.99476, abs=6e-6))


@pytest.mark.parametrize("others", [4, 1])
def test_all_segments_alike_are_one_electrode(others: int) -> None:
    sheets = Electrodes(0.0, 0.0, segments_1=4, segments_2=others)
    one = run(replace(PAPER, electrodes=Electrodes(0.0, 0.0, cells=4)), "step:4V")
    strip = replace(PAPER, electrodes=sheets)
    for drive in ("step:4V", dict.fromkeys((1, 2, 3, 4), "step:4V")):
        found = run(strip, drive)
        for name in ("current", "charge", "displacement", "energy"):
            assert apart(found.waveforms[name], one.waveforms[name]) <= 1e-9
        assert np.ptp(found.curvatures.values[-1]) <= 1e-9 * found.curvatures.values.max()
        assert apart(sum(found.segments[f"current_{k}"] for k in (1, 2, 3, 4)), one.current) <= 1e-9


def test_reversal_by_mirror() -> None:
    """Wired at their middles, with no clamped part, the segments in reverse order give the curvatures in reverse."""
    geometry = replace(PAPER.geometry, length=30e-3)
    strip = replace(FOUR, geometry=geometry, electrodes=replace(FOUR.electrodes, contact="each", gap=0.5e-3))
    levels = ("step:4V", "step:-1V", "sine:2V,0.1Hz", "open")
    there, back = (run(strip, dict(enumerate(order, 1)), beam="static") for order in (levels, levels[::-1]))
    assert apart(there.curvatures.values, back.curvatures.values[:, ::-1]) <= 1e-9
    assert np.array_equal(there.curvatures.lengths, back.curvatures.lengths[::-1]) or np.allclose(
        there.curvatures.lengths, back.curvatures.lengths[::-1], rtol=1e-9
    )


def test_undriven_segments_are_short_circuited_and_open_ones_follow() -> None:
    leaking = replace(FOUR, electrodes=replace(FOUR.electrodes, gap=0.5e-3, gap_resistance=50.0))
    held = run(leaking, {1: "step:4V"})
    left = run(leaking, {1: "step:4V", 2: "open", 3: "open", 4: "open"})
    assert np.abs(held.segments["voltage_2"]).max() == 0
    assert np.abs(held.segments["current_2"]).max() > 0.05
    assert 4 > left.segments["voltage_2"][-1] > left.segments["voltage_4"][-1] > 0.1
    assert not left.segments["current_2"].any()


def test_error_of_the_cells_is_stated() -> None:
    few, many = (run(replace(PAPER, electrodes=Electrodes(5.0, 5.0, cells=n)), "step:4V") for n in (5, 40))
    actual = max(apart(few.waveforms[name], many.waveforms[name]) for name in ("current", "displacement", "charge"))
    assert actual < few.cells_error < 3 * actual
    assert few.error >= few.cells_error
    chosen = run(replace(PAPER, electrodes=Electrodes(5.0, 5.0)), "step:4V")
    assert chosen.cells_error <= 1e-3
    assert 5 < len(chosen.curvatures.lengths) < 80


def test_impedance_of_joined_terminals_and_of_a_segment() -> None:
    """Without sheet resistance each segment has its part of the strip, the first one the clamped part too."""
    strip = replace(PAPER, electrodes=replace(FOUR.electrodes, sheet_resistance_1=0.0, sheet_resistance_2=0.0))
    lump = ilg.impedance(PAPER, frequency=[0.1], engine="exact").impedance
    assert ilg.impedance(strip, frequency=[0.1], engine="exact").impedance == pytest.approx(lump, rel=1e-9)
    for segment, part in ((1, 12.5), (3, 7.5)):
        found = ilg.impedance(strip, frequency=[0.1], segment=segment, engine="exact")
        assert found.impedance == pytest.approx(lump * 35 / part, rel=1e-9)
    gapped = FOUR.with_(gap="0.5 mm")
    checked = ilg.impedance(gapped, "1 mHz", "10 Hz", segment=2, points=3, check=True)
    assert [row.reference for row in checked.checks] == ["exact engine", "its nodes"]
    assert all(row.value < 1e-8 for row in checked.checks)


def test_table_and_data_of_a_run() -> None:
    found = run(FOUR, {2: "step:4V", 1: "step:-4V"}, samples=3)
    columns = list(found.columns())
    ports = [f"{q}_{k}_{u}" for k in (1, 2, 3, 4) for q, u in (("voltage", "V"), ("current", "A"))]
    assert columns[-13:] == [*ports, *(f"curvature_{k}_1/m" for k in (1, 2, 3, 4)), "angle_rad"]
    assert found.voltage == pytest.approx([4.0] * 3)
    assert found.current == pytest.approx(found.segments["current_1"] + found.segments["current_2"])
    assert np.shape(found.to_dict()["curvatures"]["values_1_per_m"]) == (3, 8)
    assert isinstance(found.drive, Drives)
    assert found.drive.text == "2 = step 4 V; 1 = step -4 V"


def test_band_and_check_of_a_run() -> None:
    from ilg_circuit.strip.actuator import Uncertainty

    fitted = Uncertainty("rc", ("capacitance", "coupling_gain"), ((1e-4, 0.0), (0.0, 4e-4)), 4.0)
    found = run(replace(FOUR, uncertainty=fitted), {1: "step:4V"}, samples=5, band=True, check=True)
    assert found.stderr["displacement"][-1] == pytest.approx(0.02 * abs(found.displacement[-1]), rel=1e-3)
    assert {row.reference for row in found.checks} == {"ngspice engine"}
    assert all(row.agrees for row in found.checks)


def test_drives_of_segments_as_texts() -> None:
    assert segment_drives(["file:a=b.csv"]) == "file:a=b.csv"
    assert segment_drives(["1=step:4V", " 3:-1 = open", "-2=file:a=b.csv"]) == {
        "1": "step:4V", "3:-1": "open", "-2": "file:a=b.csv",
    }  # fmt: skip
    for texts, told in ((["1=step:4V", "step:4V"], "say of which segment"), (["1=open", "1=step:1V"], "two drives")):
        with pytest.raises(InputError, match=told):
            segment_drives(texts)


@pytest.mark.parametrize(
    ("strip", "drive", "told"),
    [
        (PAPER, {1: "step:4V"}, "has no [electrodes], so no segments"),
        (FOUR, {5: "step:4V"}, "segment '5' is not there: side 1 has 4 segments, 1 to 4"),
        (FOUR, {}, "no segment is driven"),
        (FOUR, {1: "step:4"}, "step"),
        (FOUR, {2: "step:1V", 1: "current:10mA"}, "segment 1 is driven by a current"),
        (FOUR, {1: "step:4V", 2: PiecewiseLinear.step(1.0).resting(1.0)}, "start from 0 V"),
    ],
)
def test_what_is_refused(strip: Actuator, drive: Any, told: str) -> None:
    with pytest.raises(InputError, match=re.escape(told)) as caught:
        run(strip, drive)
    assert "\n" not in str(caught.value)


def test_more_that_is_refused() -> None:
    for call, told in (
        (lambda: ilg.impedance(PAPER, segment=1), "no segments; leave segment out"),
        (lambda: ilg.impedance(FOUR, segment=9), "not there"),
        (lambda: ilg.sense(FOUR, "sine:1mm,0.1Hz", "10 s"), "sensing is for a strip that is one lump"),
        (lambda: run(FOUR, {1: "step:4V"}, compare="run.csv"), "leave compare out"),
        (lambda: ilg.impedance(FOUR.with_(emission_voltage=1.0), bias=1.0), "not the same in all cells"),
    ):
        with pytest.raises(InputError, match=re.escape(told)):
            call()


def test_sheets_of_next_to_no_resistance_are_of_none() -> None:
    bare = run(FOUR.with_(sheet_resistance_1=0.0, sheet_resistance_2=0.0), MIXED)
    for sheet in (1e-9, 1e-6):
        found = run(FOUR.with_(sheet_resistance_1=sheet, sheet_resistance_2=0.0), MIXED)
        assert apart(found.displacement, bare.displacement) <= 1e-6
        assert found.account.electrical_imbalance <= 1e-6


def test_coarse_cells_are_told() -> None:
    coarse, fine = (run(PAPER.with_(electrodes=SHEETS | {"cells": n}), "step:4V", samples=2) for n in (3, 40))
    assert any("3 cells of the line move currents or displacement by up to" in told for told in coarse.warnings)
    assert not any("cells" in told for told in fine.warnings)
