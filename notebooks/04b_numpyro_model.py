# %% [markdown]
# # The muscle's posterior as a NumPyro model
#
# **You will learn** how to use NumPyro's own tools on a run, and to differentiate a simulation.
#
# `fit` chooses priors and sampler. Here we choose both: the posterior of a run is a plain NumPyro
# model, so everything that NumPyro offers works on it. At the end we differentiate a simulated run.
#
# **Synthetic data**, as in the notebooks before.

# %%
# %matplotlib inline
import arviz as az
import jax
import jax.numpy as jnp
from numpyro import distributions as dist
from numpyro.infer import MCMC, NUTS, Predictive, init_to_median

import muscle_bayes as mb

jax.config.update("jax_enable_x64", True)

# %% [markdown]
# ## A model with priors of our own
#
# We know our rotor to about a tenth (1.2e-3 kg m²), and the stiffness of our muscle to a factor of some
# two (200 N/m). Priors are set by the name of a site or of a parameter of Table 2. The model prints them
# all with their units.

# %%
runs = mb.load_example("staircase-166g")
priors = {"J": dist.LogNormal(-6.7, 0.1), "K_modulus": dist.LogNormal(5.3, 0.5)}
model = mb.calibration_model(runs, priors=priors)
model

# %% [markdown]
# ## Before looking
#
# Readings that these priors allow [counts].

# %%
allowed = Predictive(model, num_samples=20)(jax.random.key(0))
print("time constant [s], 20 draws of the prior:", jnp.round(jnp.sort(allowed["time_constant"])))

# %% [markdown]
# ## Sample
#
# NUTS over everything, from the prior's medians, with few draws: enough to see that it runs. The
# column `ess_bulk` says that they are **not to be used**: NUTS hardly crosses the thresholds that
# the springs' minimum forces make. `fit` samples these and the noise in blocks of their own, and
# starts at the mode.

# %%
kernel = NUTS(model, dense_mass=True, max_tree_depth=5, init_strategy=init_to_median)
mcmc = MCMC(kernel, num_warmup=60, num_samples=40, progress_bar=False)
mcmc.run(jax.random.key(1))
tree = az.from_numpyro(mcmc)
az.summary(tree, var_names=["J", "D", "K_modulus", "time_constant"])

# %%
az.plot_trace(tree, var_names=["D", "K_modulus"])

# %% [markdown]
# ## Through the simulation
#
# `simulate` solves the plant's equation of motion with diffrax, and JAX differentiates through it. A
# load of 166 g hangs, and the muscle warms from 25 to 85 °C in a minute and stays there. How far does
# the rotor turn, and how does that depend on each parameter?

# %%
means = {name: value.mean() for name, value in mcmc.get_samples().items()}
seconds = jnp.arange(0.0, 301.0, 2.0)
drive = mb.Schedule.sampled(seconds, jnp.minimum(25.0 + seconds, 85.0), load=0.166)


def turn(values):
    plant = mb.plant_of(runs[0], values)
    q = mb.simulate(plant, drive, mb.initial_state(plant, drive), solver=mb.QuasiStatic()).ys.q
    return jnp.degrees(q[-1] - q[0])


print(f"{turn(means):.2f} degrees")
slopes = jax.grad(turn)(means)
{name: f"{slopes[name]:.3g} degrees per unit" for name in ("K_modulus", "F_hyst_min", "D")}
