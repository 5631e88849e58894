"""
Motion that follows the charge
==============================

By EC (31) a strip moves twice as far at twice the voltage, whatever its charge does. Here it follows the charge through
two relaxations: one that bends it, and a slower one of the other sign, which lets it relax back.
"""

import matplotlib.pyplot as plt

import ilg_circuit as ilg

strip = ilg.load("paper").with_(kind="charge", gain_1="90 nm/V", time_1="5 s", gain_2="-40 nm/V", time_2="40 s")
relaxing = ilg.simulate(strip, "step:2V", "120 s", engine="exact", beam="static")
print(relaxing.summary())

# %%
# A charge that saturates takes the motion with it: at four times the voltage the strip moves less than twice as far.

saturating = strip.with_(saturation_voltage="0.6 V")
runs = [ilg.simulate(saturating, f"step:{volts}V", "120 s", beam="static") for volts in (0.5, 1, 2)]

# %%

# sphinx_gallery_alt = "Displacement over 120 s at 0.5, 1 and 2 V: it peaks, relaxes back, and saturates with voltage."
figure, axes = plt.subplots(figsize=(7, 3.6))
for run, volts in zip(runs, (0.5, 1, 2), strict=True):
    axes.plot(run.time, 1e3 * run.displacement, label=f"{volts} V")
axes.set(xlabel="time [s]", ylabel="displacement [mm]")
axes.legend(frameon=False)

# %%
# How fast it follows a small voltage, about 0 V.

response = ilg.bode(strip, "0.1 mHz", "10 Hz", beam="static")
print(response.summary())

# %%

# sphinx_gallery_alt = "Magnitude and phase of displacement, current and force: the displacement peaks near 8 mHz."
response.plot()
