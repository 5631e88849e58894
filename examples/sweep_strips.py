"""
Many strips at once
===================

A random sweep over geometry and stiffness: which strips move far and push hard? A sweep needs the extra ``study``.
"""

import matplotlib.pyplot as plt

import ilg_circuit as ilg

found = ilg.sweep(
    "paper",
    "step:4V",
    "300 s",
    {"thickness": ("0.3 mm", "1 mm"), "free_length": ("15 mm", "40 mm"), "youngs_modulus": "5kPa:50kPa:log"},
    random=200,
    method="sobol",
    outputs=["displacement_peak", "relative_deflection", "force_blocked", "settling_time"],
    engine="exact",
    jobs=1,
)
print(found.summary())

# %%
data = found.to_xarray()
small = data.where(data.relative_deflection < 0.2, drop=True)
best = small.isel(design=int((small.displacement_peak * small.force_blocked).values.argmax()))
print(f"{small.sizes['design']} of 200 strips stay within small deflection; the most displacement times force:")
print(
    f"b = {1e3 * best.thickness:.2f} mm, L0 = {1e3 * best.free_length:.1f} mm, E = {best.youngs_modulus / 1e3:.1f} kPa"
)

# sphinx_gallery_alt = "Blocked force over displacement of 200 strips; within small deflection they are filled."
figure, axes = plt.subplots()
axes.loglog(1e3 * data.displacement_peak, 1e6 * data.force_blocked, "o", color="#0072B2", fillstyle="none")
axes.loglog(1e3 * small.displacement_peak, 1e6 * small.force_blocked, "o", color="#0072B2")
axes.set_xlabel("peak displacement [mm]")
axes.set_ylabel("blocked force [uN]")
