"""The reference spring of the thesis."""

from muscle_bayes.physics.effect import Effect
from muscle_bayes.physics.elements.element import Element, Instant
from muscle_bayes.physics.linkage import Linkage, Scalar
from muscle_bayes.physics.springs import reference_spring


class ReferenceSpring(Element):
    """The reference spring (thesis, eq. 12): massless, lossless."""

    linkage: Linkage

    def tension(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        return reference_spring(self.linkage.length(now.q))

    def force(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        return -self.tension(now, effects) * self.linkage.lever(now.q)
