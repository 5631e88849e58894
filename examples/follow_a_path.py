"""
Which voltage makes the tip follow a path?
==========================================

The voltage nearest to a path, for a driver that gives 4 V and 1 V/s. Where the path is faster than the
strip, the result says by how much.
"""

import ilg_circuit as ilg

slow = ilg.track("paper", "sine:2mm,5mHz", "400 s", voltage="4 V", slew="1 V/s", nodes=201)
fast = ilg.track("paper", "triangle:-2mm..2mm,40s", "120 s", voltage="4 V", slew="1 V/s", nodes=201)
print(slow.summary(), fast.summary(), *fast.warnings, sep="\n")

# %%

# sphinx_gallery_alt = "A path faster than the strip, the displacement behind it, the error, the voltage at its limits."
axes = fast.plot()

# %%
# The voltage is a drive for a simulation, or a file for a potentiostat.

slow.write_drive("drive.csv")
again = ilg.simulate("paper", "file:drive.csv", "400 s", engine="exact")
print(f"the tip goes to {1e3 * again.displacement.max():.2f} mm")

# %%
# The blocked force of a clamped tip follows a path, too.

pressed = ilg.track("paper", "sine:100nN,5mHz", "400 s", quantity="force", nodes=201)
again = ilg.simulate("paper", pressed.drive, "400 s", tip="clamped", engine="exact")
print(f"the force goes to {1e9 * again.force.max():.1f} nN at {pressed.voltage.max():.2f} V")
