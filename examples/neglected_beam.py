"""
What does a controller do that was tuned without the beam's mass?
=================================================================

Mallavarapu, Newbury and Leo (Proc. SPIE 4329, 2001) measured the step response of an ionic-polymer strip of
20 mm x 10 mm, designed a linear-quadratic regulator with an observer on it, and simulated a settling time of 0.15 s,
in place of 7 s without control. In the experiment it was 0.95 s, under less than 2.3 V, with overshoot and oscillations
at the natural frequency of the beam, which the model had left out. Here the same happens, and the margins say so first.

Their transfer function, y/u = (12.54 s + 2.26)/(s² + 8.34 s + 2.26), is that of a second-order coupling. Its gain here
is 1 mm/V; Young's modulus, density and damping of the beam are assumptions.
"""

import matplotlib.pyplot as plt
import numpy as np

import ilg_circuit as ilg

strip = ilg.load("paper").with_(
    length="25 mm",
    free_length="20 mm",
    width="10 mm",
    thickness="0.2 mm",
    youngs_modulus="100 MPa",
    density="2 g/cm^3",
    beam_damping_ratio=0.05,
    gain=12.54e-3 / (3 * (20 / 0.2) ** 2),  # y = 3 (L/b)^2 d(s) u
    zero=2.26 / 12.54,
    natural_frequency=np.sqrt(2.26),
    damping_ratio=8.34 / 2 / np.sqrt(2.26),
)

# %%
# The controller, on the beam without its mass:

gains = "speed=60rad/s,observer=10rad/s,integral=20rad/s"
how = {"voltage": "2.3 V", "overshoot": "5%"}
static = ilg.tune(strip, "1 mm", "lqg", gains=gains, beam="static", **how)
print(static.summary(), *static.warnings, sep="\n")

# %%
# The same controller judged on the beam as it is. The margins know the first mode: abs(S) is above what is allowed.

dynamic = ilg.tune(strip, "1 mm", controller=static, beam="dynamic", **how)
print(dynamic.summary(), *dynamic.warnings, sep="\n")
print(f"{np.abs(dynamic.run.voltage).max():.2f} V")

# %%

# sphinx_gallery_alt = "The step response settles at once without the beam's mass, and swings for a second with it."
_, axes = plt.subplots()
for tuned in (dynamic, static):
    axes.plot(tuned.time, 1e3 * tuned.run.displacement, label=f"{tuned.beam} beam, {tuned.settling:.2f} s")
axes.axhline(1.0, color="0.5", linestyle="--")
axes.set(xlabel="time [s]", ylabel="displacement [mm]", xlim=(0, 1.2))
axes.legend()
