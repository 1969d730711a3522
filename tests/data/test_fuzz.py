"""Whatever stands in a log and its metadata: a run, or a message that says how to fix it."""

import tempfile
from pathlib import Path

import jax
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from muscle_bayes.data import Run, assumptions
from muscle_bayes.data.guessing.answers import Answers, next_question
from muscle_bayes.data.guessing.draft import draft_of
from muscle_bayes.data.guessing.guess import guess_log
from muscle_bayes.data.reader import run_from_bytes
from muscle_bayes.data.writer import toml_value
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model.problem import pose

NAMES = ["t", "x", "T", "time_ms", "angle (deg)", "kg", "force", "Time, s", "#t", "", "x", "1"]
CELLS = st.one_of(
    st.floats(width=32).map(repr),
    st.integers(-10, 2000).map(str),
    st.floats(-10, 10).map(lambda x: f"{x:.3f}".replace(".", ",")),
    st.sampled_from(
        [
            "",
            " ",
            "nan",
            "-inf",
            "1e999",
            "1e308",
            "-1e308",
            "n/a",
            '"',
            '"1',
            "0x1F",
            "12:00:01",
            "2024-02-30 10:00:00",
            "2024-02-29T10:00:00.5+01:00",
            "99:99:99",
            "1,234.5",
            "1_0",
            "٣",
            "85",
            "-1",
            "(ms)",
            "V",
            "\x00",
            "ÿ",
            "3 C",
            "True",
            "1;2",
            "1\t2",
            "00:00:00",
            "9" * 400,
        ]
    ),
)


def mostly(common, *rare):
    """Draws of `common`, but one in six of one of the others."""
    return st.integers(0, 5).flatmap(lambda n: st.one_of(*rare) if n == 5 else common)


SEPARATORS = mostly(st.just(","), st.sampled_from([";", "\t", " ", "|"]))


@st.composite
def tables(draw) -> str:
    """Rows of cells, mostly of numbers that rise, with faults strewn in."""
    separator = draw(SEPARATORS)
    width, rows = (
        draw(mostly(st.sampled_from([3, 4]), st.just(1), st.just(2))),
        draw(st.integers(5, 60)),
    )
    step = draw(mostly(st.just(0.01), st.sampled_from([1.0, 20.0, 0.0, -1.0, 1e-9])))
    start = draw(mostly(st.just(0.0), st.sampled_from([1.6e12, 65.4, 4294967.1, -5.0])))
    names = ["t", "x", "T", "kg"][:width] if width > 1 else ["x"]
    if draw(st.integers(0, 5)) == 5:
        names = [draw(st.sampled_from(NAMES)) for _ in range(width)]
    lines = [separator.join(names)]
    lines += [
        separator.join([f"{start + step * i:.9g}", *(f"{(i * 7) % 5 + 0.1:g}",) * (width - 1)])
        for i in range(rows)
    ]
    for _ in range(draw(st.sampled_from([0, 1, 1, 2, 3, 6]))):
        at = draw(st.integers(0, len(lines) - 1))
        cells = lines[at].split(separator)
        cells[draw(st.integers(0, len(cells) - 1))] = draw(CELLS)
        kind = draw(st.sampled_from(["cell", "short", "long", "twice", "line"]))
        if kind == "short":
            cells = cells[:-1]
        elif kind == "long":
            cells.append(draw(CELLS))
        lines[at] = separator.join(cells)
        if kind == "twice":
            lines.insert(at, lines[at])
        elif kind == "line":
            lines.insert(at, draw(st.sampled_from(["", "# note", "sep=;", "(s);(deg)", ",,,"])))
    return draw(st.sampled_from(["\n", "\r\n", "\r"])).join(lines)


LOGS = mostly(
    tables().map(str.encode),
    tables().map(lambda text: text.encode("utf-16")),
    st.text(alphabet=',;\t\n"0123456789.-+eE:xtT #=()ms', max_size=300).map(str.encode),
    st.binary(max_size=200),
)

