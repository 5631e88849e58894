"""
A strip under a current
=======================

A source of current charges a strip at its own pace; the voltage is then the answer. A limit keeps it within what the
liquid bears: beyond it the source gives way.
"""

import matplotlib.pyplot as plt

import ilg_circuit as ilg

free = ilg.simulate("paper", "current:10mA", "600 s", engine="exact")
limited = ilg.simulate("paper", "current:10mA,limit=4V", "600 s")
print(limited.warnings[0])
print(f"without it {free.voltage[-1]:.2f} V are reached, and {1e3 * free.displacement[-1]:.2f} mm")

# %%
# Up to the limit both runs are one. There the current relaxes to what the strip's electron path takes.

# sphinx_gallery_alt = "Voltage, current and displacement over 600 s: at the limit of 4 V the current falls."
figure, axes = plt.subplots(3, sharex=True)
for run, line, name in ((free, "--", "no limit"), (limited, "-", "limit 4 V")):
    axes[0].plot(run.time, run.voltage, line, label=name)
    axes[1].plot(run.time, 1e3 * run.current, line)
    axes[2].plot(run.time, 1e3 * run.displacement, line)
for panel, label in zip(axes, ("voltage [V]", "current [mA]", "displacement [mm]"), strict=True):
    panel.set_ylabel(label)
axes[1].set_ylim(0, 11)
axes[2].set_xlabel("time [s]")
axes[0].legend()
