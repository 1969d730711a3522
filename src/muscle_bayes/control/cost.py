"""One number for a response, smooth enough to be tuned."""

from dataclasses import dataclass

import jax.numpy as jnp

from muscle_bayes.control.closed_loop import Trace
from muscle_bayes.control.heater import FULL_DUTY
from muscle_bayes.control.scenario import Course
from muscle_bayes.physics.linkage import Scalar


@dataclass(frozen=True)
class Cost:
    """RMS error / RMS setpoint + effort * mean heating + ((T_peak - warm)_+ / (safe - warm))^2

    The first term is 1 for a joint that stays at zero; mean heating is the share of full power, both
    muscles together; the last is 1 where a muscle reaches what the firmware allows.
    """

    effort: float = 0.1
    warm: float = 95.0
    """C"""
    safe: float = 110.0
    """C"""

    def __call__(self, course: Course, trace: Trace) -> Scalar:
        judged = 1.0 * (jnp.arange(trace.angle.size) >= course.judged_from)
        error = (judged * (course.setpoint - trace.angle) ** 2).sum()
        asked = (judged * course.setpoint**2).sum()
        heating = (trace.duty / FULL_DUTY).sum(1).mean()
        hot = jnp.maximum(jnp.max(trace.temperature) - self.warm, 0.0)
        return (
            jnp.sqrt(error / asked) + self.effort * heating + (hot / (self.safe - self.warm)) ** 2
        )
