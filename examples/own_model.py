"""
An electrical model of one's own
================================

A function of s and the constants is all: the impedance of what lies in series with Rs, beside Rdc. Fits,
simulations and files know the model by its name.
"""

import numpy as np

import ilg_circuit as ilg


def arc(s, resistance, time, exponent, capacitance):
    """Return a depressed arc and a capacitor."""
    return resistance / (1 + (s * time) ** exponent) + 1 / (capacitance * s)


typical = {"arc_resistance": "30 ohm", "arc_time": "5 s", "arc_exponent": 0.7, "arc_capacitance": "0.5 F"}
ilg.register_model("arc", arc, typical, upper={"arc_exponent": 1})

# %%
frequency = np.geomspace(1e-3, 1e3, 40)
s = 2j * np.pi * frequency
impedance = 1 / (1 / 700 + 1 / (15 + arc(s, 40, 3, 0.8, 0.4)))
impedance *= 1 + 0.002 * np.random.default_rng(4).normal(size=len(s))
fit = ilg.identify(frequency=frequency, impedance=impedance, strip="paper", model="arc")
for name in ("dc_resistance", "series_resistance", *typical):
    print(f"{name:18} {fit[name].value:8.4g} +- {fit[name].stderr:.1g} {fit[name].unit}")

# %%

# sphinx_gallery_alt = "The spectrum with the fit of the depressed arc in Bode and Nyquist plots, and the residuals."
axes = fit.plot()

# %%
run = ilg.simulate(fit.actuator, "step:1V", "60 s", engine="exact", beam="static")
print(f"{1e3 * run.current[0]:.1f} mA at first, {1e3 * run.current[-1]:.2f} mA after a minute")
