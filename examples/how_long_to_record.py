"""
How long to record
==================

A step that ends within the slow branch's time constant does not tell the branch from the electron path. The 95 %
intervals say so: the resistance of the path has no upper limit, and the slow capacitance may be several times as large.
Here a strip of two branches (3 s and 15 s) is recorded for 15 s to 60 s.
"""

import matplotlib.pyplot as plt
import numpy as np

import ilg_circuit as ilg

branches, path = [(30.0, 0.1), (50.0, 0.3)], 100.0  # ohm and farad, ohm
random = np.random.default_rng(2)
time = np.arange(-10.0, 60.0, 0.2)
on = time >= 0
since = np.where(on, time, 0.0)
current = np.where(on, 1.5 * (1 / path + sum(np.exp(-since / (r * c)) / r for r, c in branches)), 0.0)
current += 0.005 * current.max() * random.standard_normal(len(time))

lengths = (15, 20, 30, 45, 60)
fits = []
for length in lengths:
    part = time < length
    record = {"time": time[part], "voltage": 1.5 * on[part], "current": current[part]}
    fits.append(ilg.identify(**record, model="rc2", onset="first-level", engine="exact"))
    print(f"{length} s: Rdc {fits[-1]['dc_resistance']}")

# %%
# Intervals over the length of the record; an arrow where the data set no upper limit. The record of 15 s shows no path
# at all: an open circuit is fitted in its place.

# sphinx_gallery_alt = "Intervals of path and slow capacitance: open or wide up to 20 s of record, narrow from 45 s."
figure, panels = plt.subplots(2, sharex=True, layout="constrained")
truths = {"dc_resistance": (path, "electron path [ohm]"), "capacitance_2": (0.3, "slow capacitance [F]")}
for panel, (name, (true, label)) in zip(panels, truths.items(), strict=True):
    panel.axhline(true, color="#D55E00", label="true")
    for length, fit in zip(lengths, fits, strict=True):
        estimate = fit[name]
        if estimate.interval is None:  # an electron path that is not seen
            continue
        low, high = estimate.interval
        if np.isinf(high):
            panel.annotate("", (length, 5 * true), (length, low), arrowprops={"arrowstyle": "->", "color": "#0072B2"})
        else:
            panel.plot([length, length], [low, high], color="#0072B2")
        panel.plot(length, estimate.value, "o", color="#0072B2", label="fit, 95 % interval" if length == 60 else None)
    panel.set_yscale("log")
    panel.set_ylim(true / 2, 6 * true)
    panel.set_ylabel(label)
panels[1].set_xlabel("length of the record [s]")
panels[0].legend()
