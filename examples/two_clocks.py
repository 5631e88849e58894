"""
A camera on a clock of its own
==============================

The current comes from the potentiostat, the displacement from a camera that was started by hand. How much later the
camera's clock reads is fitted, with an interval. Where the drive has several edges, its rate is fitted too.
"""

import numpy as np

import ilg_circuit as ilg

random = np.random.default_rng(4)
time = np.arange(-5.05, 40.0, 0.2)
frames = np.arange(-3.2, 40.0, 0.2)
voltage, current = np.zeros(time.size), np.zeros(time.size)
seen = ilg.simulate("paper", "step:4V", times=time[time > 0], engine="exact", beam="static")
voltage[time > 0], current[time > 0] = seen.voltage, seen.current
current += 4e-4 * random.normal(size=time.size)

# %%
# The camera reads 812.4 s earlier. It measures pixels of 42 micrometres.
moved = np.zeros(frames.size)
filmed = ilg.simulate("paper", "step:4V", times=frames[frames > 0], engine="exact", beam="static")
moved[frames > 0] = filmed.displacement
moved += 8e-6 * random.normal(size=frames.size)
camera = {"time_s": frames - 812.4, "x_px": moved / 42e-6}

record = {"time_s": time, "voltage_V": voltage, "current_A": current}
fit = ilg.identify(record, "paper", displacement=camera, scale="42 um/px", model="rc", engine="exact")
low, high = fit["displacement_delay"].interval
print(f"delay {fit['displacement_delay'].value:.3f} s, 95 %: {low:.3f} to {high:.3f} s")

# %%

# sphinx_gallery_alt = "Current and displacement after a step, measured and fitted, both on the voltage's clock."
axes = fit.plot()
