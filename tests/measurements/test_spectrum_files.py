"""Spectra from files: every format gives the same points, notes say what is dropped, and bad files are one line."""

from __future__ import annotations

import cmath
import math
import time
from pathlib import Path

import numpy as np
import pytest
from spectrum_texts import FORMATS, F, Z, bare, csv, ec_lab

from ilg_circuit.errors import InputError
from ilg_circuit.measurements.formats import FORMATS as REGISTERED
from ilg_circuit.measurements.kind import RECORD, SPECTRUM
from ilg_circuit.measurements.read import read, read_spectrum
from ilg_circuit.measurements.spectrum import prepare_spectrum
from ilg_circuit.measurements.text import read_raw, text_of


def holds_spectrum(path: Path) -> bool:
    lines = text_of(read_raw(path, RECORD), RECORD).lines
    return next(filter(None, (f.recognises(lines) for f in REGISTERED))) == SPECTRUM


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_gives_the_same_points(name: str, tmp_path: Path) -> None:
    path = tmp_path / "spectrum.txt"
    path.write_bytes(FORMATS[name]().encode("latin-1"))
    found = read_spectrum(path)
    assert holds_spectrum(path)
    assert found.source == "spectrum.txt"
    assert found.frequency == pytest.approx(F[::-1], rel=1e-8)
    assert found.impedance == pytest.approx(Z[::-1], rel=1e-8, abs=1e-6)
    assert found.notes == ()


