# %% [markdown]
# # Checks: would you believe this model?
#
# **You will learn** how to predict a run that was not fitted, and what coverage and creep say.
#
# A model that fits its own data has shown little. Here it has to predict a sawtooth: fast heating to
# 90 °C, cooling, and more load poured on in between. None of it was fitted. Its first 30 % identify
# the potentiometer's zero and the muscle's initial state. The rest is predicted.
#
# **Synthetic data.** The muscle that made them obeys the model's equations, so the checks ought to
# pass. On a real one they would show what is missing, and *Discovery* is about that.

# %%
# %matplotlib inline
from pathlib import Path

import muscle_bayes as mb

_ = mb.keep_compiled_code()

# %% tags=["parameters"]
KEPT = Path("../reports/notebooks")
EFFORT = "quick"

# %%
if not (KEPT / "fixture.nc").exists():
    mb.fit(mb.load_example("springs"), effort=EFFORT).save(KEPT / "fixture.nc")
if not (KEPT / "muscle.nc").exists():
    fixture = mb.load(KEPT / "fixture.nc")
    mb.fit(mb.load_example("staircases"), effort=EFFORT, given=fixture).save(KEPT / "muscle.nc")
muscle = mb.load(KEPT / "muscle.nc")
print("converged" if muscle.converged else muscle.complaints)

# %% [markdown]
# ## Prediction

# %%
(sawtooth,) = mb.load_example("sawtooth")
(prediction,) = mb.predict(muscle, [sawtooth])
check = mb.check(prediction)
mb.plot_prediction(prediction, check, sawtooth.metadata.origin)

# %% [markdown]
# ## Span by span
#
# A good average can hide a bad hour. Here are the same checks in ten spans of time. The mean PIT is
# 0.5 where readings lie evenly about the prediction. It is near 0 where the model is too high, and
# near 1 where it is too low.

# %%
check

# %% [markdown]
# ## Drift while cold
#
# The thesis ended with an open question: at room temperature its muscle crept where the model stood
# still. So that is asked separately. In every cold phase after heating, how fast does the rotor
# move, and how fast should it?

# %%
found = mb.drift(prediction)
found

# %%
mb.plot_drift(prediction, found, sawtooth.metadata.origin)

# %% [markdown]
# An interval that holds zero says that measured and predicted creep agree. It does not say that the
# law of creep is right: only that these phases do not contradict it.
