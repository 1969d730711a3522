"""Plies and coils go taut one after the other."""

from collections.abc import Mapping
from typing import ClassVar

from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.springs import lost_stretch


class Slack(Effect):
    """sigma_offset -> sigma_offset + u,   u = c (1 - c / (2 w)),   c = min(max(x, 0), w)

    x = sigma - sigma_offset - sigma_hyst: stretch left for MODULUS; w: `span` of stretches over which
    the parts of the muscle go taut, evenly [-]. Beyond it a dead length of w / 2 is lost. (A dead
    length that ends at once is no effect of its own: eq. 16's C holds it.)
    Source: recruitment of wavy fibres, Lanir, Journal of Biomechanics 16 (1983).
    """

    name: ClassVar[str] = "slack"
    port: ClassVar[Port] = "offset"
    dissipative: ClassVar[bool] = False
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "span": Parameter(
            unit="1",
            off=0.0,
            prior=lambda scales: dist.HalfNormal(0.05),
            meaning="stretch over which the muscle goes taut",
        ),
    }

    span: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        stretch = signals.strain - value - signals.hyst
        return value + lost_stretch(stretch, self.span)