UNITS = st.sampled_from(
    [
        "rad",
        "deg",
        "mm",
        "m",
        "rev",
        "rad/s",
        "counts",
        "s",
        "ms",
        "kg",
        "degF",
        "K",
        "",
        "**",
        "m^",
        "1/0",
        "m**9",
        "grad",
        "dB",
        "delta_degC",
        "N",
        "Nm",
        "(",
        "µm",
        "°",
    ]
)
NUMBERS = st.one_of(
    st.floats(), st.integers(-3, 1000), st.sampled_from([0.1, 1.0, 1e308, 5e-324, 10**400])
)
VALUES = st.one_of(NUMBERS, UNITS, st.booleans(), st.lists(NUMBERS, max_size=3).map(tuple))
KEYS = {
    "": ["protocol", "origin", "notes"],
    "log": [
        "separator",
        "decimal",
        "thousands",
        "skip_lines",
        "comment",
        "encoding",
        "header",
        "sample_rate",
        "time_format",
        "group",
    ],
    "columns": [
        "time",
        "time_unit",
        "position",
        "position_unit",
        "position_sign",
        "position_zero",
        "temperature_a",
        "temperature_unit",
        "load",
        "load_unit",
        "applied",
        "applied_unit",
        "applied_sign",
        "accept_units",
        "position_zero_uncertainty",
        "power_a",
        "power_unit",
        "force",
        "force_unit",
        "force_sign",
    ],
    "fixture": ["stops", "motion", "room_temperature", "disc_radius", "rotor_radius_a", "inertia"],
    "drive": ["gain", "offset", "back_emf"],
    "potentiometer": ["zero_reading", "radians_per_count", "bits", "zero_uncertainty"],
    "thermometer": ["delay", "delay_uncertainty"],
    "thermometer_log": ["file", "time", "time_unit", "offset"],
    "heater_a": ["heating_rate", "cooling_time"],
    "element_a": [
        "kind",
        "mass",
        "centre_distance",
        "rate",
        "free_length",
        "tension_at_zero",
        "damping",
        "linkage",
        "base_length",
        "length_at_zero",
        "closed_length",
        "model",
        "moment",
        "moment_of_inertia",
        "hanging_angle",
    ],
    "load": ["time", "mass", "unit"],
}
CAMERA = Path(tempfile.mkdtemp()) / "camera.csv"
CAMERA.write_text("\n".join(["t,T", *(f"{t / 9:.3f},{25 + t % 60}" for t in range(-90, 900))]))
ARM = {"kind": "arm", "mass": 0.3, "centre_distance": 0.2}
WHOLE: dict[str, list[dict]] = {
    "potentiometer": [{"zero_reading": 512.0, "radians_per_count": 0.005}],
    "thermometer": [{"delay": 0.1}],
    "thermometer_log": [
        {"file": str(CAMERA), "time": "t"},
        {"file": str(CAMERA), "time": "t", "offset": 0.0},
    ],
    "heater_a": [{}],
    "drive": [{}, {"gain": 0.1}, {"offset": 0.0}],
    "load": [{"time": (0.0, 0.05), "mass": (0.1, 0.2)}],
    "element_a": [
        ARM,
        {"kind": "none"},
        {"kind": "arm"},
        {"kind": "spring", "linkage": "torsion"},
        {"kind": "spring", "linkage": "drum", "drum_radius": 0.01, "length_at_zero": 0.1},
        {"kind": "muscle", "linkage": "drum", "drum_radius": 0.01, "length_at_zero": 0.1}
        | {"base_length": 0.1},
    ],
}
GOOD = {
    "": {"format": 1, "protocol": "free", "origin": "measured"},
    "columns": {"time": "t", "position": "x", "position_unit": "rad"},
    "element_a": {"kind": "none"},
}
LIKELY = {
    "separator": [";", "tab", "space", ",", "ab", '"'],
    "decimal": [",", "."],
    "thousands": [",", ".", " "],
    "skip_lines": [0, 1, 3],
    "comment": ["#", "%", "t"],
    "encoding": ["utf-16", "latin-1", "rot13", "none", "utf-8", "hex", "idna"],
    "header": [False, True],
    "sample_rate": [100.0, 1e-300, 1e300],
    "time_format": ["hms", "iso", "number", "%H:%M", "%", "%Q", "%d.%m.%Y %H:%M:%S"],
    "protocol": ["spring", "sawtooth"],
    "origin": ["synthetic"],
    "notes": ["words"],
    "kind": ["arm", "spring", "muscle", "none"],
    "linkage": ["straight", "torsion", "drum", "pins"],
    "motion": ["linear", "rotary"],
    "time": ["t", 1, 2, 0, 99, "Time"],
    "position": ["x", 1, 2, "angle"],
    "temperature_a": ["T", 3],
    "load": ["kg", 3],
    "applied": ["force", 2],
    "power_a": ["force", "kg"],
    "power_unit": ["A", "V", "duty"],
    "force": ["force", "T"],
    "force_unit": ["N", "N*m", "gf"],
    "file": [str(CAMERA), "a.csv", "", "..", "no.csv"],
    "applied_unit": ["A", "V", "duty", "N*m"],
    "position_unit": ["rad", "rad/s", "mm", "mm/s", "counts"],
    "model": ["reference", "linear"],
    "accept_units": [["position", "time"], ["x"]],
}


