# %% [markdown]
# # The fixture: which friction is it?
#
# Before a muscle can be measured, the rig has to be known. The thesis fitted its rotor twice, once
# with dry (Coulomb) friction and once with friction in proportion to speed, and had to choose by eye.
# Here both are fitted, and how well each predicts the readings decides.
#
# **Synthetic data**, simulated with the thesis' dry friction.

# %%
# %matplotlib inline
from pathlib import Path

from muscle_bayes.compiled import keep_compiled_code

keep_compiled_code()

from muscle_bayes.criticism.compare import compare
from muscle_bayes.criticism.coverage import check_run
from muscle_bayes.data import read_runs
from muscle_bayes.inference.fit import QUICK, fit
from muscle_bayes.inference.identifiability import identify
from muscle_bayes.inference.posterior import Posterior
from muscle_bayes.inference.predictive import predict_from_prior, predict_runs
from muscle_bayes.report.posterior_figures import posterior_figure
from muscle_bayes.report.predictive_figures import predictive_figure, prior_predictive_figure
from muscle_bayes.study.published import TABLE_1

# %% tags=["parameters"]
DATA = Path("../data")
KEPT = Path("../reports/notebooks")
EFFORT = QUICK

# %% [markdown]
# ## What we believe before looking
#
# A prior is a claim about data that are not there yet, and that is how to judge it: simulate runs
# from it. They should be wilder than the record, and not absurd.

# %%
runs = read_runs(sorted(DATA.glob("spring-*.csv")))
prior_predictive_figure(predict_from_prior(runs)[:2], runs[0].metadata.origin)

# %% [markdown]
# ## Two posteriors

# %%
posteriors = {}
for friction, name in (("coulomb", "fixture.nc"), ("linear", "fixture-linear.nc")):
    if not (KEPT / name).exists():
        fit(runs, friction, effort=EFFORT).save(KEPT / name)
    posteriors[friction] = Posterior.load(KEPT / name)

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
compare(posteriors["coulomb"], posteriors["linear"])

# %% [markdown]
# Why it comes out so can be seen: with friction in proportion to speed a swing dies away gradually
# and ends in the middle, while the real one ends at once, and off it.

# %%
for friction, posterior in posteriors.items():
    prediction = predict_runs(posterior, runs)[0]
    check = check_run(prediction)
    print(friction, check)
predictive_figure(prediction, check, runs[0].metadata.origin)

# %% [markdown]
# ## What these runs cannot tell
#
# A contraction of 1 means that the posterior is far narrower than the prior. A report like this one
# belongs to every fit: a number that merely repeats its prior looks just like a measured one.

# %%
identify(posteriors["coulomb"])

# %%
posterior_figure(posteriors["coulomb"], TABLE_1["coulomb"], "fixture")
