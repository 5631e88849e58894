"""
Neurons that feel their strip
=============================

The angle of the strip goes back into the neurons that drive it. Neurons with a rhythm of their own keep it, and the
slow strip hardly moves. Neurons that only toggle, because they inhibit each other strongly, wait for the strip: it sets
the period, and bends fifty times as far.
"""

import ilg_circuit as ilg

own = ilg.reflex("20 s", "paper", 1, inhibition=2.5)
print(own.summary())
led = ilg.reflex("100 s", "paper", 1, inhibition=4.5)
print(led.summary())

# sphinx_gallery_alt = "Neurons toggle every fourteen seconds; the angle goes up and down, nearly straight."
axes = led.plot()

# %%
# A weaker reflex lets the strip move for longer.
swept = ilg.reflex(strip="paper", sweep="reflex=4:1:4", inhibition=4.5)

# sphinx_gallery_alt = "Period and angle fall as the gain of the reflex grows."
axes = swept.plot()

# %%
# To which frequencies does the rhythm lock, if a sine enters the neurons?
found = ilg.reflex(strip="paper", gain=100, entrain=0.05, inhibition=4.5)
print(f"{found.low:.4f} to {found.high:.4f} Hz, by itself {found.own:.4f} Hz")

# sphinx_gallery_alt = "Phase lags of output and angle rise across a band of frequencies; outside it the phase drifts."
axes = found.plot()
