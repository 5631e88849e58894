"""
What a thinner strip does
=========================

The papers scale a strip as one material: displacement as b^-2, charge as 1/b. A real one has electrodes of carbon,
which hold the charge, and foils of gold, which may hold the strip. Its layers say what another gel makes of it.
"""

import matplotlib.pyplot as plt
import numpy as np

import ilg_circuit as ilg

gold = {"name": "gold", "thickness": "0.1 um", "youngs_modulus": "79 GPa", "density": "19300 kg/m^3"}
carbon = {"name": "carbon", "thickness": "50 um", "youngs_modulus": "1 MPa", "density": "700 kg/m^3"}
gel = {"name": "gel", "thickness": "0.4 mm", "youngs_modulus": "7.6 kPa", "density": "1250 kg/m^3"}
carbon |= {"capacitance_per_volume": "80 F/cm^3"}  # it stores the charge
carbon_strip = ilg.PAPER.with_layers([carbon, gel, carbon])
gold_strip = ilg.PAPER.with_layers([gold, carbon, gel, carbon, gold])

for name, strip in {"carbon": carbon_strip, "carbon and gold": gold_strip}.items():
    scaling, gravity = strip.describe()["scaling"], strip.describe()["gravity"]["sizes"]
    print(f"{name}: displacement as b^{scaling[-1]['displacement']:.2f} where the gel alone gets thinner")
    for row in gravity:
        print(f"    gravity, {row['law']:9}: r = {row['r']:.3g}, negligible up to {1e3 * row['longest']:.1f} mm")

# %%
# Displacement and charge after 300 s at 4 V, over the whole thickness: the law of one layer, and the gel alone made
# thinner between carbon that stays as it is.

# sphinx_gallery_alt = "Displacement and charge over thickness: one layer falls steeply, layers less or not at all."
thickness = np.linspace(0.2e-3, 1e-3, 17)
figure, axes = plt.subplots(2, sharex=True)
for name, strips in {
    "one layer": [ilg.PAPER.with_(thickness=b) for b in thickness],
    "carbon": [carbon_strip.with_(gel_thickness=b - 0.1e-3) for b in thickness],
    "carbon and gold": [gold_strip.with_(gel_thickness=b - 0.1e-3) for b in thickness],
}.items():
    runs = [ilg.simulate(strip, "step:4V", times=[0.0, 300.0], engine="exact", beam="static") for strip in strips]
    axes[0].loglog(1e3 * thickness, [1e3 * run.displacement[-1] for run in runs], label=name)
    axes[1].loglog(1e3 * thickness, [run.charge[-1] for run in runs], "--" if "gold" in name else "-")
axes[0].set_ylabel("displacement [mm]")
axes[1].set_ylabel("charge [C]")
axes[1].set_xlabel("thickness [mm]")
axes[1].set_xticks([0.2, 0.3, 0.5, 1.0], ["0.2", "0.3", "0.5", "1"])
axes[1].xaxis.set_minor_formatter("")
axes[1].set_yticks([1, 2, 3], ["1", "2", "3"])
axes[1].yaxis.set_minor_formatter("")
axes[0].legend()
