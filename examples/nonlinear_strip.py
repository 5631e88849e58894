"""
A strip that is not linear
==========================

With an ``emission_voltage`` the electron path follows a sinh law: two antiparallel diodes in the circuit. With
voltage its current grows faster than in proportion.
"""

import matplotlib.pyplot as plt

import ilg_circuit as ilg

strip = ilg.PAPER.with_(emission_voltage="0.8 V", name="sinh")

# sphinx_gallery_alt = "Current divided by voltage over time for 0.5, 1 and 2 V: the curves do not fall on one another."
figure, axes = plt.subplots()
for volts, line in ((0.5, ":"), (1.0, "--"), (2.0, "-")):
    run = ilg.simulate(strip, f"step:{volts}V", "60 s", beam="static", samples=121)
    axes.plot(run.time, 1e3 * run.current / volts, line, label=f"{volts} V")
    print(f"{volts} V: {1e3 * run.current[-1] / volts:.2f} mA/V in the end")
axes.set_xlabel("time [s]")
axes.set_ylabel("current / voltage [mA/V]")
axes.set_yscale("log")
axes.legend()
