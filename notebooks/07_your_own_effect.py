# %% [markdown]
# # Write your own effect
#
# **You will learn** how to write an effect of your own, and to test whether the runs want it.
#
# The catalogue holds what others thought of. Your rig may do something else. An effect is one class
# in one file. Fitting, predicting and discovery with its cross-validation then work with yours as
# with the package's own.
#
# Our suspicion for this notebook: the axle carries magnets. They pull the rotor
# towards eight angles, a torque that repeats with the angle:
#
#     Q  ->  Q + a sin(8 q)
#
# **Synthetic data**, and whoever made them knew nothing of magnets. The right answer is "no, and if
# so, less than this".

# %%
# %matplotlib inline
import os
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
from matplotlib import pyplot as plt

import muscle_bayes as mb

_ = mb.keep_compiled_code()

import jax.numpy as jnp

from muscle_bayes.physics.effect import PORTS, Signals
from muscle_bayes.physics.effects import effect_type

# %% tags=["parameters"]
KEPT = Path("../reports/notebooks")
EFFORT = "quick"

# %% [markdown]
# ## A port
#
# An effect corrects one quantity of the plant. These are the ports:

# %%
for port, carries in PORTS.items():
    print(f"{port:12} {carries}")

# %% [markdown]
# ## The file
#
# The class states its name, its port, and whether it can only take energy away. For each parameter it
# states the unit, a prior, and the value at which the effect is *exactly* absent. With that value the
# model with the effect contains the model without it. So the two can be compared fairly.

# %%
source = '''"""Magnets in the axle."""

import jax.numpy as jnp
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter


class Magnets(Effect):
    """Q -> Q + a sin(8 q)

    a: `amplitude` [N m]; q: angle [rad]. Source: our suspicion.
    """

    name = "magnets"
    port = "torque"
    dissipative = False
    parameters = {
        "amplitude": Parameter(
            unit="N m",
            off=0.0,
            prior=lambda scales: dist.Normal(0.0, 0.1 * scales.force),
            meaning="largest torque of the magnets",
        )
    }

    amplitude: float

    def __call__(self, value, signals):
        return value + self.amplitude * jnp.sin(8.0 * signals.q)
'''
file = Path(mkdtemp()) / "magnets.py"
file.write_text(source)
os.environ["MUSCLE_BAYES_EFFECTS"] = str(file)
magnets = effect_type("magnets")
magnets

# %% [markdown]
# Look at it before using it. At `off` it does nothing, and for any other amplitude it does what its
# equation says:

# %%
angles = jnp.linspace(-1.0, 1.0, 200)
rest = Signals(**{name: jnp.zeros(()) for name in Signals._fields} | {"memory": {}})
torque = np.array([float(magnets(0.01)(0.0, rest._replace(q=q))) for q in angles])
assert magnets.off()(0.25, rest._replace(q=angles[7])) == 0.25

figure, axis = plt.subplots(figsize=(6, 2.2), layout="constrained")
axis.set(xlabel="angle [deg]", ylabel="torque [N m]", title="magnets of 0.01 N m")
(line,) = axis.plot(np.degrees(angles), torque)
# %% [markdown]
# ## Fit with it
#
# By name, as any other.

# %%
runs = mb.load_example("springs")
if not (KEPT / "fixture.nc").exists():
    mb.fit(runs, effort=EFFORT).save(KEPT / "fixture.nc")
plain = mb.load(KEPT / "fixture.nc")
suspected = mb.fit(runs, effects=["magnets"], effort=EFFORT)
suspected

# %%
mb.plot_posterior(suspected, {"magnets.amplitude": 0.0}, "fixture with magnets")

# %%
amplitude = suspected.tree["posterior"]["magnets.amplitude"].to_numpy()
low, high = np.quantile(amplitude, [0.05, 0.95])
print(f"the torque of the magnets lies between {low:.2g} and {high:.2g} N m with 90 % probability")

# %% [markdown]
# ## Does it predict better?

# %%
mb.compare(plain, suspected, ("without", "with magnets"))

# %% [markdown]
# "Neither", if all is well: an effect that is absent must not win. On the command line:
#
# ```sh
# MUSCLE_BAYES_EFFECTS=magnets.py muscle-bayes fit data/spring-*.csv --effect magnets --out m.nc
# ```
