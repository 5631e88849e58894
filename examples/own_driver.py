# %% [markdown]
# # A strip behind a driver of one's own
#
# The strip as a PySpice subcircuit in a user's circuit: a supply of 5 V, a switch of 10 ohm, pulses. The third pin is
# the tip's: at ground it is free.

# %%
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

# %% [markdown]
# The same strip for other programs: a deck that `ngspice -b` runs, a library with parameters.

# %%
print(ilg.netlist("paper", "step:4V", "300 s")[:60])
print(len(ilg.library("paper").splitlines()), "lines of library")
