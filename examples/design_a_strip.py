"""
Which strip bends by 4 mm with the least energy?
================================================

A design within ranges that meets requirements. The report says which limits hold it back, and what 1 % more room
would gain. ngspice simulates the answer again.
"""

import ilg_circuit as ilg

ranges = {"thickness": ("0.2 mm", "1 mm"), "voltage": ("1 V", "4 V")}
wanted = ["displacement_final>=4mm", "force_blocked>=0.1uN"]
report = ilg.design("paper", "step:4V", "300 s", ranges, require=wanted, minimise="energy")
print(report.summary(), *report.warnings, sep="\n")

# %%
report.save("designed.toml")
print(ilg.load("designed.toml"))

# %%

# sphinx_gallery_alt = "The run of the designed strip: its displacement reaches the 4 mm that were required."
axes = report.plot()
