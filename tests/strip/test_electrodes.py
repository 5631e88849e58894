"""The section [electrodes]: lossless both ways, changed, described, refused in one line."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import pytest

from ilg_circuit.errors import InputError
from ilg_circuit.report.strip import summary
from ilg_circuit.strip.actuator import PAPER, Electrodes
from ilg_circuit.strip.file import dumps, loads

SHEETS = Electrodes(0.25, 0.3, segments_1=4, segments_2=2, gap=0.5e-3)

OTHERS = [
    Electrodes(0.0, 0.1),
    SHEETS,
    Electrodes(0.25, 0.25, lengths_1=(7e-3, 8.1e-3), gap_resistance=1e4, gap=1e-3, contact="each", cells=12),
    Electrodes(200.0, 1.0, contact_length=0.0, lead_resistance=2.5),
]


@pytest.mark.parametrize("sheets", OTHERS)
def test_file_is_lossless(sheets: Electrodes) -> None:
    strip = replace(PAPER, electrodes=sheets)
    assert loads(dumps(strip)) == strip


def test_file_as_a_user_writes_it() -> None:
    text = (
        dumps(PAPER)
        + """
[electrodes]
sheet_resistance_1 = "0.25 ohm"
sheet_resistance_2 = "250 mohm"
lengths_1 = ["7 mm", "8 mm"]
segments_2 = 4
gap = "0.5 mm"
contact = "each"
"""
    )
    assert loads(text).electrodes == Electrodes(
        0.25, 0.25, lengths_1=(7e-3, 8e-3), segments_2=4, gap=0.5e-3, contact="each"
    )


def test_changes() -> None:
    given = {
        "sheet_resistance_1": "250 mohm",
        "sheet_resistance_2": 0.3,
        "segments_1": 4,
        "segments_2": 2,
        "gap": "0.5 mm",
    }
    strip = PAPER.with_(electrodes=given)
    assert strip.electrodes == SHEETS
    assert strip.with_(gap="1 mm", contact="end", cells=8).electrodes == replace(
        SHEETS, gap=1e-3, contact="end", cells=8
    )
    assert strip.with_(electrodes=None) == PAPER
    assert strip.with_(thickness="0.4 mm").electrodes == SHEETS
    shorter = PAPER.with_(free_length="9 mm", electrodes={**given, "segments_1": 1, "lengths_1": ["4 mm", 4e-3]})
    assert shorter.electrodes is not None
    assert shorter.electrodes.lengths_1 == (4e-3, 4e-3)


def test_description() -> None:
    strip = replace(PAPER, electrodes=SHEETS)
    rows = strip.describe()
    assert rows["electrodes"]["lengths_1"]["value"] == pytest.approx([7.125e-3] * 4)
    assert rows["elements"]["line_resistance"]["value"] == pytest.approx(0.55 / 5e-3 * 14.75e-3)
    assert "sheet_resistance_2" in summary(rows)
    assert "electrodes" in repr(strip)
    assert "electrodes" not in PAPER.describe()


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"lengths_1": (20e-3, 11e-3)}, "lengths_1 with 1 gaps are 0.031 m long, the free length is 0.03 m"),
        ({"segments_1": 4, "gap": 10e-3}, "leaves nothing of the free length"),
        ({"segments_1": 2.5}, "segments_1 is 2.5; give a whole number from 1 to 50"),
        ({"segments_1": 3, "lengths_1": (1e-3, 1e-3)}, "leave one of them out"),
        ({"cells": 1000}, "cells is 1000; give a whole number from 1 to 400"),
        ({"contact": "middle"}, "contact"),
        ({"contact_length": 6e-3}, "longer than the clamped part, 0.005 m"),
        ({"contact": "end", "contact_length": 1e-3}, "goes with contact 'clamp'"),
        ({"lengths_1": (-1e-3,)}, "must be more than zero"),
        ({"lengths_1": 7e-3}, "give a list of lengths"),
        ({"lead_resistance": -1.0}, "must be zero or more"),
    ],
)
def test_electrodes_that_cannot_be(keys: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=re.escape(told)) as caught:
        replace(PAPER, electrodes=Electrodes(0.25, 0.25, **keys))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('sheet_resistance_1 = "1 ohm"', "'electrodes.sheet_resistance_2' is missing"),
        ('sheet_resistance_1 = "1 mm"\nsheet_resistance_2 = "1 ohm"', "sheet_resistance_1"),
        ('sheet_resistance_1 = "1 ohm"\nsheet_resistance_2 = "1 ohm"\nlengths_1 = "7 mm"', "a list in brackets"),
        ('sheet_resistance_1 = "1 ohm"\nsheet_resistance_2 = "1 ohm"\nsegment_1 = 4', "segments_1"),
    ],
)
def test_sections_that_cannot_be_read(text: str, told: str) -> None:
    with pytest.raises(InputError, match=re.escape(told)):
        loads(f"{dumps(PAPER)}\n[electrodes]\n{text}\n")


def test_changes_that_cannot_be() -> None:
    for values, told in (
        ({"gap": "1 mm"}, "no [electrodes] that could be varied"),
        ({"electrodes": {"sheet_resistance_1": 1.0}}, "sheet_resistance_2' is missing"),
        ({"electrodes": {"sheet": 1.0}}, "sheet_resistance_1"),
        ({"electrodes": 4}, "give an object Electrodes"),
    ):
        with pytest.raises(InputError, match=re.escape(told)):
            PAPER.with_(**values)
