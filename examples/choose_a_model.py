"""
Choose an electrical model
==========================

Several models are fitted to the same data. ``candidates`` compares them by the Bayesian information criterion (BIC) and
gives the reason in numbers.
"""

import matplotlib.pyplot as plt
import numpy as np

import ilg_circuit as ilg

made = ilg.PAPER.with_(dynamic_resistivity="5 ohm m", diffusion_time="20 s")
clean = ilg.impedance(made, "5 mHz", "1 kHz", engine="exact")
noise = 1 + 0.003 * np.random.default_rng(5).normal(size=(2, len(clean.frequency)))
measured = {
    "frequency": clean.frequency,
    "impedance": noise[0] * clean.impedance.real + 1j * noise[1] * clean.impedance.imag,
}

fit = ilg.identify(**measured, strip="paper")
for candidate in fit.candidates:
    print(f"{candidate.model:8} {candidate.reason}")

# %%
# R-C branches leave a trend in the residuals; the Warburg element leaves noise.

# sphinx_gallery_alt = "Residuals of the modulus over frequency: two branches leave a trend, the Warburg element noise."
figure, panels = plt.subplots(2, sharex=True, layout="constrained")
for panel, model in zip(panels, ("rc2", "warburg"), strict=True):
    one = ilg.identify(**measured, strip="paper", model=model)
    curve = next(iter(one.curves()))
    share = abs(curve.fitted) / abs(curve.measured) - 1
    panel.semilogx(curve.x.values, 100 * share, "o-", color="#0072B2", markersize=3)
    panel.set_ylabel(f"{model}: residual [%]")
panels[1].set_xlabel("frequency [Hz]")
