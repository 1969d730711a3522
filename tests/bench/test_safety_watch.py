"""The trial itself can fail: without the firmware's safety it says so."""

import subprocess

import pytest

from benchmarks.bench_test.failures import ALLOWED, FAILURES, inject

SABOTAGE = {
    "host killed": {"limits.h": ("#define DEADMAN_MS 400", "#define DEADMAN_MS 4000")},
    "firmware hung, interrupts off": {
        "board_avr.c": ("wdt_enable(WDTO_60MS)", "wdt_enable(WDTO_2S)")
    },
}


@pytest.mark.parametrize("name", SABOTAGE)
def test_a_firmware_without_its_safety_is_found_out(firmware, tmp_path, monkeypatch, name):
    source = firmware.parent
    for folder in ("src", "simavr", "test"):
        (tmp_path / folder).mkdir()
        for file in (source / folder).iterdir():
            (tmp_path / folder / file.name).write_bytes(file.read_bytes())
    (tmp_path / "Makefile").write_bytes((source / "Makefile").read_bytes())
    for file, (old, new) in SABOTAGE[name].items():
        path = tmp_path / "src" / file
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))
    subprocess.run(["make", "--silent", "-C", str(tmp_path)], check=True, capture_output=True)
    monkeypatch.setenv("MUSCLE_BAYES_FIRMWARE", str(tmp_path / "build"))
    (failure,) = (f for f in FAILURES if f.name == name)
    assert inject(failure, 0).off_after > ALLOWED
