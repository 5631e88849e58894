"""
Several measurements of one strip, fitted together
==================================================

Two steps and a spectrum: one set of parameters for all, and each set of data predicted from the others.
"""

import numpy as np

import ilg_circuit as ilg

random = np.random.default_rng(3)
time = np.arange(-4.0, 40.0, 0.2)
data = []
for volts in (1.0, 3.0):
    run = ilg.simulate("paper", f"step:{volts}V", times=time[time >= -1e-9].clip(0), engine="exact")
    current = np.append(np.zeros(len(time) - len(run.time)), run.current) + random.normal(0, 2e-4, len(time))
    data.append(ilg.read(time=time, voltage=np.where(time < -1e-9, 0.0, volts), current=current, onset="0 s"))
spectrum = ilg.impedance("paper", "10 mHz", "100 Hz", engine="exact", beam="static")
scatter = 1 + 0.002 * random.normal(size=(2, len(spectrum.frequency)))
noisy = scatter[0] * spectrum.impedance.real + 1j * scatter[1] * spectrum.impedance.imag
data.append(ilg.read(frequency=spectrum.frequency, impedance=noisy))

# %%
fit = ilg.identify(data, "paper", model="rc")
print(fit.summary())

# %%

# sphinx_gallery_alt = "Two measured currents and a spectrum with the joint fit, and a table of residuals as bars."
axes = fit.plot()
