"""What a run holds, in numbers (for JSON) and in words (for the terminal)."""

from math import degrees
from typing import Any

import numpy as np
from numpy.typing import NDArray

from muscle_bayes.data import Run
from muscle_bayes.data.units import SI_OF_DRIVE


def summarise(run: Run) -> dict[str, Any]:
    """Facts of a run. Times in s, temperatures in C, loads in kg, coordinates in rad or m."""
    table, metadata = run.table, run.metadata
    linear, velocity = metadata.fixture.motion == "linear", run.measured == "velocity"
    spacing = np.diff(table["time"].to_numpy())
    labels = ("min", "p05", "median", "p95", "max")
    percentiles = np.percentile(spacing, [0, 5, 50, 95, 100])
    return {
        "name": run.name,
        "path": None if run.path is None else str(run.path),
        "protocol": metadata.protocol,
        "origin": metadata.origin,
        "notes": metadata.notes,
        "rows": len(table),
        "duration_s": run.duration,
        "spacing_s": dict(zip(labels, percentiles.tolist(), strict=True)),
        "gaps_s": run.gaps,
        "position": {
            "unit": run.unit,
            "reading": _range(table["reading"].to_numpy()),
            "resolution": run.output_sensor.resolution,
            "zero": run.output_sensor.zero,
            "zero_uncertainty": run.output_sensor.zero_uncertainty,
            "measured": run.measured,
            "held": metadata.columns is not None and metadata.columns.position is None,
            "coordinate_unit": ("m" if linear else "rad") + ("/s" if velocity else ""),
            "coordinate": _range(run.output),
        },
        "force": _range(table["force"].to_numpy()) if run.has_force else None,
        "force_unit": metadata.force_unit,
        "temperature_c": {
            side: _range(table[f"temperature_{side}"].to_numpy())
            for side in "ab"
            if run.has_thermometer(side)
        },
        "power": {
            side: _range(table[f"power_{side}"].to_numpy())
            for side in "ab"
            if metadata.is_heated_by_power(side)
        },
        "power_unit": SI_OF_DRIVE[metadata.power_unit.kind],
        "load_kg": sorted(set(table["load"].tolist())),
        "load_steps_s": list(run.load_steps),
        "applied": _range(table["applied"].to_numpy()),
        "applied_unit": SI_OF_DRIVE[metadata.drive_unit.kind],
        "elements": {
            side: getattr(metadata, f"element_{side}").model_dump(exclude_none=True)
            for side in ("a", "b")
        },
        "repairs": [
            {"rule": r.rule, "count": r.count, "first_row": r.first_row, "note": r.note}
            for r in run.repairs
        ],
        "checksum_sha256": run.checksum,
    }


def summary_lines(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Label and sentence of each fact worth a line."""
    synthetic = summary["origin"] == "synthetic"
    spacing, gaps = summary["spacing_s"], summary["gaps_s"]
    lines = [
        ("protocol", summary["protocol"]),
        ("origin", "SYNTHETIC - made by a simulation" if synthetic else "measured"),
        ("notes", summary["notes"]),
        ("rows", f"{summary['rows']} in {summary['duration_s']:.2f} s"),
        (
            "spacing",
            f"median {spacing['median']:.4g} s, 5-95 % {spacing['p05']:.4g} to "
            f"{spacing['p95']:.4g} s, longest {spacing['max']:.4g} s",
        ),
        ("gaps", "; ".join(f"{start:.2f} to {end:.2f} s" for start, end in gaps[:5])),
        ("more gaps", f"{len(gaps) - 5}" if len(gaps) > 5 else ""),
        (summary["position"]["measured"], _position(summary["position"])),
        ("force", _between(summary["force"] or [0.0], summary["force_unit"])),
        ("temperature", _sides(summary["temperature_c"], "{:.1f}", "C")),
        ("heater", _sides(summary["power"], "{:.4g}", summary["power_unit"])),
        ("load", _loads(summary["load_kg"], summary["load_steps_s"])),
        ("applied", _between(summary["applied"], summary["applied_unit"])),
    ]
    lines += [(f"element {side}", _element(summary["elements"][side])) for side in ("a", "b")]
    repairs = [f"{r['count']} x {r['rule']}, first in row {r['first_row']}; {r['note']}" for r in
               summary["repairs"]]  # fmt: skip
    lines.append(("repairs", "\n".join(repairs) or "none"))
    lines.append(("sha256", summary["checksum_sha256"]))
    return [(label, told) for label, told in lines if told]


def _range(values: NDArray[np.float64]) -> list[float]:
    return [float(np.min(values)), float(np.max(values))]


def _between(limits: list[float], unit: str) -> str:
    return f"{limits[0]:.4g} to {limits[1]:.4g} {unit}" if any(limits) else ""


def _position(position: dict[str, Any]) -> str:
    low, high = position["coordinate"]
    if position["held"]:
        return f"held at {low:.4g} {position['coordinate_unit']}"
    si = position["coordinate_unit"]
    if si.startswith("m"):
        shown = (low * 1e3, high * 1e3, f"m{si}")
    else:
        shown = (degrees(low), degrees(high), si.replace("rad", "deg"))
    resolution = position["resolution"]
    step = f", step {resolution:.4g} {position['unit']}" if resolution else ", no grid"
    first, last = position["reading"]
    doubt = position["zero_uncertainty"]
    zero = f"zero {position['zero']:.5g} " + (f"± {doubt:.4g}" if doubt else "(exact)")
    return (
        f"{first:.5g} to {last:.5g} {position['unit']}{step}, {zero}\n"
        f"= {low:.4g} to {high:.4g} {si} = {shown[0]:.4g} to {shown[1]:.4g} {shown[2]}"
    )


def _sides(sides: dict[str, list[float]], number: str, unit: str) -> str:
    """The range of each side."""
    told = []
    for side, limits in sides.items():
        low, high = map(number.format, limits)
        told.append(f"{side.upper()} {low if low == high else f'{low} to {high}'} {unit}")
    return "; ".join(told)


def _loads(masses: list[float], steps: list[float]) -> str:
    if not any(masses):
        return "none"
    told = f"{_listed(masses)} kg"
    return f"{told}, changed at {_listed(steps)} s" if steps else told


def _listed(values: list[float]) -> str:
    return ", ".join(f"{value:.5g}" for value in values[:8]) + (", ..." if len(values) > 8 else "")


def _element(element: dict[str, Any]) -> str:
    keys = ", ".join(f"{key} {value}" for key, value in element.items() if key != "kind")
    return f"{element['kind']} ({keys})" if keys else element["kind"]
