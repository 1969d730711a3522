"""What is written reads back, and is the same bytes each time."""

import numpy as np
import pandas as pd
import pytest
from sample_log import TOML

from muscle_bayes.data import (
    HEADER,
    ArmElement,
    Columns,
    Fixture,
    Metadata,
    MuscleElement,
    NoElement,
    RunError,
    SpringElement,
    read_run,
    write_run,
)
from muscle_bayes.data.describing.metadata import parse_metadata
from muscle_bayes.data.writer import to_toml

RNG = np.random.default_rng(7)
METADATA = parse_metadata(TOML.encode(), "a.toml")


def log(rows=200):
    columns = {name: np.full(rows, 25.0) for name in HEADER}
    columns[HEADER[0]] = 10 + np.cumsum(RNG.uniform(0.02, 0.04, rows))
    columns[HEADER[1]] = RNG.uniform(20, 150, rows)
    columns[HEADER[3]] = RNG.random(rows) < 0.5
    columns[HEADER[6]] = columns[HEADER[7]] = np.zeros(rows)
    columns[HEADER[8]] = RNG.integers(312, 712, rows)
    return pd.DataFrame(columns)


def test_round_trip(tmp_path):
    written = log()
    path = write_run(tmp_path / "new", "stairs", written, METADATA)
    run = read_run(path)
    assert path == tmp_path / "new" / "stairs.csv"
    assert run.repairs == ()
    assert run.metadata == METADATA
    assert run.table["reading"].tolist() == written[HEADER[8]].tolist()
    time = written[HEADER[0]] - written[HEADER[0]][0]
    assert run.table["time"].to_numpy() == pytest.approx(time.to_numpy(), abs=1.1e-3)
    assert run.table["temperature_a"].to_numpy() == pytest.approx(
        written[HEADER[1]].to_numpy(), abs=0.0501
    )


def test_bytes_are_plain_and_the_same(tmp_path):
    written = log()
    first = write_run(tmp_path, "a", written, METADATA)
    second = write_run(tmp_path, "b", written, METADATA)
    assert first.read_bytes() == second.read_bytes()
    assert first.with_suffix(".toml").read_bytes() == second.with_suffix(".toml").read_bytes()
    assert b"\r" not in first.read_bytes()
    header, row = first.read_text().splitlines()[:2]
    assert header == ", ".join(HEADER)
    assert len(row.split(",")) == 9
    assert row.split(",")[3] in "01"


def test_no_setpoint_is_blank(tmp_path):
    written = log()
    written[HEADER[5]] = np.nan
    run = read_run(write_run(tmp_path, "a", written, METADATA))
    assert run.table["setpoint_b"].isna().all()


def geometry(side):
    return {f"rotor_radius_{side}": 0.03, f"anchor_x_{side}": 1e-5, f"anchor_y_{side}": 0.1}


@pytest.mark.parametrize(
    "metadata",
    [
        METADATA,
        METADATA.model_copy(update={"notes": 'quotes ", \\, a tab\t, lines\n, °, \x7f and \x01'}),
        Metadata(
            protocol="free",
            origin="measured",
            columns=Columns(time="a [b]", position="#", position_unit="mm", position_sign=-1),
            fixture=Fixture(motion="linear", stops=(-1e-3, 1e22)),
            element_a=SpringElement(linkage="straight", length_at_zero=0.02),
        ),
        Metadata(
            protocol="free",
            origin="measured",
            columns=Columns(time="t", position="q", position_unit="deg", load="kg"),
            fixture=Fixture(**geometry("b"), disc_radius=0.1),
            element_a=ArmElement(mass=1, centre_distance=0.1),
            element_b=MuscleElement(base_length=0.1, heater_length=0.08),
        ),
    ],
    ids=["fixture", "notes", "linear", "arm"],
)
def test_toml_round_trip(metadata):
    assert parse_metadata(to_toml(metadata).encode(), "a.toml") == metadata


@pytest.mark.parametrize(
    ("column", "value", "told"),
    [
        (HEADER[8], 1024, ["row 4", "'Potentiometer Reading'", "1024 is no 10-bit count"]),
        (HEADER[0], np.nan, ["row 4", "'Time (s)'", "finite", "fill it"]),
        ("extra", 1.0, ["columns are", "give exactly"]),
    ],
)
def test_refused(tmp_path, column, value, told):
    written = log().astype(float)
    written.loc[2, column] = value
    with pytest.raises(RunError) as caught:
        write_run(tmp_path, "stairs", written, METADATA)
    for words in ["stairs.csv", "Fix: ", *told]:
        assert words in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_other_columns_are_refused(tmp_path):
    columns = Columns(time="t", position="q", position_unit="rad")
    other = Metadata(protocol="free", origin="synthetic", columns=columns, element_a=NoElement())
    with pytest.raises(RunError, match=r"key columns.*own header.*Fix"):
        write_run(tmp_path, "a", log(), other)
