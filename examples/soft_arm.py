"""
A soft arm moved by a rhythm
============================

Neurons drive the segments through the circuits of their strips. The arm needs the extra ``arm``; its kernels are
compiled once.
"""

import ilg_circuit as ilg

rhythm = ilg.cpg("10 s")
print(rhythm.summary())

# %%
moved = ilg.arm("2 s", segments=5, coupling="circuit", samples=101)
print(moved.summary())

# %%

# sphinx_gallery_alt = "The arm's shapes over two seconds and the path of its tip, which moves little."
axes = moved.plot()