@st.composite
def metadata(draw) -> str:
    """Tables of keys, mostly known ones, some of them with fitting values."""
    tables_: dict[str, dict] = {name: dict(keys) for name, keys in GOOD.items()}
    tables_["fixture"] = {"disc_radius": 0.05}
    if draw(st.booleans()):
        tables_["element_a"] = dict(ARM)
    if draw(st.integers(0, 3)) == 0:
        tables_["columns"]["temperature_a"] = "T"
    for _ in range(draw(st.sampled_from([0, 1, 1, 2, 2, 3]))):
        name = draw(st.sampled_from(list(KEYS)))
        key = draw(st.sampled_from(KEYS[name]))
        fitting = UNITS if key.endswith("unit") else NUMBERS
        likely = st.sampled_from(LIKELY[key]) if key in LIKELY and name != "load" else fitting
        value = draw(mostly(likely, VALUES))
        whole = draw(st.sampled_from(WHOLE.get(name, [{}])))
        tables_.setdefault(name, dict(whole))
        if draw(st.booleans()) or name not in WHOLE:
            tables_[name][key] = tuple(value) if isinstance(value, list) else value
        elif name == "element_a":
            tables_[name] = dict(whole)
    if draw(st.integers(0, 30)) == 30:
        tables_.pop(draw(st.sampled_from(list(KEYS))), None)
    parts = []
    for name, keys in tables_.items():
        lines = [f"{key} = {toml_value(value)}" for key, value in keys.items()]
        parts += [f"[{name}]"] * bool(name) + lines
    return "\n".join(parts)


ABOUT = mostly(metadata(), metadata(), metadata(), st.text(max_size=40)).map(
    lambda text: text.encode("utf-8", "surrogatepass")
)


@st.composite
def swings(draw) -> bytes:
    """A log that can be read, of motion or of none, short or long, even or not."""
    rows = draw(st.sampled_from([2, 3, 5, 12, 60, 200]))
    step = draw(st.sampled_from([0.001, 0.01, 0.02, 0.5, 30.0]))
    size = draw(st.sampled_from([0.0, 1e-9, 0.3, 3.0, 1e4]))
    time = step * np.arange(rows)
    moved = size * np.cos(draw(st.sampled_from([0.0, 1.0, 7.0])) * time)
    heat = 25.0 + draw(st.sampled_from([0.0, 30.0])) * (1.0 - np.exp(-time))
    load = np.where(time > 0.5 * time[-1], draw(st.sampled_from([0.0, 0.2])), 0.1)
    table = zip(time, moved, heat, load, np.sin(3.0 * time), strict=True)
    lines = [",".join(f"{value:.6g}" for value in row) for row in table]
    return "\n".join(["t,x,T,kg,force", *lines]).encode()


