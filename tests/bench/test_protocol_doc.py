"""docs/protocol.md says what the code does."""

import re
import runpy
from pathlib import Path

from muscle_bayes.bench.boards.messages import ERRORS, MESSAGES, Fault
from muscle_bayes.bench.boards.protocol import Garbled, crc16, decode_line

PROJECT = Path(__file__).parents[2]
TEXT = (PROJECT / "docs" / "protocol.md").read_text(encoding="utf-8")


def test_the_tables_are_those_of_the_code():
    script = runpy.run_path(str(PROJECT / "scripts" / "write_protocol_doc.py"))
    assert script["document"](TEXT) == TEXT, "run `make protocol-doc`"


def test_every_message_fault_and_error_has_its_row():
    for command in MESSAGES.commands:
        assert re.search(rf"^\| `>SEQ {command.verb}\b", TEXT, re.MULTILINE)
    for notice in MESSAGES.notices:
        assert re.search(rf"^\| `{re.escape(notice.start + notice.word)}", TEXT, re.MULTILINE)
    for fault in Fault:
        assert re.search(rf"^\| {int(fault)} \| {fault.name} \|", TEXT, re.MULTILINE)
    for code in ERRORS:
        assert f"| `{code}` |" in TEXT


def test_the_examples_are_whole_frames():
    lines = re.findall(r"^    ([<>].*)$", TEXT, re.MULTILINE)
    assert len(lines) == 2
    for line in lines:
        assert line.endswith(f"*{crc16(line[:-5].encode()):04X}")
    assert not isinstance(decode_line(lines[1].encode()), Garbled)


def test_every_verb_of_the_firmware_is_in_the_table():
    source = (PROJECT / "firmware" / "src" / "commands.c").read_text()
    verbs = re.findall(r'\{"([A-Z]+)", run_', source)
    assert sorted(verbs) == sorted(command.verb for command in MESSAGES.commands)
    codes = set(re.findall(r'error = "([A-Z]+)"', source))
    assert codes == set(ERRORS)
