"""Layers of a strip: their laws against textbooks, what their thicknesses change, their file."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ilg_circuit import PAPER, InputError, identify, new_strip
from ilg_circuit.report.strip import summary
from ilg_circuit.strip.actuator import Actuator
from ilg_circuit.strip.elements import bending_stiffness, gravity_ratio, lumped_elements
from ilg_circuit.strip.file import dumps, load_strip, loads
from ilg_circuit.strip.layered import gravity_scope, scalings, thickness_findings
from ilg_circuit.strip.layers import Layer, Section, laws, sheet_resistances
from ilg_circuit.strip.specimen import Specimen

GEL = Layer("gel", 0.4e-3, 1250.0, 7600.0)
CARBON = Layer("carbon", 0.05e-3, 700.0, 1e6, capacitance_per_volume=80e6)
GOLD = Layer("gold", 0.1e-6, 19300.0, 79e9, resistivity=2.44e-8)
SOFT = PAPER.with_layers([CARBON, GEL, CARBON])
GILT = PAPER.with_layers([GOLD, CARBON, GEL, CARBON, GOLD])
AREA = 35e-3 * 5e-3


def _static(strip: Actuator) -> float:
    """Return the displacement per volt [m/V]."""
    lumped = lumped_elements(strip)
    assert lumped.coupling is not None
    return lumped.bending_ratio * lumped.coupling.static


def test_one_layer_is_the_papers_strip() -> None:
    """EC (8), (10), (12)-(14): one layer, however thick, is the strip without layers."""
    one = PAPER.with_layers([replace(GEL, thickness=0.5e-3)])
    for strip, plain in ((one, PAPER), (one.with_(gel_thickness=0.3e-3), PAPER.with_(thickness=0.3e-3))):
        assert bending_stiffness(strip) == pytest.approx(7600 * 5e-3 * strip.geometry.thickness**3 / 12, rel=1e-14)
        found, expected = lumped_elements(strip), lumped_elements(plain)
        assert (found.stiffness, found.mass, found.damping) == pytest.approx(
            (expected.stiffness, expected.mass, expected.damping), rel=1e-12
        )
        assert found.port.branches[0] == pytest.approx(expected.port.branches[0], rel=1e-12)
        assert _static(strip) == pytest.approx(_static(plain), rel=1e-12)


@pytest.mark.parametrize(
    ("strip", "stiffness", "r", "mode", "force"),
    [(PAPER, 3.958e-10, 261, 0.22, 0.175e-6), (SOFT, 2.562e-8, 3.7, 1.9, 11e-6), (GILT, 4.965e-6, 0.019, 26, 2.2e-3)],
)
def test_table_of_three_strips(strip: Actuator, stiffness: float, r: float, mode: float, force: float) -> None:
    """EI, gravity's number, first mode and force for 3.98 mm, to the digits of the table."""
    lumped = lumped_elements(strip)
    assert bending_stiffness(strip) == pytest.approx(stiffness, rel=2e-4)
    assert gravity_ratio(strip) == pytest.approx(r, rel=0.03)
    assert math.sqrt(lumped.stiffness / lumped.mass) / (2 * math.pi) == pytest.approx(mode, rel=0.03)
    assert lumped.stiffness * 3.98e-3 == pytest.approx(force, rel=0.03)


def test_symmetric_sandwich_of_the_textbook() -> None:
    """EI/w = E_c [(h + 2 c)^3 - h^3]/12 + E h^3/12."""
    h, c = GEL.thickness, CARBON.thickness
    textbook = CARBON.modulus * ((h + 2 * c) ** 3 - h**3) / 12 + GEL.modulus * h**3 / 12
    made = laws(SOFT.layers)
    assert made.stiffness == pytest.approx(textbook, rel=1e-12)
    assert made.section.neutral_axis == pytest.approx((h + 2 * c) / 2, rel=1e-12)