GOOD_LOGS = swings()
SUFFIX = mostly(st.just(".csv"), st.sampled_from([".tsv", ".lvm", ".txt", ".h5"]))


def _use(run: Run) -> None:
    """What every part of the program asks of a run."""
    repr(run), run._repr_html_(), assumptions(run)
    assert len(run.table) >= 2
    assert run.table["time"].is_monotonic_increasing
    for key in ("reading", "temperature_a", "temperature_b", "load", "applied"):
        assert run.table[key].notna().all(), key
    assert len(run.output) == len(run.table)
    assert run.stops[0] < run.stops[1]
    _ = run.load_steps, run.gaps, run.output_sensor, run.heat_time


def _says_how_to_fix(error: MuscleBayesError) -> None:
    assert "Fix: " in str(error)


def _read(log: bytes, about: bytes, suffix: str) -> Run | None:
    try:
        run = run_from_bytes(log, about, Path(f"a{suffix}"), Path("a.toml"))
    except MuscleBayesError as error:
        _says_how_to_fix(error)
        return None
    _use(run)
    return run


def _pose(log: bytes, about: bytes, suffix: str) -> None:
    """What is read is a calibration problem with finite priors and data, or the message says why not."""
    run = _read(log, about, suffix)
    if run is None:
        return
    try:
        problem = pose([run])
    except MuscleBayesError as error:
        _says_how_to_fix(error)
        return
    for name, site in problem.sites.items():
        for leaf in jax.tree.leaves(site.prior):
            assert np.isfinite(np.asarray(leaf)).all(), name
    for lanes in problem.data.lanes:
        for leaf in (lanes.time, lanes.reading, lanes.weight, *jax.tree.leaves(lanes.schedule)):
            assert np.isfinite(np.asarray(leaf)).all()


def _guess(log: bytes, suffix: str) -> None:
    path = Path(f"a{suffix}")
    answers = Answers(position_unit="deg", element="none", load=0.0, time_unit="s")
    try:
        guess = guess_log(log, path)
        guess.facts()
        for _ in range(6):
            question = next_question(guess, answers)
            if question is None:
                break
            answer = {"sample_rate": 10.0, "position": "1"}.get(question.key, "degC")
            setattr(answers, question.key, answer)
        text = draft_of(guess, answers).text("a.csv")
        _use(run_from_bytes(log, text.encode(), path, Path("a.toml")))
    except MuscleBayesError as error:
        _says_how_to_fix(error)


QUICK = settings(max_examples=300, deadline=None, derandomize=True)
LONG = settings(
    max_examples=10_000, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True
)


@QUICK
@given(LOGS, ABOUT, SUFFIX)
def test_no_log_and_no_metadata_end_in_a_traceback(log, about, suffix):
    _read(log, about, suffix)


@settings(QUICK, max_examples=100)
@given(GOOD_LOGS, metadata().map(str.encode), st.just(".csv"))
def test_what_is_read_can_be_fitted_or_the_message_says_why_not(log, about, suffix):
    _pose(log, about, suffix)


@QUICK
@given(LOGS, SUFFIX)
def test_no_log_is_guessed_into_a_traceback(log, suffix):
    _guess(log, suffix)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@LONG
@given(LOGS, ABOUT, SUFFIX)
def test_ten_thousand_logs_and_metadata_end_in_no_traceback(log, about, suffix):
    _read(log, about, suffix)


@pytest.mark.slow
@pytest.mark.timeout(3600)
@settings(LONG, max_examples=3000)
@given(GOOD_LOGS, metadata().map(str.encode), st.just(".csv"))
def test_three_thousand_runs_can_be_fitted_or_the_message_says_why_not(log, about, suffix):
    _pose(log, about, suffix)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@LONG
@given(LOGS, SUFFIX)
def test_ten_thousand_logs_are_guessed_without_a_traceback(log, suffix):
    _guess(log, suffix)
