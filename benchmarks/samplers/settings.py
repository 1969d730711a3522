"""What samplers that are not ours share."""

TOLERANCE = 1e-7
"""With which diffrax and CVODES err no more than COARSE_ERROR at the mode as well, where noise is small and
so log posterior tells small errors: with ten times more it errs by up to ten there."""
WARMUP = 200
"""Iterations of NUTS, as in our own chains."""
