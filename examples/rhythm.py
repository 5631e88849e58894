"""
A central pattern generator
===========================

Two Matsuoka neurons inhibit each other. Whether the network oscillates is decided, and not watched: a rest is
proven by eigenvalues, a cycle found by Newton's method.
"""

import ilg_circuit as ilg

run = ilg.cpg("10 s")
print(run.summary())

# sphinx_gallery_alt = "Outputs of two neurons in turn, their difference, and the cycle in the plane of the states."
axes = run.plot()

# %%
# Where does the rhythm begin?
swept = ilg.cpg(sweep="inhibition=1:5:41")
print(swept.summary())

# sphinx_gallery_alt = "Period and amplitude over the inhibition: there is a rhythm between 1.4 and 4, at rest outside."
axes = swept.plot()