def test_layer_without_thickness_is_absent_and_the_origin_is_arbitrary() -> None:
    thickness, modulus = np.array([1e-4, 3e-4, 5e-5]), np.array([2e6, 5e3, 7e7])
    plain = Section(thickness, modulus)
    more = Section(np.insert(thickness, 1, 0.0), np.insert(modulus, 1, 1e9))
    moved = Section(thickness, modulus, origin=0.37)
    assert (more.neutral_axis, more.stiffness) == pytest.approx((plain.neutral_axis, plain.stiffness), rel=1e-14)
    assert moved.neutral_axis - 0.37 == pytest.approx(plain.neutral_axis, rel=1e-9)
    assert moved.stiffness == pytest.approx(plain.stiffness, rel=1e-9)


def test_bimetal_of_timoshenko() -> None:
    """kappa = 6 de (1 + m)^2/(h [3 (1 + m)^2 + (1 + m n)(m^2 + 1/(m n))]), m = h1/h2, n = E1/E2 (1925)."""
    h1, h2, e1, e2, strain = 2e-4, 5e-4, 7e10, 2e11, 1e-3
    m, n = h1 / h2, e1 / e2
    timoshenko = 6 * strain * (1 + m) ** 2 / ((h1 + h2) * (3 * (1 + m) ** 2 + (1 + m * n) * (m**2 + 1 / (m * n))))
    found = Section(np.array([h1, h2]), np.array([e1, e2])).curvature([0.0, strain])
    assert found == pytest.approx(timoshenko, rel=1e-12)


def test_unequal_strains_of_the_electrodes() -> None:
    """They leave the neutral axis and the curvature of their mean, and stretch the strip by sum E h eps/sum E h."""
    stack = laws(SOFT.layers).section
    eps = 1e-3
    rigid = stack.modulus * stack.thickness
    unequal = np.array([-0.4 * eps, 0.0, 1.6 * eps])
    assert stack.curvature(unequal) == pytest.approx(stack.curvature([-eps, 0.0, eps]), rel=1e-12)
    assert stack.axial_strain(unequal) == pytest.approx(rigid[2] * 1.2 * eps / rigid.sum(), rel=1e-12)
    betas = [replace(CARBON, strain_per_charge=x) for x in (0.4e-9, 1.6e-9)]
    both = laws([replace(CARBON, strain_per_charge=1e-9), GEL, replace(CARBON, strain_per_charge=1e-9)])
    uneven = laws([betas[0], GEL, betas[1]])
    assert uneven.section.neutral_axis == both.section.neutral_axis
    assert uneven.storing is not None
    assert both.storing is not None
    assert uneven.storing.per_charge == pytest.approx(both.storing.per_charge, rel=1e-12)


def test_soft_gel_with_thin_stiff_carbon_bends_by_two_strains_over_their_distance() -> None:
    """kappa = 2 eps/(h_gel + h_c), 1.2 % off here; with carbon and gel infinitely different and thin it is exact."""
    eps = 1e-3
    stack = laws(SOFT.layers).section
    assert stack.curvature([-eps, 0, eps]) / (2 * eps / 0.45e-3) == pytest.approx(1 - 0.012, abs=2e-3)
    thin = Section(np.array([1e-7, 4e-4, 1e-7]), np.array([1e12, 1e-3, 1e12]))
    assert thin.curvature([-eps, 0, eps]) == pytest.approx(2 * eps / 4.001e-4, rel=1e-6)


def test_exponents_of_the_thickness() -> None:
    """By log-derivative: one layer -2, all layers -1, gel alone -1.11 (-0.89 with gold); force +1, +2, +1.11."""
    one, every, gel = scalings(SOFT)
    assert (one.displacement, one.force, one.charge) == (-2, 1, -1)
    assert (every.displacement, every.force, every.charge) == pytest.approx((-1, 2, 1), abs=1e-6)
    assert (gel.displacement, gel.force, gel.charge) == pytest.approx((-1.11, 1.11, 0), abs=0.005)
    assert scalings(GILT)[2].displacement == pytest.approx(-0.89, abs=0.005)
    # the exponents are those of the strips that a study solves
    low, high = (SOFT.with_(thickness=0.5e-3 * x) for x in (1 - 1e-4, 1 + 1e-4))
    assert math.log(_static(high) / _static(low)) / 2e-4 == pytest.approx(every.displacement, abs=1e-6)
    assert [row.varied for row in scalings(PAPER)] == ["thickness"]


