"""
A strip behind a driver of one's own
====================================

The strip as a PySpice subcircuit in a user's circuit: a supply of 5 V, a switch of 10 ohm, pulses. The third pin is
the tip's: at ground it is free.
"""

import matplotlib.pyplot as plt
import numpy as np
from PySpice.Spice.Netlist import Circuit

import ilg_circuit as ilg

circuit = Circuit("driver")
circuit.subcircuit(ilg.subcircuit("paper"))
circuit.PulseVoltageSource(
    "pulses", "supply", circuit.gnd, 0, 5, pulse_width=2, period=10, rise_time=1e-3, fall_time=1e-3
)
circuit.R("switch", "supply", "strip", 10)
circuit.X("actuator", "ilg_strip", "strip", circuit.gnd, circuit.gnd)

# %%
simulator = circuit.simulator(temperature=27, nominal_temperature=27)
found = simulator.transient(step_time=0.02, end_time=20, use_initial_condition=True)
current = -np.array(found["Vpulses"])
print(f"at most {1e3 * current.max():.0f} mA, {1e3 * abs(current.min()):.0f} mA back into the supply")

# sphinx_gallery_alt = "Voltage at the strip and current from the driver over two pulses of 2 s; it discharges between."
figure, panels = plt.subplots(2, sharex=True, layout="constrained")
panels[0].plot(np.array(found.time), np.array(found["strip"]), color="#0072B2")
panels[0].set_ylabel("voltage at the strip [V]")
panels[1].plot(np.array(found.time), 1e3 * current, color="#D55E00")
panels[1].set_ylabel("current [mA]")
panels[1].set_xlabel("time [s]")
