# %% [markdown]
# # Derivatives of a simulation
#
# **You will learn** how to differentiate a simulated run, for its parameters and for its drive, and to
# simulate many muscles at once.
#
# `simulate` solves the plant's equation of motion with diffrax. JAX differentiates through it, compiles it
# and maps it over many parameters. So you can ask which parameter matters when, and design an experiment.
#
# **Synthetic data**: the rig is that of the shipped runs, the parameters are the thesis' Table 2.

# %%
# %matplotlib inline
import jax
import jax.numpy as jnp
from matplotlib import pyplot as plt

import muscle_bayes as mb

jax.config.update("jax_enable_x64", True)

# %% [markdown]
# ## A plant and a drive
#
# A load of 166 g hangs on the muscle. After a minute at 25 °C the muscle warms to 85 °C within a minute,
# and cools as fast.

# %%
(run,) = mb.load_example("staircase-166g")
values = {**mb.TABLE_1["coulomb"], **mb.TABLE_2}
seconds = jnp.arange(0.0, 301.0, 2.0)
heat = jnp.clip(60.0 - jnp.abs(seconds - 120.0), 0.0, 60.0)


def angle(values, heat):
    plant = mb.plant_of(run, values)
    drive = mb.Schedule.sampled(seconds, 25.0 + heat, load=0.166)
    motion = mb.simulate(plant, drive, mb.initial_state(plant, drive), solver=mb.QuasiStatic())
    return motion.ys.q  # type: ignore[union-attr]


turned = jnp.degrees(angle(values, heat))

# %% [markdown]
# ## Which parameter matters when?
#
# `jacfwd` gives the derivative of every reading for every parameter in one solve. Each curve below is the
# change of the angle when one parameter grows by a hundredth of its value.

# %%
slopes = jax.jit(jax.jacfwd(angle))(values, heat)

figure, axes = plt.subplots(2, 1, figsize=(7, 5), sharex=True, layout="constrained")
axes[0].plot(seconds, turned)
axes[0].set(ylabel="angle [deg]")
for name in ("K_modulus", "K_hyst", "H", "D"):
    axes[1].plot(seconds, jnp.degrees(0.01 * values[name] * slopes[name]), label=name)
axes[1].set(xlabel="time [s]", ylabel="change for 1 % [deg]")
axes[1].legend(ncols=4)

# %% [markdown]
# Two curves of the same shape cannot be distinguished by this run. `mb.identify` counts with the same
# derivatives.
#
# ## For the drive
#
# `jax.grad` goes backwards through the solve. How does the last angle depend on the temperature at each
# instant before? The present temperature counts most and is left out of the picture. Of the past, HYST
# remembers the heat, and dry friction the hottest instant, at 120 s, where the rotor turned back.


# %%
def last(heat):
    return jnp.degrees(angle(values, heat)[-1])


memory = jax.jit(jax.grad(last))(heat)
figure, axis = plt.subplots(figsize=(7, 2.4), layout="constrained")
axis.plot(seconds[1:-1], memory[1:-1])
axis.set(xlabel="time [s]", ylabel="last angle per K [deg/K]")

# %% [markdown]
# ## Many muscles at once
#
# `vmap` simulates a thousand muscles whose stiffness differs by a tenth.

# %%
stiffness = values["K_modulus"] * (1.0 + 0.1 * jax.random.normal(jax.random.key(0), (1000,)))
many = jax.jit(jax.vmap(lambda k: angle({**values, "K_modulus": k}, heat)))(stiffness)
peaks = jnp.degrees(many.max(axis=1) - many[:, 0])
print(f"stroke: {peaks.mean():.1f} ± {peaks.std():.1f} degrees")
