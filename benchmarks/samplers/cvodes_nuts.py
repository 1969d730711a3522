"""What samplers share that run NUTS on CasADi with CVODES as a black box."""

from benchmarks.competitors.casadi_cvodes import CasadiCvodes
from benchmarks.ode import COARSE_ERROR, damping_for
from benchmarks.samplers.protocol import Frame, Point, Sampler
from benchmarks.samplers.settings import TOLERANCE, WARMUP
from muscle_bayes.inference.model.problem import Problem


class CvodesNuts(Sampler):
    """NUTS of another package; each call of `way` gives log posterior and gradient."""

    settings = "NUTS, diagonal mass matrix and step adapted"
    warmup = WARMUP

    def __init__(self, problem: Problem, frame: Frame) -> None:
        super().__init__(problem, frame)
        self.way = CasadiCvodes(problem, damping_for(COARSE_ERROR), TOLERANCE)

    def density(self, vector: Point) -> float:
        return self.way(vector)[0]
