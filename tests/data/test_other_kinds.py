"""Logs that are no CSV: LabVIEW measurements, Parquet, HDF5, and names that end in something else."""

import importlib.util

import h5py
import numpy as np
import pandas as pd
import pytest
from swing_log import SWING, TIME, csv, toml

from muscle_bayes.data import RunError, read_run, read_runs

LVM = """\
LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Decimal_Separator\t{decimal}
Multi_Headings\tNo
X_Columns\tOne
***End_of_Header***\t
\t
Channels\t1\t
Samples\t200\t
X_Dimension\tTime\t
***End_of_Header***\t
X_Value\tAngle\tComment
"""
LVM_TOML = toml(time='"X_Value"', position='"Angle"')


def write(folder, name, content: bytes, metadata: str):
    path = folder / name
    path.write_bytes(content)
    path.with_suffix(".toml").write_text(metadata)
    return path


@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("name", ["swing.lvm", "swing.txt"])
def test_labview_measurements(tmp_path, name, decimal):
    text = LVM.format(decimal=decimal) + csv("", separator="\t", decimal=decimal)
    if not name.endswith("lvm"):
        text = text.replace("\tComment", "")
    run = read_run(write(tmp_path, name, text.encode(), LVM_TOML))
    assert run.coordinate == pytest.approx(SWING)
    assert run.repairs == ()


def test_labview_with_several_blocks_says_so(tmp_path):
    block = LVM.format(decimal=".") + csv("", separator="\t")
    text = block + "\n" + block.split("***End_of_Header***\t\n", 1)[1]
    path = write(tmp_path, "swing.lvm", text.encode(), LVM_TOML)
    with pytest.raises(RunError, match=r"2 blocks of columns.*Fix: export it with one header"):
        read_run(path)


def test_labview_cut_in_its_header(tmp_path):
    path = write(tmp_path, "swing.lvm", LVM.split("***")[0].encode(), LVM_TOML)
    with pytest.raises(RunError, match=r"LabVIEW header has no .*Fix"):
        read_run(path)


def test_parquet(tmp_path):
    path = tmp_path / "swing.parquet"
    path.with_suffix(".toml").write_text(toml())
    if importlib.util.find_spec("pyarrow") is None:
        path.write_bytes(b"PAR1")
        with pytest.raises(RunError, match=r"need pyarrow.*Fix: install it"):
            read_run(path)
        return
    pd.DataFrame({"t": TIME, "x": SWING}).to_parquet(path)
    assert read_run(path).coordinate.tolist() == SWING.tolist()


@pytest.mark.parametrize("group", [None, "rig/run 3"])
def test_hdf5_arrays(tmp_path, group):
    path = tmp_path / "swing.h5"
    with h5py.File(path, "w") as file:
        node = file if group is None else file.create_group(group)
        node["t"], node["x"], node["note"] = TIME, SWING, "by hand"
        if group is not None:
            file["rig/other"] = TIME[:3]
    keys = "" if group is None else f'group = "{group}"'
    path.with_suffix(".toml").write_text(toml(log=keys))
    assert read_run(path).coordinate.tolist() == SWING.tolist()


def test_hdf5_table_of_records(tmp_path):
    path = tmp_path / "swing.hdf5"
    records = np.zeros(TIME.size, dtype=[("t", float), ("x", float)])
    records["t"], records["x"] = TIME, SWING
    with h5py.File(path, "w") as file:
        file["run"] = records
    path.with_suffix(".toml").write_text(toml(log='group = "run"'))
    assert read_run(path).coordinate.tolist() == SWING.tolist()


def test_hdf5_without_columns(tmp_path):
    path = tmp_path / "swing.h5"
    with h5py.File(path, "w") as file:
        file["t"], file["x"] = TIME, SWING[:5]
    path.with_suffix(".toml").write_text(toml())
    with pytest.raises(RunError, match=r"key log\.group: .*of one length in /; found t 200, x 5"):
        read_run(path)
    path.with_suffix(".toml").write_text(toml(log='group = "nowhere"'))
    with pytest.raises(RunError, match=r"no group 'nowhere'; there are t, x.*Fix"):
        read_run(path)
    path.write_bytes(b"no HDF5 at all")
    with pytest.raises(RunError, match=r"no readable HDF5 file.*Fix"):
        read_run(path)


def test_hdf5_by_pandas(tmp_path):
    """A file with the mark of pandas, which PyTables is needed for."""
    path = tmp_path / "swing.h5"
    path.with_suffix(".toml").write_text(toml())
    with h5py.File(path, "w") as file:
        file.create_group("log").attrs["pandas_type"] = b"frame"
    told = "need PyTables" if importlib.util.find_spec("tables") is None else "no readable HDF5"
    with pytest.raises(RunError, match=f"{told}.*Fix"):
        read_run(path)


def test_a_folder_stands_for_logs_of_every_kind(tmp_path):
    write(tmp_path, "a.csv", csv().encode(), toml())
    write(tmp_path, "b.txt", csv().encode(), toml())
    (tmp_path / "notes.txt").write_text("no log")
    assert [run.name for run in read_runs([tmp_path])] == ["a", "b"]
    assert read_run(tmp_path / "b.toml").path == tmp_path / "b.txt"


def test_two_logs_for_one_metadata(tmp_path):
    write(tmp_path, "a.txt", csv().encode(), toml())
    write(tmp_path, "a.dat", csv().encode(), toml())
    with pytest.raises(RunError, match=r"several logs belong to it: a\.txt, a\.dat.*Fix"):
        read_run(tmp_path / "a.toml")
