"""
A frequency response from one record
====================================

A chirp moves the strip through all frequencies once. Its response, with a 95 % band at each frequency and the
coherence, stands beside that of a model. Here the record is a simulated one with noise.
"""

import numpy as np

import ilg_circuit as ilg

run = ilg.simulate("paper", "chirp:1V,20mHz..0.5Hz", "400 s", step="0.25 s", engine="exact", beam="static")
random = np.random.default_rng(4)
moved = run.displacement + 3e-6 * random.normal(size=len(run.time))
record = {"time_s": run.time, "voltage_V": run.voltage, "current_A": run.current, "displacement_m": moved}

measured = ilg.bode_of(record, "paper", beam="static")
print(measured.summary())

# %%

# sphinx_gallery_alt = "Magnitude, phase and coherence of displacement and current: points with bands, a curve."
axes = measured.plot()

# %%
# The mass of the beam is in no band of this record: a model with it is told from the strip.

other = ilg.bode_of(record, "paper", beam="dynamic")
print(other.warnings[-1])
