"""Dry friction that grows with what the rotor carries."""

from collections.abc import Mapping
from typing import ClassVar

from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar


class LoadDependentFriction(Effect):
    """D -> D + k (|Q_a| + |Q_b| + |m g R_d| + |F|)

    k: `share` of the pull that becomes friction [-]; Q_a, Q_b: generalised forces of the elements, m g
    R_d and F: of the load and of what drives the rotor [N m or N]. A bearing, gear or screw rubs harder
    the harder it is pressed.
    Source: Duclusaud et al., Extended friction models for the physics simulation of servo actuators
    (2024), arXiv 2410.08650: load-dependent friction of external and motor torque.
    """

    name: ClassVar[str] = "load-dependent-friction"
    port: ClassVar[Port] = "friction"
    dissipative: ClassVar[bool] = True
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "share": Parameter(
            unit="1",
            off=0.0,
            prior=lambda scales: dist.HalfNormal(0.1),
            meaning="share of what pulls at the rotor that becomes dry friction",
        ),
    }

    share: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return value + self.share * signals.pull
