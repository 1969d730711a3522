# %% [markdown]
# # The fixture: which friction is it?
#
# **You will learn** how to look at priors, compare two models of friction, and choose by prediction.
#
# Before a muscle can be measured, the rig has to be known. The thesis fitted its rotor twice, once
# with dry (Coulomb) friction and once with friction in proportion to speed, and had to choose by eye.
# Here both are fitted, and how well each predicts the readings decides.
#
# **Synthetic data**, simulated with the thesis' dry friction.

# %%
# %matplotlib inline
from pathlib import Path

import muscle_bayes as mb

_ = mb.keep_compiled_code()

# %% tags=["parameters"]
KEPT = Path("../reports/notebooks")
EFFORT = "quick"

# %% [markdown]
# ## What we believe before looking
#
# A prior is a claim about data that are not there yet, and that is how to judge it: simulate runs
# from it. They should be wilder than the record, and not absurd.

# %%
runs = mb.load_example("springs")
mb.plot_prior_prediction(mb.prior_predict(runs)[:2], runs[0].metadata.origin)

# %% [markdown]
# ## Two posteriors

# %%
posteriors = {}
for friction, name in (("coulomb", "fixture.nc"), ("linear", "fixture-linear.nc")):
    if not (KEPT / name).exists():
        mb.fit(runs, friction, effort=EFFORT).save(KEPT / name)
    posteriors[friction] = mb.load(KEPT / name)

# %%
posteriors["coulomb"]

# %%
posteriors["linear"]

# %% [markdown]
# *D* does not mean the same in both: N m in the first, N m s in the second.
#
# ## The verdict
#
# The expected log predictive density asks how probable each reading was for a model that had not seen
# it. The standard error is taken over blocks of time, for readings next to each other say much the
# same.

# %%
mb.compare(posteriors["coulomb"], posteriors["linear"])

# %% [markdown]
# The figure below shows why. With friction in proportion to speed a swing dies away gradually and
# ends in the middle. The recorded one ends at once, and off the middle.

# %%
for friction, posterior in posteriors.items():
    prediction = mb.predict(posterior, runs)[0]
    check = mb.check(prediction)
    print(friction, check)
mb.plot_prediction(prediction, check, runs[0].metadata.origin)

# %% [markdown]
# ## What these runs cannot tell
#
# A contraction of 1 means that the posterior is far narrower than the prior. A report like this one
# belongs to every fit: a number that merely repeats its prior looks just like a measured one.

# %%
mb.identify(posteriors["coulomb"])

# %%
mb.plot_posterior(posteriors["coulomb"], mb.TABLE_1["coulomb"], "fixture")
