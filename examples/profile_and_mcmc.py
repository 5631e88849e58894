"""
Intervals by the profile, the bootstrap and a Markov chain
==========================================================

95 % intervals can be made in several ways. Where noise is independent and the data determine the parameters, all
agree.
"""

import matplotlib.pyplot as plt
import numpy as np

import ilg_circuit as ilg

time = np.arange(-5.0, 40.0, 0.5)
after = np.maximum(time, 0.0)
current = np.where(time < 0, 0.0, 4 / 600 + 4 / 20 * np.exp(-after / 7))
current += np.random.default_rng(8).normal(0, 2e-3, len(time))
step = {"time": time, "voltage": np.where(time < 0, 0.0, 4.0), "current": current}

# %%

# sphinx_gallery_alt = "Four intervals of the dynamic resistance, one a method, of nearly the same width about 20 ohm."
figure, axes = plt.subplots()
methods = ("covariance", "bootstrap", "profile", "mcmc")
for place, method in enumerate(methods):
    fit = ilg.identify(**step, strip="paper", model="rc", onset="0 s", engine="exact", intervals=method)
    low, high = fit["dynamic_resistance"].interval
    print(f"{method:12} {low:.3f} to {high:.3f} ohm")
    axes.plot([low, high], [place, place], "-", color="#0072B2", linewidth=3)
    axes.plot(fit["dynamic_resistance"].value, place, "o", color="#D55E00")
axes.axvline(20, color="black", linestyle=":")
axes.set_yticks(range(len(methods)), methods)
axes.set_xlabel("dynamic resistance [ohm] (dotted: the truth)")
figure.tight_layout()