def test_all_columns_that_ec_lab_writes(tmp_path: Path) -> None:
    header = (
        "freq/Hz\tRe(Z)/Ohm\t-Im(Z)/Ohm\t|Z|/Ohm\tPhase(Z)/deg\ttime/s\t<Ewe>/V\t<I>/mA\tCs/\u00b5F\tCp/\u00b5F\t"
        "cycle number\tI Range\t|Ewe|/V\t|I|/A\tRe(Y)/Ohm-1\tIm(Y)/Ohm-1\t|Y|/Ohm-1\tPhase(Y)/deg\t"
    )
    rows = [f"{f:.7E}\t{z.real:.7E}\t{-z.imag:.7E}" + "\t1.0E+000" * 15 for f, z in zip(F, Z, strict=True)]
    path = tmp_path / "s.mpt"
    path.write_text("\n".join(["EC-Lab ASCII FILE", "Nb header lines : 3", "", header, *rows]), encoding="latin-1")
    assert holds_spectrum(path)
    assert read_spectrum(path).impedance == pytest.approx(Z[::-1], rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_encodings(encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "s.txt"
    path.write_bytes(ec_lab(preamble=True).encode(encoding))
    assert len(read_spectrum(path).frequency) == len(F)


@pytest.mark.parametrize(
    ("header", "factor"),
    [
        ("Frequency [kHz];Re [ohm];Im [ohm]", (1e-3, 1, 1)),
        ("f (Hz);Zreal (kOhm);Zimag (kOhm)", (1, 1e-3, 1e-3)),
        ("freq_Hz;re_ohm;minus_im_ohm", (1, 1, -1)),
        ("freq_Hz;Z'_\u03a9;-Z''_\u2126", (1, 1, -1)),
        ("omega_rad/s;re_ohm;im_ohm", (2 * np.pi, 1, 1)),
        ("\u03c9 (rad/s);Z'_\u03a9;Z''_\u2126", (2 * np.pi, 1, 1)),
        ("Angular frequency [rad s^-1];Re [kohm];Im [ohm]", (2 * np.pi, 1e-3, 1)),
    ],
)
def test_units_and_signs_of_columns(header: str, factor: tuple[float, float, float], tmp_path: Path) -> None:
    rows = [
        f"{a * f!r};{b * z.real!r};{c * z.imag!r}"
        for f, z in zip(F.tolist(), Z.tolist(), strict=True)
        for a, b, c in [factor]
    ]
    path = tmp_path / "s.csv"
    path.write_text("\n".join([header.replace("kOhm", "kohm"), *rows]), encoding="utf-8")
    assert read_spectrum(path).impedance == pytest.approx(Z[::-1], rel=1e-12)


def test_an_admittance_is_a_conductance_and_a_susceptance(tmp_path: Path) -> None:
    path = tmp_path / "s.csv"
    rows = [f"{f!r};{1e3 * y.real!r};{1e3 * y.imag!r}" for f, y in zip(F.tolist(), (1 / Z).tolist(), strict=True)]
    path.write_text("\n".join(["f_Hz;G_mS;B_mS", *rows]), encoding="utf-8")
    assert read_spectrum(path).impedance == pytest.approx(Z[::-1], rel=1e-12)


def test_degrees_are_not_radians(tmp_path: Path) -> None:
    path = tmp_path / "s.csv"
    rows = [f"{f!r};{abs(z)!r};{math.degrees(cmath.phase(z))!r}" for f, z in zip(F.tolist(), Z.tolist(), strict=True)]
    path.write_text("\n".join(["frequency_Hz;modulus_ohm;phase_rad", *rows]), encoding="utf-8")
    with pytest.raises(InputError, match=r"column 'phase_rad' reaches .* rad, more than a whole turn.*phase_deg"):
        read_spectrum(path)
    path.write_text("\n".join(["frequency_Hz;modulus_ohm;phase_deg", *rows]), encoding="utf-8")
    assert read_spectrum(path).impedance == pytest.approx(Z[::-1], rel=1e-12)


def test_what_is_dropped_is_told() -> None:
    f = np.array([1e5, 1e4, 1e3, 0.0, -5.0, 100.0, 100.0, 10.0, 5.0, 1.0, 0.5, 0.1, np.nan, 0.2])
    z = np.array([5 + 1j, 5 + 0.5j, 5 - 1j, 1, 1, 6 - 2j, 7 - 2j, 0, 8 - 5j, 9 - 8j, 9 - 9j, np.inf, 9, 9 - 12j])
    found = prepare_spectrum(f, z, "s")
    assert found.frequency.tolist() == [0.2, 0.5, 1.0, 5.0, 100.0, 1e3]
    assert found.impedance.tolist() == [9 - 12j, 9 - 9j, 9 - 8j, 8 - 5j, 6 - 2j, 5 - 1j]
    told = "; ".join(map(str, found.notes))
    assert "2 points without a number" in told
    assert "2 points whose frequency is not positive" in told
    assert "1 point with no sensible reading (a drop-out)" in told
    assert "1 point at a frequency that was there before" in told
    assert "2 points from 10 kHz on, where Im Z is positive" in told


def test_noise_about_a_resistance_is_not_taken_for_inductance() -> None:
    random = np.random.default_rng(3)
    f = np.geomspace(1e-2, 1e5, 60)
    z = 20 + 30 / (1 + 2j * np.pi * f) + 0.1 * (random.standard_normal(60) + 1j * random.standard_normal(60))
    assert (z.imag[-10:] > 0).any()
    assert len(prepare_spectrum(f, z).frequency) == 60


def test_passivity_is_watched() -> None:
    f = np.geomspace(1, 10, 8)
    assert "1 point with Re Z below zero" in str(prepare_spectrum(f, np.r_[-1 - 1j, np.full(7, 1 - 1j)]).notes[0])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "the file is empty"),
        ("frequency_Hz,re_ohm,im_ohm\n", "no row of numbers"),
        ("frequency_Hz,re_ohm\n1,2\n", "no column for the imaginary part"),
        ("frequency_Hz,im_ohm\n1,2\n", "no column for re"),
        ("frequency_Hz,re_ohm,im_ohm,minus_im_ohm\n1,2,3,4\n", "both Im Z and -Im Z"),
        ("frequency_Hz,re_V,im_ohm\n1,2,3\n", "does not measure this quantity"),
        ("frequency_Hz,re_ohm,im_ohm\n1,2,x\n", "line 2, column 'im_ohm': 'x' is not a number"),
        ("frequency_Hz,re_ohm,im_ohm\n1,2,-3\n", "1 point left, 6 are needed"),
        ("EXPLAIN\nTAG\tEISPOT\n", "without a ZCURVE table"),
        ("ZCURVE\tTABLE\n\tPt\tFreq\tZreal\n\t#\tHz\tohm\n\t0\t1\t2\n", "no column for the imaginary part"),
        ("ZPLOT2 ASCII\nEnd Comments\n1,2,3\n", "without a row of names"),
        ("1,2,-3\nhello\n", "line 2: 'hello' is not frequency, Re Z, Im Z"),
        ("hello\n", "no column for frequency"),
        ('frequency_Hz,re_ohm,im_ohm\n"' + "1,2,3\n" * 30_000, "quotation mark"),
        (csv().replace(",-", ","), "call it minus_im_ohm"),
        ("a\0b", "not a text file"),
    ],
)
def test_bad_files_are_one_line(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "s.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_spectrum(path)
    assert said in str(caught.value)
    assert str(caught.value).startswith("s.csv: ")
    assert "\n" not in str(caught.value)


def test_files_that_are_none(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "none.csv"):
        with pytest.raises(InputError, match="cannot read"):
            read_spectrum(path)
        with pytest.raises(InputError, match="cannot read"):
            read(path)


@pytest.mark.parametrize("text", [b"1.5,2,3\n" * 600_000, b"frequency_Hz,re_ohm,im_ohm\n" + b"1,2,3\n" * 90_000])
def test_files_beyond_measure_are_refused_at_once(text: bytes, tmp_path: Path) -> None:
    path = tmp_path / "s.csv"
    path.write_bytes(text)
    begin = time.perf_counter()
    with pytest.raises(InputError, match=r"lines|rows"):
        read_spectrum(path)
    assert time.perf_counter() - begin < 2


def test_records_over_time_are_no_spectra(tmp_path: Path) -> None:
    path = tmp_path / "step.csv"
    t = np.arange(0.0, 10.0, 0.1).tolist()
    path.write_text("time_s,voltage_V,current_A\n" + "\n".join(f"{x},1,0.1" for x in t))
    assert not holds_spectrum(path)
    path.write_text("\n".join(f"{x + 0.1},1,0.1" for x in t))
    assert not holds_spectrum(path)
    path.write_text("time_s,frequency_Hz,voltage_V,current_A\n" + "\n".join(f"{x},1,1,0.1" for x in t))
    assert not holds_spectrum(path)
    path.write_text(bare())
    assert holds_spectrum(path)


def test_a_record_whose_times_look_like_frequencies_is_none(tmp_path: Path) -> None:
    """It begins late, and its later samples are further apart: but its columns have names."""
    t = np.concatenate([np.arange(0.1, 3.0, 0.2), np.arange(3.0, 100.0, 5.0)])
    path = tmp_path / "record.csv"
    path.write_text("t_s,voltage_V,current_A\n" + "\n".join(f"{x},1,0.1" for x in t.tolist()))
    assert not holds_spectrum(path)
