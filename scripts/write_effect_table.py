"""Write docs/effects.md, "Which effect could my rig have?": from what each effect says of itself."""

from pathlib import Path

from muscle_bayes.report.effect_text import EffectText, catalogue

PAGE = Path(__file__).parents[1] / "docs" / "effects.md"
GROUPS = {
    "The rotor and its bearing": ("torque", "friction"),
    "Force and length of the muscle": ("tension", "offset", "modulus"),
    "Creep of the muscle (HYST)": ("damper", "flow"),
    "Heat": ("temperature",),
    "Sensor": ("reading",),
}
"""Headings, and the ports whose effects stand below them."""
HEAD = """# Which effect could my rig have?

Written by `make effect-table`; do not edit. Terms: [glossary](glossary.md).

An effect corrects one quantity of the model. At its off values it changes nothing. Read what each does, and
try what fits your rig:

    muscle-bayes discover RUN... --hold-out NAME
    muscle-bayes fit RUN... --effect NAME --out POSTERIOR.nc

`discover` tries all that the runs could show. An effect of your own takes [one file](architecture.md).
"""


def entry(one: EffectText) -> str:
    """One effect: what it does, equation, parameters, source."""
    lines = [
        f"### `{one.name}`",
        "",
        f"{one.what}.",
        "",
        f"    {one.equation}",
        "",
        *(f"- `{name}` [{unit}]: {meaning}" for name, unit, meaning in one.parameters),
        "",
        f"Acts on: {one.port}. Source: {one.source}.",
        "",
    ]
    return "\n".join(lines)


def page() -> str:
    """The page's text."""
    parts = [HEAD]
    for heading, ports in GROUPS.items():
        parts.append(f"## {heading}\n")
        parts += [entry(one) for one in catalogue() if one.port in ports]
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
