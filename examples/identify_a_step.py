"""From a measured step to the strip: here the measurement is simulated, with noise and a resting camera.

Run: python examples/identify_a_step.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.identification import identify
from ilg_circuit.measurements.read import read_record
from ilg_circuit.report.axes import save
from ilg_circuit.report.identification import write_actuator
from ilg_circuit.simulation.response import sample_times, simulate
from ilg_circuit.strip.actuator import PAPER

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
response = simulate(PAPER, PiecewiseLinear.step(4.0), sample_times(300.0), beam="static")
random = np.random.default_rng(1)
current = 1e3 * response.current + random.normal(0, 0.5, len(response.time))
displacement = 1e3 * response.displacement + random.normal(0, 0.02, len(response.time))
columns = np.column_stack([response.time, response.voltage, current, displacement])
data = folder / "measured.csv"
np.savetxt(data, columns, delimiter=",", header="time_s,voltage_V,current_mA,displacement_mm", comments="", fmt="%.6g")

result = identify(read_record(data), base=PAPER)
print(result.summary())
write_actuator(result, folder / "fitted.toml")
save(result.figure(), folder / "fit.png")
