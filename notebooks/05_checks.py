# %% [markdown]
# # Checks: would you believe this model?
#
# A model that fits its own data has shown little. Here it has to predict a sawtooth: fast heating to
# 90 °C, cooling, and more load poured on in between. None of it was fitted; its first 30 % tell where
# the potentiometer's zero lies and in what state the muscle began, and the rest is predicted.
#
# **Synthetic data.** The muscle that made them obeys the model's equations, so the checks ought to
# pass. On a real one they would show what is missing, and *Discovery* is about that.

# %%
# %matplotlib inline
from pathlib import Path

from muscle_bayes.compiled import keep_compiled_code

keep_compiled_code()

from muscle_bayes.criticism.coverage import check_run
from muscle_bayes.criticism.drift import drift
from muscle_bayes.data import read_runs
from muscle_bayes.inference.fit import QUICK, fit
from muscle_bayes.inference.posterior import Posterior
from muscle_bayes.inference.predictive import predict_runs
from muscle_bayes.report.predictive_figures import drift_figure, predictive_figure

# %% tags=["parameters"]
DATA = Path("../data")
KEPT = Path("../reports/notebooks")
EFFORT = QUICK

# %%
if not (KEPT / "fixture.nc").exists():
    springs = read_runs(sorted(DATA.glob("spring-*.csv")))
    fit(springs, effort=EFFORT).save(KEPT / "fixture.nc")
if not (KEPT / "muscle.nc").exists():
    staircases = read_runs(sorted(DATA.glob("staircase-*.csv")))
    fixture = Posterior.load(KEPT / "fixture.nc")
    fit(staircases, effort=EFFORT, given=fixture).save(KEPT / "muscle.nc")
muscle = Posterior.load(KEPT / "muscle.nc")
print("converged" if muscle.converged else muscle.complaints)

# %% [markdown]
# ## Prediction

# %%
(sawtooth,) = read_runs([DATA / "sawtooth.csv"])
(prediction,) = predict_runs(muscle, [sawtooth])
check = check_run(prediction)
predictive_figure(prediction, check, sawtooth.metadata.origin)

# %% [markdown]
# ## Span by span
#
# A good average can hide a bad hour. The same checks, in ten spans of time: the mean PIT is 0.5
# where readings lie evenly about the prediction, near 0 where the model is too high, near 1 where
# it is too low.

# %%
check

# %% [markdown]
# ## Drift while cold
#
# The thesis ended with a riddle: at room temperature its muscle crept where the model stood still.
# So that is asked separately. In every cold phase after heating, how fast does the rotor move, and
# how fast should it?

# %%
found = drift(prediction)
found

# %%
drift_figure(prediction, found, sawtooth.metadata.origin)

# %% [markdown]
# An interval that holds zero says that measured and predicted creep agree. It does not say that the
# law of creep is right: only that these phases do not contradict it.
