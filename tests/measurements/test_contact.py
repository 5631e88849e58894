"""Contact lost, made late or reversed is told with its times; records of sound contact are told nothing of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from contacts import BRANCHES, Measured, measured, waveforms

from ilg_circuit.errors import InputError
from ilg_circuit.findings import Finding
from ilg_circuit.measurements.kind import RECORD
from ilg_circuit.measurements.prepare import prepare
from ilg_circuit.measurements.read import read_columns
from ilg_circuit.measurements.record import Record

T = np.arange(0.0, 25.0, 0.02)
DRIVES = waveforms(T)
#: Nothing of contacts may be told of a sound record.
TOLD = {"contact-lost", "voltage-lost", "voltage-lost-held", "current-late", "current-clipped"}
STRIPS = {
    "one branch": ((100.0, 4e-3),),
    "two branches": BRANCHES,
    "fast": ((50.0, 1e-4), (400.0, 1e-3)),
    "diffusion": tuple((60.0 * (k + 1) ** 0.5, 8e-3 / (2 * k + 1) ** 2) for k in range(6)),
}


def told(record: Record) -> list[Finding]:
    return [note for note in record.notes if note.code in TOLD]


def lost(record: Record) -> list[list[float | None]]:
    """When contact was lost and came back, for each break; nothing else may be told."""
    (finding,) = told(record)
    assert finding.code == "contact-lost"
    return list(finding.values["breaks"])


# -- lost --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("noise", [0.0, 0.005])
@pytest.mark.parametrize("name", DRIVES)
def test_a_break_is_told_with_both_times_and_the_record_ends_before_it(name: str, noise: float) -> None:
    m = measured(T, DRIVES[name], [(8.4, 10.8)]).noisy(noise, offset=noise * 1e-3, seed=1)
    record = prepare(m.table())
    (since, until), *more = lost(record)
    assert not more
    assert since == pytest.approx(8.38, abs=0.07)
    assert until == pytest.approx(10.8, abs=0.07)
    assert record.current.time[-1] + record.current.zero < 8.4


@pytest.mark.parametrize("name", ["step", "pulses", "sine", "sweep"])
def test_a_contact_that_never_comes_back(name: str) -> None:
    record = prepare(measured(T, DRIVES[name], [(6.0, 99.0)]).noisy(0.002, seed=2).table())
    ((since, until),) = lost(record)
    assert since == pytest.approx(5.98, abs=0.07)
    assert until is None
    assert "to the end" in str(told(record)[0])


def test_every_break_is_told() -> None:
    record = prepare(measured(T, DRIVES["step"], [(2.0, 3.0), (5.0, 5.4), (9.0, 12.0)]).noisy(0.002, seed=3).table())
    found = np.array(lost(record), dtype=float)
    assert found == pytest.approx(np.array([(1.98, 3.0), (4.98, 5.4), (8.98, 12.0)]), abs=0.5)
    assert found[:, 1] == pytest.approx([3.0, 5.4, 12.0], abs=0.03)
    assert str(told(record)[0]).startswith("the current is that of an open circuit from 1.98 s to 3 s, from ")


def test_an_open_clamp_reads_the_offset_or_zero() -> None:
    m = measured(T, DRIVES["step"], [(3.0, 5.0)])
    for i in (m.i + 5e-4, np.where(m.closed, m.i + 5e-4, 0.0)):
        ((since, until),) = lost(prepare(replace(m, i=i).noisy(0.002, seed=4).table()))
        assert (since, until) == (pytest.approx(2.98, abs=0.03), pytest.approx(5.0))


def test_exact_zeros_are_no_readings_of_a_noisy_current() -> None:
    """The current has decayed into its noise, so that its end alone tells nothing."""
    m = measured(T, DRIVES["step"], dc=1e7).noisy(0.005, seed=5)
    ((since, until),) = lost(prepare(replace(m, i=np.where(T > 20.0, 0.0, m.i)).table()))
    assert (since, until) == (pytest.approx(20.0, abs=0.03), None)


def test_other_columns_end_with_the_current() -> None:
    m = measured(T, DRIVES["step"], [(8.4, 10.8)]).noisy(0.002)
    record = prepare(m.table(displacement=1e-3 * (T >= 1.0) * -np.expm1(-(T - 1.0))))
    assert record.displacement is not None
    assert record.displacement.time[-1] + record.displacement.zero < 8.4


def test_too_little_before_a_break_is_an_error_that_names_it() -> None:
    m = measured(T, DRIVES["step"], [(1.14, 3.0)]).noisy(0.002)
    with pytest.raises(InputError, match=r"record\.csv: contact is lost from 1\.\d+ s to 3 s, with 7 current samples"):
        prepare(m.table())


@pytest.mark.parametrize("name", ["step", "sine"])
def test_a_voltage_that_reads_zero_while_the_current_goes_on(name: str) -> None:
    m = measured(T, DRIVES[name], dc=300.0).noisy(0.002, seed=6)
    gap = (T >= 7.75) & (T < 8.75)
    record = prepare(replace(m, u=np.where(gap, 0.0, m.u)).table())
    (finding,) = told(record)
    assert (finding.values["from"], finding.values["to"]) == (pytest.approx(7.74), pytest.approx(8.76))
    end = record.current.time[-1] + record.current.zero
    if name == "step":
        assert finding.code == "voltage-lost-held"
        assert record.step == pytest.approx(1.0)
        assert end == pytest.approx(T[-1])
    else:
        assert finding.code == "voltage-lost"
        assert end < 7.75


# -- sound contact -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("strip", STRIPS)
@pytest.mark.parametrize("name", DRIVES)
def test_sound_contact_is_told_nothing(name: str, strip: str) -> None:
    """Waveforms that pass zero, plateaus, vertices and currents that decay into noise or digits."""
    odd = (list(DRIVES).index(name) + list(STRIPS).index(strip)) % 2  # each drive and each strip meets all of them
    noises = ((0.0, 0), (0.002, 0), (0.02, 0), (0.0, 8), (0.002, 10), (0.01, 16))
    for seed, (noise, bits) in list(enumerate(noises))[odd::2]:
        m = measured(T, DRIVES[name], branches=STRIPS[strip], dc=(500.0, 1e5)[seed % 2]).noisy(noise, seed=seed)
        if bits:
            m = m.rounded(2.0 ** (1 - bits))
        assert told(prepare(m.table())) == []


def test_a_measured_strip_is_told_nothing(shared_data: Callable[[str], Path]) -> None:
    table = read_columns(shared_data("ipmc_step/step_1V5.csv"), RECORD)
    for digits in (7, 4, 3):
        rounded = replace(table, columns={**table.columns, "current": np.round(table.columns["current"], digits)})
        assert told(prepare(rounded)) == []


def test_a_measured_strip_that_loses_contact(shared_data: Callable[[str], Path]) -> None:
    table = read_columns(shared_data("ipmc_step/step_1V5.csv"), RECORD)
    i = np.where((table.time >= 10.0) & (table.time < 11.0), 0.0, table.columns["current"])
    ((since, until),) = lost(prepare(replace(table, columns={**table.columns, "current": i})))
    assert (since, until) == (pytest.approx(10.0, abs=0.03), pytest.approx(11.0, abs=0.03))


@pytest.mark.parametrize("name", ["sine", "triangle", "blunt triangle", "sweep", "trapezoid"])
def test_a_true_limit_is_found_under_smooth_waveforms(name: str) -> None:
    m = measured(T, DRIVES[name], branches=STRIPS["one branch"]).noisy(0.002, seed=7)
    limit = 0.7 * float(np.abs(m.i).max())
    found = told(prepare(replace(m, i=np.clip(m.i, -limit, limit)).table()))
    assert {note.code for note in found} == {"current-clipped"}
    assert [abs(note.values["level"]) for note in found] == pytest.approx([limit] * len(found))


# -- late --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("delay", [0.3, 1.3, 2.9])
@pytest.mark.parametrize("name", DRIVES)
def test_a_contact_that_closes_late_is_the_onset(name: str, delay: float) -> None:
    """Where the voltage is zero as contact is made, its next change is the onset."""
    record = prepare(measured(T, DRIVES[name], [(0.0, 1.0 + delay)]).noisy(0.002, seed=8).table())
    begins = float(T[int(np.argmax(np.abs(DRIVES[name]) > 0.0))])
    if 1.0 + delay < begins:  # contact was made before there was a voltage
        assert told(record) == []
        assert record.onset == pytest.approx(begins, abs=0.07)
        return
    (finding,) = told(record)
    assert finding.code == "current-late"
    made = 1.0 + delay
    if name in ("pulses", "trapezoid at rest") and delay > 2.5:
        made = float(T[int(np.argmax((made - 0.01 < T) & (np.abs(DRIVES[name]) > 0.0)))])
    assert finding.values["to"] == pytest.approx(made, abs=0.07)
    assert record.onset == pytest.approx(made, abs=0.07)
    assert "look at the clamp" in str(finding)
    later = T[made + 0.1 < T]
    shown = record.drive.value(later - record.onset)
    assert shown == pytest.approx(np.interp(later, T, DRIVES[name]), abs=0.35)
    assert float(np.median(np.abs(shown - np.interp(later, T, DRIVES[name])))) < 0.02


def test_the_voltages_own_onset_is_no_news_of_a_late_contact() -> None:
    m = measured(T, DRIVES["step"], [(0.0, 2.3)]).noisy(0.002, seed=9)
    assert prepare(m.table(), onset=0.99).onset == prepare(m.table()).onset
    assert prepare(m.table(), onset=2.285).onset == pytest.approx(2.285)
    with pytest.raises(InputError, match="is excluded by the readings"):
        prepare(m.table(), onset=4.0)


def test_a_displacement_read_only_before_a_late_contact_is_none() -> None:
    table = measured(T, DRIVES["step"], [(0.0, 2.3)]).noisy(0.002, seed=9).table()
    only = np.where((table.time > 1.2) & (table.time < 1.8), 1e-3, np.nan)
    record = prepare(replace(table, columns={**table.columns, "displacement": only}))
    assert record.displacement is None
    assert "displacement-too-short" in {note.code for note in record.notes}


def test_late_and_lost() -> None:
    record = prepare(measured(T, DRIVES["step"], [(0.0, 2.3), (8.0, 10.0)]).noisy(0.002, seed=10).table())
    assert [note.code for note in told(record)] == ["current-late", "contact-lost"]


# -- reversed ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", DRIVES)
def test_a_reversed_current_is_an_error_that_says_so(name: str) -> None:
    m = measured(T, DRIVES[name]).noisy(0.01, seed=11)
    turned = replace(m.table(), headers={"current": ("I_mA", "mA")})
    turned.columns["current"] *= -1
    with pytest.raises(InputError, match=r"record\.csv: the sign of the current \(column 'I_mA'\) is reversed.*turn"):
        prepare(turned)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_record_that_starts_at_the_step(sign: float) -> None:
    """A chronoamperogram without rest is as good as another; reversed it is told so too."""
    m = measured(T, DRIVES["step"]).noisy(0.005, seed=12)
    after = T >= 1.0 - 1e-9
    cut = Measured(T[after] - 1.0, m.u[after], sign * m.i[after], m.closed[after])
    if sign > 0:
        assert told(prepare(cut.table())) == []
    else:
        with pytest.raises(InputError, match="is reversed"):
            prepare(cut.table())
