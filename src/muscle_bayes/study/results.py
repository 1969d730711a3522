"""Everything that the stages of a study left, read for its report."""

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from muscle_bayes.criticism.compare import compare
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.posteriors.summary import summarise
from muscle_bayes.study.plan import Plan

Numbers = dict[str, Any]
STAGES = (
    "data", "fixture-checks", "muscle-checks", "discovery", "revised", "control", "calibration"
)  # fmt: skip


@dataclass(frozen=True)
class Results:
    """Numbers of the stages that were run, and the posteriors of fits."""

    plan: Plan
    stages: Mapping[str, Numbers]
    """Without those that were left out."""
    posteriors: Mapping[str, Posterior]

    @classmethod
    def of(cls, plan: Plan, applying: Collection[str]) -> "Results":
        """What lies in the study's folder, of the stages that apply to its runs."""
        roles = plan.roles
        stages = {name: plan.found(name) for name in STAGES if name in applying}
        fits = [*(("fixture-coulomb", "fixture-linear") if roles.fixture else ())]
        fits += ["muscle"] if roles.muscle else []
        fits += ["revised"] if stages["revised"]["fit"] == "revised" else []
        posteriors = {name: Posterior.load(plan.posterior(name)) for name in fits}
        return cls(plan, stages, posteriors)

    @cached_property
    def summaries(self) -> dict[str, Numbers]:
        """Of every fit."""
        return {name: summarise(one) for name, one in self.posteriors.items()}

    @property
    def replaced(self) -> list[str]:
        """The fits that the revised one replaces; none where nothing was added to the model."""
        return self.stages["revised"].get("replaces", [])

    @cached_property
    def friction(self) -> Numbers | None:
        """Dry against linear friction."""
        if "fixture-linear" not in self.posteriors:
            return None
        laws = (self.posteriors["fixture-coulomb"], self.posteriors["fixture-linear"])
        return compare(*laws).as_dict()

    @cached_property
    def checks(self) -> Numbers:
        """Predictions against readings, of every run."""
        return self._merged("checks")

    @cached_property
    def drifts(self) -> Numbers:
        """Creep while cold, of runs that were not fitted."""
        return self._merged("drift")

    def _merged(self, key: str) -> Numbers:
        parts = [self.stages.get(f"{part}-checks", {}) for part in ("fixture", "muscle")]
        return {name: one for part in parts for name, one in part.get(key, {}).items()}

    @property
    def figures(self) -> Numbers:
        """Path and caption of each figure, by key."""
        return {key: one for part in self.stages.values() for key, one in part["figures"].items()}

    @property
    def origins(self) -> list[str]:
        """synthetic, measured, or both"""
        return sorted({run["origin"] for run in self.stages["data"]["runs"].values()})

    @property
    def versions(self) -> Numbers:
        """Of what made the posteriors."""
        return json.loads(next(iter(self.posteriors.values())).tree.attrs["versions"])

    def summary(self) -> Numbers:
        """SUMMARY.json."""
        fits = self.summaries
        without = {key: self._without_figures(key) for key in ("discovery", "revised", "control")}
        parts = ("fixture", "muscle")
        return {
            "origin": self.origins,
            "preset": self.plan.preset,
            "seed": self.plan.config.seed,
            "checksums": {
                name: run["checksum_sha256"] for name, run in self.stages["data"]["runs"].items()
            },
            "versions": self.versions,
            "fixture": {
                law: fits[f"fixture-{law}"]
                for law in ("coulomb", "linear")
                if f"fixture-{law}" in fits
            },
            "friction": self.friction,
            "muscle": fits.get("muscle"),
            "identifiability": {
                part: self.stages[f"{part}-checks"]["identifiability"]
                for part in parts
                if f"{part}-checks" in self.stages
            },
            "checks": {
                name: {key: value for key, value in one.items() if key != "residuals"}
                for name, one in self.checks.items()
            },
            "held_out": list(self.plan.roles.held_out),
            "drift": self.drifts,
            **without,
            "calibration": self._without_figures("calibration"),
            "replaced": self.replaced,
            "not_converged": {
                name: one["complaints"] for name, one in fits.items() if not one["converged"]
            },
        }

    def _without_figures(self, stage: str) -> Numbers | None:
        found = self.stages.get(stage)
        return None if found is None else {k: v for k, v in found.items() if k != "figures"}
