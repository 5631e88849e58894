"""
A map over two sizes
====================

Two ranges with a number of points each make a grid. Its picture is a map of each output.
"""

import ilg_circuit as ilg

found = ilg.sweep(
    "paper",
    "step:4V",
    "300 s",
    {"thickness": ("0.3 mm", "1 mm", 15), "free_length": ("15 mm", "40 mm", 15)},
    outputs=["displacement_final", "force_blocked"],
    engine="exact",
    jobs=1,
)
print(found.summary())

# %%

# sphinx_gallery_alt = "Two maps over thickness and free length: thin long strips move far, thick short ones push hard."
axes = found.plot()
