"""
From an impedance spectrum to the strip
=======================================

A Kramers-Kronig check comes first. Then the model is fitted in closed form, from many starts.
"""

import numpy as np

import ilg_circuit as ilg

made = ilg.PAPER.with_(dynamic_resistivity="5 ohm m", diffusion_time="20 s")
clean = ilg.impedance(made, "5 mHz", "1 kHz", engine="exact")
random = np.random.default_rng(5)
parts = 1 + 0.003 * random.normal(size=(2, len(clean.frequency)))
noisy = parts[0] * clean.impedance.real + 1j * parts[1] * clean.impedance.imag

fit = ilg.identify(frequency=clean.frequency, impedance=noisy, strip="paper", model="warburg")
print(fit.summary())

# %%

# sphinx_gallery_alt = "Bode and Nyquist plots of the measured spectrum with the fitted one, and residuals in percent."
axes = fit.plot()
