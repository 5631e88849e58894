"""The same circuits by the package ``impedance`` (Murbach et al., J. Open Source Softw. 5, 2349, 2020)."""

from __future__ import annotations

import numpy as np
import pytest

from ilg_circuit.strip.models import electrical_model

elements = pytest.importorskip(
    "impedance.models.circuits.elements", reason="the package impedance (with pandas, which it needs) is not installed"
)

F = np.geomspace(1e-3, 1e5, 81)
RE, RDC = 1.5, 420.0


def resistor(value: float) -> np.ndarray:
    return elements.R([value], F)


def branch(resistance: float, capacitance: float) -> np.ndarray:
    return elements.s([resistor(resistance), elements.C([capacitance], F)])


def whole(*ions: np.ndarray) -> np.ndarray:
    return elements.s([resistor(RE), elements.p([resistor(RDC), *ions])])


@pytest.mark.parametrize("scale", [0.3, 1.0, 7.0])
def test_agreement(scale: float) -> None:
    pairs = [(20.0 * scale, 0.01), (100.0, 0.02 * scale), (300.0, 0.5)]
    expected = {f"rc{n}" if n > 1 else "rc": whole(*(branch(*p) for p in pairs[:n])) for n in (1, 2, 3)}
    values = {name: [x for p in pairs for x in p][: 2 * int(name[2:] or 1)] for name in expected}
    values["warburg"] = [10.0, 50.0 * scale, 2.0 / scale]
    # Wo of the package: Z0/(sqrt(j omega tau) tanh(sqrt(j omega tau)))
    expected["warburg"] = whole(elements.s([resistor(10.0), elements.Wo([50.0 * scale, 2.0 / scale], F)]))
    values["cpe"] = [10.0, 0.02 * scale, 0.8]
    expected["cpe"] = whole(elements.s([resistor(10.0), elements.CPE([0.02 * scale, 0.8], F)]))
    for name, z in expected.items():
        ours = electrical_model(name).port([RDC, *values[name]], RE).impedance(2j * np.pi * F, ideal=True)
        assert ours == pytest.approx(z, rel=1e-9), name
