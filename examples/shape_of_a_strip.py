"""
The shape of a strip
====================

``simulate`` gives the displacement of one point. ``shape`` gives the whole centre line: free, at rest under weight
and load, or with its inertia.
"""

import matplotlib.pyplot as plt

import ilg_circuit as ilg

strip = ilg.PAPER
run = ilg.simulate(strip, "square:-4V..4V,60s", "60 s", samples=121, engine="exact")
shape = ilg.shape(run)
print(shape)

# sphinx_gallery_alt = "The strip at instants of a square wave, to scale and coloured by time; its tip over time."
shape.plot()

# %%
# Weight and a load change the shape, not only how far the tip goes. A stiffer strip of the same free curvature, held
# in three ways:

# sphinx_gallery_alt = "Three strips under 4 V: weightless an arc, hanging less far, horizontal below the clamp."
figure, axes = plt.subplots()
for orientation in ("weightless", "hanging", "horizontal"):
    held = strip.with_(orientation=orientation, youngs_modulus="5 MPa")
    bent = ilg.shape(ilg.simulate(held, "step:4V", times=[0.0, 60.0], engine="exact"))
    axes.plot(1e3 * bent.x[-1], 1e3 * bent.y[-1], label=orientation)
axes.set_xlabel("x, from the clamp [mm]")
axes.set_ylabel("y, towards the anode [mm]")
axes.set_aspect("equal")
axes.legend()

# %%
# A clamped tip does not move, but the strip does.

held = ilg.shape(ilg.simulate(strip, "step:4V", "60 s", samples=31, engine="exact", tip="clamped"))
print(f"tip {1e3 * held.tip[-1, 1]:.4f} mm, bulge {1e3 * held.y[-1].min():.3f} mm")
