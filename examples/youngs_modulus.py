"""
Young's modulus from load tests
===============================

A gel is pulled, and a sheet is stretched. One incompressible Ogden material is fitted to both tests; its Young's
modulus goes into a strip's file.
"""

import numpy as np

import ilg_circuit as ilg

stretch = np.linspace(1.0, 1.8, 17)
random = np.random.default_rng(6)
pulled = 2.6 * (stretch - stretch**-2) * (1 + 0.005 * random.normal(size=17))
planar = 2.6 * (stretch - stretch**-3) * (1 + 0.005 * random.normal(size=17))
gel = ilg.ogden(
    {"stretch": stretch, "stress_kPa": pulled},
    planar={"stretch": stretch, "stress_kPa": planar},
)
print(gel.summary())

# %%

# sphinx_gallery_alt = "Nominal stress over stretch of both tests with the fitted material and its predictions."
axes = gel.plot()
