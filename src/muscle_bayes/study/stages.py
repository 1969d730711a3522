"""The stages of a study: what each reads, writes and depends on, and why some do not apply."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from muscle_bayes.data import Run
from muscle_bayes.physics.effects.own import own_sources
from muscle_bayes.provenance import source_checksum
from muscle_bayes.study.plan import Plan

FIT: Final = ("physics", "data", "inference")
"""Code that a posterior depends on."""
LIBRARIES: Final = (
    "muscle-bayes", "jax", "numpyro", "diffrax", "arviz", "numpy", "scipy", "matplotlib", "typst"
)  # fmt: skip
DOCUMENT: Final = Path(__file__).parent / "document"
"""Folder of the report's template."""
LOOK: Final = ("report/style.py", "study/steps/figures.py")


@dataclass(frozen=True)
class Stage:
    """A named step of a study, run by `study.steps.STEP.make`."""

    name: str
    step: str
    about: str
    result: Path
    seconds: tuple[float, float]
    """About how long it takes with the quick and the full preset, on two cores [s]."""
    runs: tuple[str, ...] = ()
    needs: tuple[Path, ...] = ()
    """Results of other stages, and other files."""
    also: tuple[Path, ...] = ()
    """What it writes besides its result."""
    code: tuple[str, ...] = ()
    """Layers, or files of the package, besides the step itself."""
    settings: dict[str, Any] = field(default_factory=dict)

    def inputs(self, plan: Plan) -> dict[str, Any]:
        """What it depends on besides the content of files."""
        return {
            "source": source_checksum(*self.code, f"study/steps/{self.step}.py"),
            "versions": {name: version(name) for name in LIBRARIES},
            "until": {run: end for run, end in plan.roles.until.items() if run in self.runs},
            "seed": plan.config.seed,
            "preset": plan.preset,
            "own_effects": own_sources(),
            **self.settings,
        }


@dataclass(frozen=True)
class LeftOut:
    """A stage that does not apply to these runs."""

    name: str
    why: str


def all_stages(plan: Plan) -> tuple[list[Stage], list[LeftOut]]:
    """The stages that apply, in an order in which each finds what it needs, and those that do not."""
    stages = [_data(plan)]
    left: list[LeftOut] = []
    for found in (*_fixture(plan), *_muscle(plan), *_discovery(plan), _control(plan)):
        (stages if isinstance(found, Stage) else left).append(found)  # type: ignore[arg-type]
    stages += [_calibration(plan)]
    return [*stages, _report(plan, stages, left)], left


def _data(plan: Plan) -> Stage:
    return Stage(
        "data",
        "data",
        "what was logged",
        plan.result("data"),
        (8, 20),
        runs=tuple(plan.logs),
        code=("data", "report/run_figure.py", "report/run_summary.py", *LOOK),
    )


def _fit(
    plan: Plan, name: str, friction: str, runs: Sequence[str], given: str | None, **more
) -> Stage:
    return Stage(
        name,
        "fit",
        f"posterior, {friction} friction",
        plan.posterior(name),
        (40, 120) if runs == plan.roles.fixture else (80, 300),
        runs=tuple(runs),
        needs=() if given is None else (plan.posterior(given),),
        code=FIT,
        settings={"friction": friction, "effects": list(plan.config.effects), "given": given},
        **more,
    )


def _checks(plan: Plan, name: str, fit: str, runs: Sequence[str]) -> Stage:
    return Stage(
        name,
        "checks",
        "what the data tell, and predictions beside readings",
        plan.result(name),
        (60, 60) if fit == "muscle" else (15, 60),
        runs=tuple(runs),
        needs=(plan.posterior(fit),),
        code=(*FIT, "criticism", "report", "study/steps/figures.py", "study/published.py"),
        settings={
            "fit": fit,
            "held_out": list(plan.roles.held_out),
            "effects": list(plan.config.effects),
            "published": [table.model_dump() for table in plan.published],
        },
    )


def _of_kind(plan: Plan, moved: bool) -> tuple[str, ...]:
    """Held-out runs with a muscle, or without."""
    return tuple(run.name for run in plan.runs(plan.roles.held_out) if run.has_muscle == moved)


def _fixture(plan: Plan) -> list[Stage | LeftOut]:
    runs = plan.roles.fixture
    if not runs:
        why = "no run without a muscle is fitted; inertia and friction are fitted with the muscle"
        return [LeftOut("fixture", why)]
    fits = [_fit(plan, f"fixture-{law}", law, runs, None) for law in ("coulomb", "linear")]
    main = f"fixture-{plan.config.friction}"
    return [*fits, _checks(plan, "fixture-checks", main, (*runs, *_of_kind(plan, False)))]