@pytest.mark.parametrize(
    ("layers", "ratio"),
    [
        (SOFT.layers, 2.9),
        (GILT.layers, 2.1),
        ([replace(CARBON, youngs_modulus=7600.0), GEL, replace(CARBON, youngs_modulus=7600.0)], 5.2),
    ],
)
def test_thinner_strip_with_the_same_carbon(layers: list[Layer], ratio: float) -> None:
    """At 0.2 mm in place of 0.5 mm: displacement times 2.9, 2.1, 5.2, charge times 1; one layer says 6.25 and 2.5."""
    strip = PAPER.with_layers(layers)
    thin = strip.with_(gel_thickness="0.1 mm")
    assert _static(thin) / _static(strip) == pytest.approx(ratio, abs=0.05)
    before, after = (lumped_elements(x).port for x in (strip, thin))
    assert after.capacitance == pytest.approx(before.capacitance, rel=1e-12)
    assert after.dynamic_resistance == pytest.approx(before.dynamic_resistance / 4, rel=1e-12)
    assert after.dc_resistance == pytest.approx(before.dc_resistance / 4, rel=1e-12)
    assert _static(PAPER.with_(thickness=0.2e-3)) / _static(PAPER) == pytest.approx(6.25, rel=1e-12)


def test_stiffness_rises_with_the_foil() -> None:
    """Gold of 10 to 80 nm on one membrane: EI, and the force for one displacement, rise linearly with the foil."""
    foils = np.array([10, 27, 45, 67, 80]) * 1e-9
    strip = PAPER.with_layers([replace(GOLD, thickness=10e-9), CARBON, GEL, CARBON, replace(GOLD, thickness=10e-9)])
    found = np.array([lumped_elements(strip.with_(gold_thickness=h)).stiffness for h in foils])
    assert (np.diff(found) > 0).all()
    slopes = np.diff(found) / np.diff(foils)
    # 79 GPa at 0.25 mm from the axis on both sides
    assert slopes == pytest.approx(3 * 2 * 79e9 * 5e-3 * (0.25e-3) ** 2 / (30e-3) ** 3, rel=1e-3)


def test_measured_stiffness_and_fitted_circuit_are_scaled() -> None:
    """A measured EI, several branches and a Warburg element keep the fit at its own layers and follow others."""
    own = replace(SOFT, material=replace(SOFT.material, bending_stiffness=4e-8, diffusion_time=3.0))
    assert bending_stiffness(own) == 4e-8
    double = own.with_(carbon_thickness=0.1e-3)
    assert bending_stiffness(double) / 4e-8 == pytest.approx(
        laws(double.layers).stiffness / laws(own.layers).stiffness, rel=1e-12
    )
    assert lumped_elements(double).port.capacitance / lumped_elements(own).port.capacitance == pytest.approx(
        2, rel=1e-9
    )
    porous = [replace(x, ionic_conductivity=0.1) for x in own.layers]
    thick = own.with_layers(porous).with_(carbon_thickness=0.1e-3)
    assert thick.material.diffusion_time == pytest.approx(12.0, rel=1e-12)  # h_c^2


