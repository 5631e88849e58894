"""
What a strip does under a square wave
=====================================

Current, displacement, force, charge and energy of the strip, solved by ngspice.
"""

import ilg_circuit as ilg

run = ilg.simulate("paper", "square:-2V..2V,60s", "300 s")
print(run.summary())

# %%
# ``plot`` without axes draws the whole picture.

# sphinx_gallery_alt = "Voltage, current, charge, displacement, force and energy over 300 s of a square wave of 2 V."
axes = run.plot()

# %%
# The suffix says what is written: a picture, a table, or all of it as JSON or as a page.
run.save("square.png")
run.save("square.csv")
print(f"{1e3 * abs(run.displacement).max():.2f} mm at most")
