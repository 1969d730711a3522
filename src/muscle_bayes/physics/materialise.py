"""Intermediate results that are computed once."""

import jax

materialise = jax.lax.optimization_barrier
"""Stop XLA from duplicating this computation (optimization_barrier)."""