def _muscle(plan: Plan) -> list[Stage | LeftOut]:
    runs = plan.roles.muscle
    if not runs:
        return [LeftOut("muscle", "no run with a muscle is fitted")]
    given = f"fixture-{plan.config.friction}" if plan.roles.fixture else None
    return [
        _fit(plan, "muscle", plan.config.friction, runs, given),
        _checks(plan, "muscle-checks", "muscle", (*runs, *_of_kind(plan, True))),
    ]


def _discovery(plan: Plan) -> list[Stage | LeftOut]:
    roles = plan.roles
    base = tuple(plan.posterior(fit) for fit in base_fits(plan))
    found = Stage(
        "discovery",
        "discovery",
        "what the model lacks",
        plan.result("discovery"),
        (200, 400),
        runs=(*roles.fitted, *roles.held_out),
        also=(plan.result("effects"),),
        code=(
            *FIT,
            "criticism",
            "discovery",
            "report/discovery_figures.py",
            "report/discovery_summary.py",
            *LOOK,
        ),
        settings={
            "friction": plan.config.friction,
            "effects": list(plan.config.effects),
            "candidates": plan.config.candidates,
            "held_out": list(roles.held_out),
        },
    )
    revised = Stage(
        "revised",
        "revised",
        "posterior of the model with what was found",
        plan.result("revised"),
        (50, 300),
        runs=(*roles.fitted, *roles.held_out),
        needs=(plan.result("effects"), *base),
        code=(
            *FIT,
            "discovery/nominal.py",
            "report/posterior_figures.py",
            *LOOK,
            "study/published.py",
        ),
        settings={
            "friction": plan.config.friction,
            "held_out": list(roles.held_out),
            "published": [table.model_dump() for table in plan.published],
        },
    )
    return [found, revised]


def base_fits(plan: Plan) -> tuple[str, ...]:
    """Fits of the model that discovery starts from."""
    fixture = (f"fixture-{plan.config.friction}",) if plan.roles.fixture else ()
    return (*fixture, *(("muscle",) if plan.roles.muscle else ()))


def _control(plan: Plan) -> Stage | LeftOut:
    if plan.config.control is False:
        return LeftOut("control", "the study's settings leave it out")
    if not plan.roles.muscle:
        return LeftOut(
            "control", "no run with a muscle is fitted, so there is no joint to simulate"
        )
    if plan.joint is None and not _turns(plan.run(plan.roles.muscle[0])):
        return LeftOut(
            "control",
            "the muscle does not turn a rotor by pins on both, so its rig says nothing of a joint; "
            "name one in the study's settings (`joint`)",
        )
    return Stage(
        "control",
        "control",
        "gains of an antagonistic joint",
        plan.result("control"),
        (60, 500),
        runs=(*plan.roles.muscle, *_of_kind(plan, True)),
        needs=(
            plan.result("revised"),
            plan.posterior("muscle"),
            *([] if plan.joint is None else [plan.joint]),
        ),
        code=(*FIT, "control", "report/control_figures.py", *LOOK),
    )


def _turns(run: Run) -> bool:
    element = run.metadata.element_a
    turning = run.metadata.fixture.motion == "rotary"
    return turning and element.kind == "muscle" and element.linkage == "pins"


def _calibration(plan: Plan) -> Stage:
    return Stage(
        "calibration",
        "calibration",
        "slow checks of the method, where they have been run",
        plan.result("calibration"),
        (10, 10),
        needs=plan.calibrations,
        code=("criticism/sbc.py", "report/calibration_figure.py", "report/trial_figure.py", *LOOK),
        settings={"found": [str(path) for path in plan.calibrations]},
    )


def _report(plan: Plan, stages: Sequence[Stage], left: Sequence[LeftOut]) -> Stage:
    results = tuple(plan.result(stage.name) for stage in stages if stage.step != "fit")
    fits = tuple(stage.result for stage in stages if stage.step == "fit")
    return Stage(
        "report",
        "report",
        "HTML and PDF",
        plan.out / "report.pdf",
        (10, 10),
        needs=(*results, *fits, *sorted(DOCUMENT.rglob("*.*"))),
        also=(plan.out / "report.html", plan.out / "summary.json"),
        code=(
            "study/answers.py",
            "study/contents.py",
            "report/tables.py",
            "report/words.py",
            "inference/posteriors/summary.py",
            "criticism/compare.py",
            "study/published.py",
        ),
        settings={
            "title": plan.config.title,
            "published": [table.model_dump() for table in plan.published],
            "roles": [list(plan.roles.fixture), list(plan.roles.muscle), list(plan.roles.held_out)],
            "left_out": [[one.name, one.why] for one in left],
            "command": plan.started_as,
        },
    )