def test_absolute_values_of_full_data() -> None:
    """C = C_v h_c L w/2, Rd = h/(sigma L w) + (R_1 + R_2)/3, Rdc, d(0) = (b^2/6) kappa/v; keys may be left out."""
    carbon = {
        "capacitance_per_volume": "80 F/cm^3",
        "ionic_conductivity": "0.05 S/m",
        "strain_per_charge": "1e-11 m^3/C",
    }
    gel = {"ionic_conductivity": "0.13 S/m", "resistivity": "290 ohm m"}
    strip = PAPER.with_layers(
        [
            {"name": "carbon", "thickness": "50 um", "youngs_modulus": "1 MPa", "density": "700 kg/m^3"} | carbon,
            {"name": "gel", "thickness": "0.4 mm", "youngs_modulus": "7.6 kPa", "density": "1250 kg/m^3"} | gel,
            {"name": "carbon", "thickness": "50 um", "youngs_modulus": "1 MPa", "density": "700 kg/m^3"} | carbon,
        ]
    )
    whole = dumps(strip)
    left_out = ("dc_resistivity", "dynamic_resistivity", "permittivity", "youngs_modulus", "density", "gain")
    head, _, layers = whole.partition("[[layers]]")
    short = "\n".join(line for line in head.splitlines() if not line.startswith(left_out)) + "\n[[layers]]" + layers
    made = lumped_elements(loads(short))
    (rd, c), *_ = made.port.branches
    assert c == pytest.approx(80e6 * 50e-6 * AREA / 2, rel=1e-12)
    assert rd == pytest.approx((0.4e-3 / 0.13 + 2 * 50e-6 / 0.05 / 3) / AREA, rel=1e-12)
    assert made.port.dc_resistance == pytest.approx(290 * 0.4e-3 / AREA, rel=1e-12)
    eps = 1e-11 * c / (AREA * 50e-6)  # of 1 V
    kappa = laws(strip.layers).section.curvature([-eps, 0, eps])
    assert made.coupling is not None
    assert made.bending_ratio * made.coupling.static == pytest.approx(kappa * 30e-3**2 / 2, rel=1e-12)
    assert loads(whole) == strip


def test_sheets_in_parallel_and_their_thickness() -> None:
    gold = 2.44e-8 / 0.1e-6
    carbon = replace(CARBON, sheet_resistance=200.0)
    layers = [GOLD, carbon, GEL, carbon]
    first, second = sheet_resistances(layers) or (0, 0)
    assert (first, second) == pytest.approx((1 / (1 / gold + 1 / 200), 200), rel=1e-12)
    assert carbon.with_(thickness=0.1e-3).square == pytest.approx(100)
    assert sheet_resistances(SOFT.layers) is None
    assert sheet_resistances([GEL]) is None


def test_modulus_of_a_filler_lies_between_its_data() -> None:
    table = ((0.0, 4e3), (0.03, 7600.0), (0.05, 9e3))
    gel = Layer("gel", 0.4e-3, 1250.0, filler=0.03, filler_moduli=table)
    assert gel.modulus == 7600.0
    strip = PAPER.with_layers([CARBON, gel, CARBON])
    stiffer = strip.with_(gel_filler="4 %")
    assert 7600 < stiffer.layers[1].modulus < 9000
    assert loads(dumps(stiffer)) == stiffer
    with pytest.raises(InputError, match=r"layer 'gel': filler 0.06 lies outside"):
        strip.with_(gel_filler=0.06)


def test_gravity_may_be_neglected_over_these_sizes() -> None:
    """The sizes given are those at which gravity's number is 0.05, for the strip and for its gel alone."""
    alone, layered = gravity_scope(SOFT)
    assert alone.r == pytest.approx(gravity_ratio(PAPER), rel=1e-12)
    assert alone.longest == pytest.approx(gravity_scope(PAPER)[0].longest, rel=1e-12)
    for change in (
        {"free_length": layered.longest},
        {"thickness": layered.thinnest},
        {"gel_thickness": layered.thinnest_gel},
    ):
        assert layered.thinnest_gel is not None
        assert gravity_ratio(SOFT.with_(**change)) == pytest.approx(0.05, rel=1e-6)


def test_specimen_with_layers_is_fitted(tmp_path: Path) -> None:
    """Layers of a strip before any fit are kept by its file and by the fit."""
    made = new_strip(
        length="35 mm", free_length="30 mm", width="5 mm", thickness="0.5 mm", layers=[CARBON, GEL, CARBON]
    )
    made.save(tmp_path / "strip.toml")
    read = load_strip(tmp_path / "strip.toml")
    assert isinstance(read, Specimen)
    assert read == made
    assert read.modulus_known
    t = np.linspace(0, 60, 121)
    fit = identify({"time_s": t, "voltage_V": 0 * t + 1, "current_A": 1e-3 + 0.05 * np.exp(-t / 7)}, read, model="rc")
    assert fit.actuator.layers == made.layers
    assert fit.actuator.material.youngs_modulus == made.stand_in().material.youngs_modulus


