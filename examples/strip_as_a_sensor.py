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

# %%
# A measured strip gives far more than reciprocity, and its signal decays while the tip is held. The law that
# ``identify_sensing`` fits to such a record, the section ``[sensing]`` of a strip's file, takes reciprocity's place.
measured = ilg.PAPER.with_(sensing={"instantaneous": 3.0, "gain_1": -2.0, "time_1": "4 s"})
held = ilg.sense(measured, "step:1mm", "30 s", terminals="open")
print(held.summary())

# sphinx_gallery_alt = "The voltage of a strip whose tip is moved and held: a jump that decays to less than a third."
figure, axes = plt.subplots(layout="constrained")
held.plot(axes, "voltage")
