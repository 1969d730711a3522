"""Temperature and angle are logged out of step."""

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Parameter, TemperatureFilter
from muscle_bayes.physics.linkage import Scalar


class ClockOffset(TemperatureFilter):
    """T(t) = T_logged(t + delta)

    delta: `delay`, by how much later the log shows a temperature than the angle of that instant [s].
    Between nodes the course is a cubic (Hermite, slopes of the parabola through three nodes), so that
    the response to delta has no corner at 0; before the first and after the last node it is constant.
    Source: two instruments read one after the other by one host; thesis, appendix B.
    """

    name: ClassVar[str] = "clock-offset"
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "delay": Parameter(
            unit="s",
            off=0.0,
            prior=lambda scales: dist.Normal(0.0, 1.0),
            meaning="delay of the logged temperature behind the logged angle",
        )
    }

    delay: Scalar

    def __call__(
        self, time: Float[Array, " node"], course: Float[Array, " node"]
    ) -> Float[Array, " node"]:
        at = jnp.clip(time + self.delay, time[0], time[-1])
        slope = _slopes(time, course)
        left = jnp.clip(jnp.searchsorted(time, at, side="right") - 1, 0, time.size - 2)
        step = time[left + 1] - time[left]
        lasts = step > 0.0
        x = jnp.where(lasts, (at - time[left]) / jnp.where(lasts, step, 1.0), 0.0)
        rise = course[left + 1] - course[left]
        before, after = step * slope[left] - rise, rise - step * slope[left + 1]
        cubic = course[left] + x * rise + x * (1.0 - x) * ((1.0 - x) * before + x * after)
        # Padding repeats the last node, at which an interval of no length would be found.
        return jnp.where(at >= time[-1], course[-1], cubic)


def _slopes(time: Float[Array, " node"], course: Float[Array, " node"]) -> Float[Array, " node"]:
    """Derivative at each node of the parabola through it and its neighbours; a chord's at the ends."""
    step = jnp.diff(time)
    lasts = step > 0.0
    chord = jnp.where(lasts, jnp.diff(course) / jnp.where(lasts, step, 1.0), 0.0)
    both = step[1:] + step[:-1]
    weighed = step[1:] * chord[:-1] + step[:-1] * chord[1:]
    inner = jnp.where(both > 0.0, weighed / jnp.where(both > 0.0, both, 1.0), 0.0)
    return jnp.concatenate([chord[:1], inner, chord[-1:]])
