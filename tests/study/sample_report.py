"""A report's content with every section, and no computation behind it."""

from pathlib import Path

from matplotlib.figure import Figure

from muscle_bayes.json_file import write_json
from muscle_bayes.report.style import save


def grid(*columns: str, rows: int = 2) -> dict:
    return {"columns": list(columns), "rows": [[f"{c} {r}" for c in columns] for r in range(rows)]}


def figures(folder: Path, *keys: str) -> dict:
    listed = {}
    for key in keys:
        fig = Figure(figsize=(3, 2))
        axis = fig.subplots()
        axis.plot([0, 1, 4])
        axis.set_xlabel("time [s]")
        save(fig, folder / "figures" / f"{key}.svg")
        listed[key] = {"path": f"figures/{key}", "caption": f"Figure {key}."}
    return listed


def fit() -> dict:
    return {
        "table": grid("parameter", "unit", "mean", "90 % interval"),
        "converged": "The chains of the fit converged.",
        "printed": ["Of 2 values in Table 1, 2 lie inside the posterior's central 90 %."],
    }


def undetermined() -> dict:
    return {"directions": ["C up with F down: 60% of the prior's variance remains"],
            "trade_offs": ["H and T: −0.98"]}  # fmt: skip


def sample(folder: Path) -> Path:
    """Write figures and report.json; returns the latter's path."""
    content = {
        "title": "A sample <study> & more",
        "synthetic": True,
        "notice": "These data are synthetic.",
        "about": "Of no rig.",
        "preset": "quick",
        "seed": "0",
        "command": "muscle-bayes study --runs data",
        "shortened": "",
        "left_out": [{"name": "control", "why": "there is no muscle"}],
        "answers": {
            "table": grid("quantity", "median", "90 % interval", "unit"),
            "trust": ["The chains converged."], "unknown": ["C with F."], "missing": ["Nothing."],
            "drift": ["It creeps."], "control": ["Use these gains."],
        },
        "residuals": {"a": {"unit": "counts", "time": [0.0, 1.0, 2.0], "residual": [0.1, -0.2, 0.0],
                            **{key: [value] * 3 for key, value in
                               (("q05", -1.0), ("q25", -0.4), ("q75", 0.4), ("q95", 1.0))}}},
        "runs": grid("run", "protocol", "length [s]"),
        "shown_runs": ["a"],
        "fixture": {"coulomb": fit(), "linear": fit(), "law": "coulomb", "friction": "Coulomb.",
                    "undetermined": undetermined()},
        "muscle": {**fit(), "inertia": ["a: the rotor's inertia is left out."],
                   "undetermined": undetermined()},
        "checks": grid("run", "RMSE", rows=20),
        "predicted": ["a"],
        "drift": [{"run": "a", "told": "It creeps.", "table": grid("time [s]", "slope")}],
        "discovery": {
            "told": "Nothing is missing.", "located": "Nowhere.", "windows": grid("run", rows=0),
            "probabilities": grid("the model lacks", "probability"), "tried": "a, b", "ties": ["a, b"],
            "steps": [{"told": "Added: a.", "table": grid("run"), "weakened": "C"}],
            "ending": "The search ended.", "revision": "No effect.", "revised": None, "shown": ["a"],
        },
        "control": {"told": "Better.", "notes": ["simulated"], "how": "Tuned.", "gains": grid("gains"),
                    "risks": grid("scenario"), "figures": ["control-step"]},
        "calibration": {"sbc": grid("posterior"), "sbc_figures": ["sbc-fixture"], "trial": None,
                        "trial_size": "", "gradient": grid("way"), "sampling": None},
        "figures": figures(folder, "run-a", "predicted-a", "misfit", "control-step", "sbc-fixture"),
        "versions": [["python", "3.13"]],
        "checksums": [["a", "0" * 64]],
    }  # fmt: skip
    path = folder / "results" / "report.json"
    write_json(path, content)
    return path
