"""What is wrong with a record is told, with its size; what is right is left alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from synthetic import Synthetic, drives, ready, record, step

from ilg_circuit.measurements.kind import RECORD
from ilg_circuit.measurements.read import read_columns
from ilg_circuit.measurements.record import Record
from ilg_circuit.strip.actuator import PAPER

Array = NDArray[np.float64]
DRIVES = drives(4.0)
RESISTIVE = replace(PAPER, material=replace(PAPER.material, permittivity=1e-5))


def notes(measurement: Record, word: str) -> list[str]:
    return [str(note) for note in measurement.notes if word in str(note)]


# -- clipping ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("noise", [0.0, 0.003, 0.02])
@pytest.mark.parametrize("resolution", [0.0, 1e-3, 1e-2])
@pytest.mark.parametrize("name", DRIVES)
def test_nothing_is_found_where_nothing_is_clipped(name: str, noise: float, resolution: float) -> None:
    r = record(DRIVES[name], 300.0, 1201, noise=noise, rest=20, seed=1)
    if resolution:
        r = r.changed(current=np.round(r.columns["current"] / resolution) * resolution)
    assert notes(r.measurement(), "clipped") == []


@pytest.mark.parametrize("name", DRIVES)
def test_the_plateau_of_a_resistor_is_the_voltages(name: str) -> None:
    assert notes(record(DRIVES[name], 300.0, 1201, rest=20, strip=RESISTIVE).measurement(), "clipped") == []


@pytest.mark.parametrize(("name", "limits"), [("step", [50]), ("square", [50, -50]), ("sine", [50, -50])])
def test_every_flat_top_is_found_and_its_level_told(name: str, limits: list[int]) -> None:
    r = record(DRIVES[name], 300.0, 1201, noise=0.003, rest=20, seed=1)
    current = np.clip(r.columns["current"], -0.05, 0.05)
    m = r.changed(current=current).measurement()
    found = notes(m, "clipped")
    assert [note.split(":")[0] for note in found] == [f"current is clipped at {limit} mA" for limit in limits]
    assert len(current) - len(m.current.values) == pytest.approx((np.abs(current) >= 0.05).sum(), abs=8)


@pytest.fixture
def ipmc(shared_data: Callable[[str], Path]) -> Callable[..., Record]:
    table = read_columns(shared_data("ipmc_step/step_1V5.csv"), RECORD)

    def changed(change: Callable[[Array], Array], quantity: str = "current") -> Record:
        return ready(replace(table, columns={**table.columns, quantity: change(table.columns[quantity])}))

    return changed


@pytest.mark.parametrize("limit", [1, 2, 4, 8, 12, 16])
def test_a_measured_step_clipped_anywhere(ipmc: Callable[..., Record], limit: int) -> None:
    (note,) = notes(ipmc(lambda i: np.clip(i, -1.0, 1e-3 * limit)), "clipped")
    assert f"at {limit} mA" in note


def test_a_limit_may_be_noisy(ipmc: Callable[..., Record]) -> None:
    random = np.random.default_rng(3)

    def limited(i: Array) -> Array:
        return np.where(i > 12e-3, 12e-3 + 2e-5 * random.standard_normal(len(i)), i)

    (note,) = notes(ipmc(limited), "clipped")
    assert "at 11.99 mA" in note or "at 12" in note


def test_a_measured_step_as_it_is_and_rounded(ipmc: Callable[..., Record]) -> None:
    for digits in (6, 4, 3):
        assert notes(ipmc(lambda i, digits=digits: np.round(i, digits)), "clipped") == []


# -- drop-outs ---------------------------------------------------------------------------------------------------------


def moved(change: Callable[[Array], Array]) -> tuple[Record, int]:
    r = record(step(), 300.0, 301, rest=20, displacement=True, noise=0.003, rest_position=5e-3, seed=1)
    y = r.columns["displacement"].copy()
    changed = change(y)
    return r.changed(displacement=changed).measurement(), int((changed != r.columns["displacement"]).sum())


@pytest.mark.parametrize("sign", [np.nan, 0.0, 99.99e-3, -1.0])
def test_a_sensors_word_for_nothing_is_no_position(sign: float) -> None:
    def blind(y: Array) -> Array:
        y[100:110] = y[200] = sign
        return y

    m, count = moved(blind)
    assert count == 11
    assert m.displacement is not None
    assert len(m.displacement.values) == 321 - 11
    (note,) = notes(m, "drop-outs")
    assert note.startswith("11 ")


@pytest.mark.parametrize("quantity", ["voltage", "current"])
def test_blank_readings_are_told(quantity: str) -> None:
    r = record(step(), 300.0, 301, rest=20, noise=0.003, seed=1)
    values = r.columns[quantity].copy()
    values[100:110] = np.nan
    (note,) = r.changed(**{quantity: values}).measurement().notes
    assert (note.code, note.values) == ("rows-blank", {"quantity": quantity, "count": 10, "total": 321})


def test_a_rest_at_zero_is_a_position() -> None:
    m, _ = moved(lambda y: np.where(np.arange(len(y)) < 20, 0.0, y))
    assert notes(m, "drop-outs") == []


# -- drift -------------------------------------------------------------------------------------------------------------


def with_drift(rate: float) -> Synthetic:
    r = record(step(), 300.0, 301, rest=20, noise=0.003, seed=1)
    return r.changed(current=r.columns["current"] + rate * np.clip(r.columns["time"] - 20.0, 0.0, None))


def test_a_current_that_rises_again_drifts() -> None:
    (note,) = notes(with_drift(1e-5).measurement(), "drifts")
    assert "rises again by 2." in note


def test_a_current_that_falls_on_has_not_settled() -> None:
    (note,) = notes(with_drift(-2e-5).measurement(), "settled")
    assert "falls by 1." in note or "falls by 2" in note


def test_a_sound_record_is_told_nothing() -> None:
    assert with_drift(0.0).measurement().notes == ()


def test_a_position_that_wanders_before_the_step_is_told() -> None:
    r = record(step(), 300.0, 301, rest=60, displacement=True, noise=0.001, drift=3e-6, seed=1)
    (note,) = notes(r.measurement(), "while at rest")
    assert "drifts by 17" in note or "drifts by 18" in note
