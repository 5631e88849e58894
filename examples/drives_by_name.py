"""
Drives by name
==============

A drive is a text: its form, then its values with units. A pair of arrays, times and voltages, does as well.
"""

import matplotlib.pyplot as plt

import ilg_circuit as ilg

drives = (
    "step:4V",
    "square:-2V..2V,20s",
    "triangle:-2V..2V,20s",
    "cv:-1V..1V,200mV/s",
    "pulse:4V,2s,10s",
    "sine:2V,0.1Hz",
    "chirp:1V,0.05Hz..0.5Hz",
    "multisine:1V,0.05Hz..0.5Hz",
    "ramp:0.1V/s",
)

# sphinx_gallery_alt = "Nine panels, one a drive: its voltage, and the strip's displacement, dashed, which lags behind."
figure, panels = plt.subplots(3, 3, figsize=(9, 7), sharex=True, layout="constrained")
for panel, drive in zip(panels.flat, drives, strict=True):
    run = ilg.simulate("paper", drive, "40 s", engine="exact", beam="static", samples=401)
    panel.plot(run.time, run.voltage, color="#0072B2", label="voltage [V]")
    panel.plot(run.time, 1e3 * run.displacement, "--", color="#D55E00", label="displacement [mm]")
    panel.set_title(drive, fontsize="small")
panels[0, 0].legend(fontsize="small")
for panel in panels[-1]:
    panel.set_xlabel("time [s]")
