"""A strip's answer to a 4 V step: current, displacement and energy, checked and drawn.

Run: python examples/step_response.py [FOLDER]
"""

import sys
from pathlib import Path

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.report.axes import save
from ilg_circuit.report.check import summary
from ilg_circuit.simulation.check import check
from ilg_circuit.simulation.response import sample_times, simulate
from ilg_circuit.strip.actuator import PAPER

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
response = simulate(PAPER, PiecewiseLinear.step(4.0), sample_times(300.0), beam="static")
print(response.summary())
print(summary(check(response, tip="free", beam="static")))
response.write_csv(folder / "step.csv")
save(response.figure(), folder / "step.png")
