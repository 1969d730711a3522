"""Cells that are no numbers, and the true cause where a whole column has them."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from muscle_bayes.data.describing.log_format import LogFormat
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.repairing.ledger import MOST_FAULTY

_CAUSES: tuple[tuple[str, str, str, str], ...] = (
    (
        r"[+-]?\d{1,3}(,\d{3})+\.\d*",
        "have a comma between thousands",
        'add thousands = "," to [log]',
        "log.thousands",
    ),
    (
        r"[+-]?\d{1,3}(\.\d{3})+,\d*",
        "have points between thousands and a decimal comma",
        'add thousands = "." and decimal = "," to [log]',
        "log.thousands",
    ),
    (
        r"[+-]?\d{1,3}([ '’\u00a0\u202f]\d{3})+([.,]\d*)?",
        "have a sign between thousands",
        "add thousands, the sign between them, to [log]",
        "log.thousands",
    ),
    (
        r"[+-]?\d*,\d+([eE][+-]?\d+)?",
        "have a decimal comma",
        'add decimal = "," to [log]',
        "log.decimal",
    ),
    (
        r"[+-]?\d*\.\d+([eE][+-]?\d+)?",
        "have a decimal point",
        'remove decimal = "," from [log]',
        "log.decimal",
    ),
    (
        r"\d{1,2}:\d\d(:\d\d([.,]\d*)?)?\s*[AaPp]\.?[Mm]\.?",
        "are times of a twelve-hour clock",
        'add time_format = "%I:%M:%S %p" to [log]',
        "log.time_format",
    ),
    (
        r"\d{1,2}:\d\d:\d\d:\d+",
        "have a colon before the fraction of a second",
        'add time_format = "%H:%M:%S:%f" to [log]',
        "log.time_format",
    ),
    (
        r"\d{1,4}:\d\d(:\d\d(\.\d*)?)?",
        "are times of day",
        'give time_format = "hms" in [log] where this is the time, or name another column',
        "log.time_format",
    ),
    (
        r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}([T ].*)?",
        "are dates",
        'add time_format to [log], such as "%d.%m.%Y %H:%M:%S" or "iso"',
        "log.time_format",
    ),
    (
        r"0[xX][0-9a-fA-F]+",
        "are hexadecimal",
        "export decimal numbers",
        "columns",
    ),
    (
        r"[+-]?\d+([.,]\d+)?\s*[A-Za-z°µ%][A-Za-z°µ%/^0-9]*",
        "carry a unit behind the number",
        "export plain numbers, and state the unit in [columns]",
        "columns",
    ),
)


def refuse_unreadable_column(
    cells: Sequence[str],
    values: NDArray[np.float64],
    lines: Sequence[int],
    path: Path,
    column: str,
    layout: LogFormat,
) -> None:
    """Say why most of a column's faulty cells are no numbers, where one cause explains them.

    Args:
        cells: text of the column.
        values: what was read from them, NaN where nothing was.
        lines: line of each cell in the file.
        path: serves the message.
        column: the column's own name.
        layout: as in the metadata.

    Raises:
        RunError: more cells than may be repaired share a cause.
    """
    bad = [at for at in np.flatnonzero(np.isnan(values)).tolist() if cells[at].strip().strip('"')]
    bad = [at for at in bad if cells[at].strip().lower() not in ("nan", "+nan", "-nan")]
    if len(bad) <= max(1.0, MOST_FAULTY * len(cells)):
        return
    texts = [cells[at].strip().strip('"').strip() for at in bad]
    for pattern, problem, fix, key in _CAUSES:
        if key == "log.decimal" and layout.decimal == ("," if "comma" in problem else "."):
            continue
        matched = sum(bool(re.fullmatch(pattern, text)) for text in texts)
        if matched > 0.8 * len(texts):
            raise RunError.at(
                path,
                f"{len(bad)} of {len(cells)} cells such as {texts[0][:40]!r} {problem}",
                fix,
                row=int(lines[bad[0]]),
                column=column,
                key=key,
            )
