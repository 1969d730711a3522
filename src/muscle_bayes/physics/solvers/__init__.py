"""Solvers that know dry friction, and the steps they take."""

from muscle_bayes.physics.solvers.quasi_static import QuasiStatic
from muscle_bayes.physics.solvers.stick_slip import StickSlip

__all__ = ["QuasiStatic", "StickSlip"]
