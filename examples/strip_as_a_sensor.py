"""
A strip as a sensor
===================

The port is reciprocal: a strip that is moved at its tip generates. Shorted, it gives a current; open, a voltage.
Both are tiny in the paper's model, and the numbers say how tiny.
"""

import matplotlib.pyplot as plt

import ilg_circuit as ilg

shorted = ilg.sense("paper", "sine:1mm,0.1Hz", "60 s", terminals="short")
print(shorted.summary())

# %%
opened = ilg.sense("paper", "sine:1mm,0.1Hz", "60 s", terminals="open")
print(opened.summary())

# sphinx_gallery_alt = "Two panels over 60 s of a tip moved by a sine: the current when shorted, the voltage when open."
figure, panels = plt.subplots(2, sharex=True, layout="constrained")
shorted.plot(panels[0], "current")
opened.plot(panels[1], "voltage")
