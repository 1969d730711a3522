# %% [markdown]
# # Bring your own rig
#
# **You will learn** how to describe a log with other columns, units or mechanics, and to fit it.
#
# Your log has other columns, other units, another mechanism. Nothing has to be programmed for that:
# the TOML beside the CSV describes both. As an example we take the simplest rig there is, a pendulum
# on an axle, filmed with a phone.
#
# **These data are synthetic as well**: the next cell makes them with SciPy, from numbers that we
# choose and then try to find again.

# %%
# %matplotlib inline
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pandas as pd
from scipy.constants import g
from scipy.integrate import solve_ivp

import muscle_bayes as mb

_ = mb.keep_compiled_code()

# %% tags=["parameters"]
EFFORT = "quick"

# %% [markdown]
# ## A pendulum
#
#     (J + m d²) θ'' = -m g d sin θ - D θ'
#
# A bob of mass *m* hangs at a distance *d*, which a scale and a ruler tell. The axle's own inertia
# *J* and its friction *D* are what we want.

# %%
truth = {"J": 2.0e-3, "D": 1.5e-3}  # kg m^2, N m s
mass, distance = 0.200, 0.150  # kg, m

time = np.arange(0.0, 12.0, 1.0 / 30.0)  # 30 frames a second
inertia = truth["J"] + mass * distance**2
swing = solve_ivp(
    lambda t, y: [
        y[1],
        (-mass * g * distance * np.sin(y[0]) - truth["D"] * y[1]) / inertia,
    ],
    (time[0], time[-1]),
    [0.6, 0.0],
    t_eval=time,
    rtol=1e-9,
    atol=1e-9,
)
noise = np.random.default_rng(7).normal(0.0, 0.3, time.size)  # degrees, of reading a frame

folder = Path(mkdtemp())
pd.DataFrame({"frame_time": time, "angle_deg": np.degrees(swing.y[0]) + noise}).to_csv(
    folder / "pendulum.csv", index=False
)

# %% [markdown]
# ## Describe it
#
# `[columns]` says where time and position stand and in which unit. `[element_a]` says what acts on
# the axle: here an arm, in other rigs a `spring`, a `muscle` or `none`. The page *Run format* lists
# every key.

# %%
description = f"""
format = 1
protocol = "spring"
origin = "synthetic"
notes = "A pendulum made with SciPy."

[columns]
time = "frame_time"
position = "angle_deg"
position_unit = "deg"

[fixture]
room_temperature = 21.0

[element_a]
kind = "arm"
mass = {mass}
centre_distance = {distance}
hanging_angle = 0.0

[element_b]
kind = "none"
"""
(folder / "pendulum.toml").write_text(description)
runs = mb.read_runs([folder])
mb.plot_run(runs[0])

# %% [markdown]
# Did we get it wrong? The message says what, where, and how to fix it. Here is a typing error:

# %%
wrong = Path(mkdtemp())
(wrong / "pendulum.csv").write_text((folder / "pendulum.csv").read_text())
(wrong / "pendulum.toml").write_text(description.replace("angle_deg", "angel_deg"))
try:
    mb.read_runs([wrong])
except mb.MuscleBayesError as error:
    print(str(error).replace(str(wrong), "..."))

# %% [markdown]
# ## Fit it
#
# An axle on ball bearings rubs in proportion to speed rather than with a constant torque, so we ask
# for linear friction. (Not sure? *Fixture* compares both.)

# %%
posterior = mb.fit(runs, friction="linear", effort=EFFORT)
posterior

# %%
mb.plot_posterior(posterior, truth, "pendulum")

# %% [markdown]
# The dashed line is the truth, called the published value since outside a tutorial nobody has
# better. The result is what a fit of one short film can say, no more. The bob's *m d²* is taken as
# known. So an error in the ruler would move *J* and appear in no interval.
