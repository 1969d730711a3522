"""A swing logged in a plain CSV of another rig, and its metadata, to be changed by tests."""

import numpy as np

TOML = """\
format = 1
protocol = "free"
origin = "measured"
[log]
[columns]
time = "t"
position = "x"
position_unit = "rad"
[element_a]
kind = "arm"
mass = 0.3
centre_distance = 0.2
"""
ROWS = 200
TIME = 0.02 * np.arange(ROWS)
SWING = np.round(0.8 * np.exp(-0.2 * TIME) * np.cos(7.0 * TIME), 5)
HEAT = np.round(25.0 + 30.0 * (1 - np.exp(-TIME)), 2)


def toml(columns: str = "", log: str = "", **changes: str) -> str:
    """The metadata with lines added to [columns] and [log], and texts replaced."""
    text = TOML.replace("[log]\n", f"[log]\n{log}\n").replace(
        "[columns]\n", f"[columns]\n{columns}\n"
    )
    for old, new in changes.items():
        text = text.replace(f"{old} = ", f"{old} = {new} # ")
    return text


def csv(
    header: str = "t,x",
    times=None,
    positions=None,
    *others,
    separator: str = ",",
    decimal: str = ".",
    digits: int = 3,
) -> str:
    """Text of the log; `others` are further columns, of numbers or of text."""
    times = TIME if times is None else times
    positions = SWING if positions is None else positions

    def told(value, places) -> str:
        return value if isinstance(value, str) else f"{value:.{places}f}".replace(".", decimal)

    rows = [
        separator.join([told(t, digits), told(x, 5), *(told(one, 2) for one in more)])
        for t, x, *more in zip(times, positions, *others, strict=True)
    ]
    return "\n".join([header, *rows] if header else rows) + "\n"
