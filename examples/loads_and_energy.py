"""
Loads at the tip, and where the energy goes
===========================================

A mass, a spring and a damper can hang on the tip. Every run ends with an account: the energy that was delivered,
dissipated and stored by each element, and given to the beam.
"""

import matplotlib.pyplot as plt

import ilg_circuit as ilg

loads = {"free": None, "40 uN/m": "stiffness=40uN/m", "500 mg": "mass=500mg"}

# sphinx_gallery_alt = "Displacement after a step of 4 V: free, against a spring, and with a mass, which swings."
figure, axes = plt.subplots()
for (name, load), line in zip(loads.items(), ("-", "--", ":"), strict=True):
    run = ilg.simulate("paper", "step:4V", "40 s", load=load, engine="exact")
    run.plot(axes, "displacement", label=name, linestyle=line)
axes.legend()

# %%
# The account of the last run, the one with the mass:
print(run.account.summary())
