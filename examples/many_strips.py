"""Twenty strips of different thickness solved together in one ngspice netlist: displacement goes as 1/b^2, EC (37).

Run: python examples/many_strips.py
"""

from dataclasses import replace

import numpy as np

from ilg_circuit.circuit import strip_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.solve import transient
from ilg_circuit.strip.actuator import PAPER

thicknesses = np.linspace(0.3e-3, 1e-3, 20)
strips = [replace(PAPER, geometry=replace(PAPER.geometry, thickness=float(b))) for b in thicknesses]
waves = transient([strip_netlist(s, beam="static") for s in strips], PiecewiseLinear.step(4.0), [100.0, 600.0])
final = waves.values[:, waves.names.index("displacement"), -1]
for b, y in zip(thicknesses, final, strict=True):
    print(f"b = {1e3 * b:.3f} mm   y = {1e3 * y:.4f} mm   y b^2 = {y * b**2:.5e} m^3")
