"""
From a measured step to the strip
=================================

The table has a column for each quantity, named with its unit as in a CSV file. Here it is simulated, with noise and
a camera's resting readings; the path of a file works as well as the data frame.
"""

import numpy as np
import pandas as pd

import ilg_circuit as ilg

times = np.arange(0.0, 60.0, 0.1)
run = ilg.simulate("paper", "step:4V", times=times, beam="static", engine="exact")
random = np.random.default_rng(1)
rest, noise = np.zeros(50), random.normal(size=(2, 650))
frame = pd.DataFrame(
    {
        "time_s": np.arange(-5.0, 60.0, 0.1),
        "voltage_V": np.append(rest, run.voltage),
        "current_mA": 1e3 * np.append(rest, run.current) + 0.3 * noise[0],
        "displacement_mm": 1e3 * np.append(rest, run.displacement) + 0.005 * noise[1],
    }
)

# %%
# The displacement is fitted by d(s), whose parameters begin with ``coupling_``.
fit = ilg.identify(frame, "paper")
print(fit.summary())
print(*fit.warnings, sep="\n")

# %%

# sphinx_gallery_alt = "Measured and fitted current and displacement after a step of 4 V, with their residuals."
axes = fit.plot()

# %%
# What is saved is a strip, and can be simulated.
fit.save("fitted.toml")
again = ilg.simulate("fitted.toml", "step:4V", "60 s", samples=7)
print(again.to_dataframe()[["time_s", "current_A", "displacement_m"]])