def test_thickness_without_layers_is_remarked() -> None:
    (found,) = thickness_findings(PAPER, {"thickness": [0.2e-3, 1e-3]})
    assert found.code == "thickness-of-one-layer"
    assert found.values["factor"] == pytest.approx(2.5)
    assert not thickness_findings(SOFT, {"thickness": [0.2e-3]})
    assert not thickness_findings(PAPER, {"width": [0.2e-3]})
    assert not thickness_findings(PAPER, {"thickness": [0.5e-3]})


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"gold_thickness": 1e-6}, "gold_thickness: strip 'paper' has no layer 'gold'; it has carbon, gel"),
        ({"gel_thickness": 0.0}, "layer 'gel': thickness is 0; it must be more than zero"),
        ({"carbon_thickness": -1e-5}, "layer 'carbon': thickness is -1e-05; it must be more than zero"),
        ({"thickness": 0.0}, "geometry.thickness is 0; it must be more than zero"),
        ({"thickness": 1e-4, "gel_thickness": 1e-4}, "thickness is the sum of the layers"),
        ({"youngs_modulus": 1e4}, "youngs_modulus is made by the strip's layers"),
        ({"gel_porosity": 1.0}, "unknown key 'gel_porosity'"),
    ],
)
def test_impossible_changes(change: dict[str, float], error: str) -> None:
    with pytest.raises(InputError, match=error):
        SOFT.with_(**change)


@pytest.mark.parametrize(
    ("layers", "error"),
    [
        ([CARBON, GEL], "layers: 1 have capacitance_per_volume"),
        ([CARBON, CARBON, GEL], "layers: 2 have capacitance_per_volume"),
        ([replace(CARBON, strain_per_charge=1e-9), GEL, CARBON], "give strain_per_charge of both electrodes"),
        ([CARBON, replace(GEL, thickness=0.3e-3), CARBON], "sum to 0.0004 m, but geometry.thickness is 0.0005 m"),
        ([GEL] * 51, "at most 50"),
        ([{"name": "gel", "thickness": "0.5 mm", "density": "1 g/cm^3", "modulus": 1.0}], "unknown key"),
        ([{"name": "gel", "thickness": "0.5 mm"}], "layer 'gel': density is missing"),
        ([{"name": "Gel 1", "thickness": "0.5 mm", "density": 1e3, "youngs_modulus": 1e4}], "lower-case letters"),
        ([{"name": "gel", "thickness": "0.5 mm", "density": 1e3}], "give either youngs_modulus, or filler"),
    ],
)
def test_impossible_layers(layers: list[object], error: str) -> None:
    with pytest.raises(InputError, match=error):
        PAPER.with_layers(layers)  # type: ignore[arg-type]


def test_study_and_design_vary_layers() -> None:
    from ilg_circuit import design, sweep

    found = sweep(SOFT, "step:1V", "60 s", "gel_thickness=0.1mm,0.4mm", engine="exact", jobs=1, outputs="charge_final")
    assert found.to_xarray().gel_thickness.values.tolist() == [0.1e-3, 0.4e-3]
    assert not found.warnings
    warned = sweep(PAPER, "step:1V", "60 s", "thickness=0.2mm,0.5mm", engine="exact", jobs=1, outputs="charge_final")
    assert any("one layer" in warning for warning in warned.warnings)
    with pytest.raises(InputError, match="no layer 'gold'"):
        design(SOFT, "step:1V", "60 s", "gold_thickness=10nm:1um", maximise="displacement_final")


def test_layers_are_shown() -> None:
    assert "carbon" in SOFT._repr_html_()
    described = SOFT.describe()
    assert [layer["name"] for layer in described["layers"]] == ["carbon", "gel", "carbon"]
    text = summary(described)
    assert "layers, gel_thickness varied                      -1.11" in text
    assert "free length up to 7.16 mm" in text
    assert "give [[layers]]" in summary(PAPER.describe())
