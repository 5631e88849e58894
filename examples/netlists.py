"""
The strip in any SPICE
======================

A deck runs as it is with ``ngspice -b``. A library holds the strip as a subcircuit whose parameters are the sizes
and constants of the TOML file, so that one file serves strips of any size.
"""

import matplotlib.pyplot as plt
import numpy as np
from PySpice.Spice.Netlist import Circuit

import ilg_circuit as ilg

print(ilg.netlist("paper", "step:4V", "300 s")[:600])

# %%
library = ilg.library("paper")
print(*[line for line in library.splitlines() if line.lower().startswith((".subckt", "+", ".ends"))], sep="\n")

# %%
# The library in a circuit of PySpice: the same strip twice, one of them wider, behind 10 ohm.
circuit = Circuit("two strips")
circuit.subcircuit(ilg.subcircuit("paper", "narrow"))
circuit.subcircuit(ilg.subcircuit(ilg.PAPER.with_(width="10 mm"), "wide"))
circuit.PulseVoltageSource(
    "supply", "in", circuit.gnd, 0, 4, pulse_width=60, period=120, rise_time=1e-3, fall_time=1e-3
)
circuit.R("line", "in", "out", 10)
for name in ("narrow", "wide"):
    circuit.V(f"sense_{name}", "out", name, 0)
    circuit.X(name, name, name, circuit.gnd, circuit.gnd)
simulator = circuit.simulator(temperature=27, nominal_temperature=27)
found = simulator.transient(step_time=0.05, end_time=60, use_initial_condition=True)

# sphinx_gallery_alt = "Currents of a narrow and a wide strip on one driver: the wide one takes about twice as much."
figure, axes = plt.subplots()
for name, line in (("narrow", "-"), ("wide", "--")):
    axes.plot(np.array(found.time), 1e3 * np.array(found[f"vsense_{name}"]), line, label=name)
axes.set_xlabel("time [s]")
axes.set_ylabel("current [mA]")
axes.legend()
