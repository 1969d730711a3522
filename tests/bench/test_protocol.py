"""The protocol's two ends against each other, and against what was written down beforehand."""

import binascii

import pytest
from host_firmware import HostFirmware
from hypothesis import given, settings
from hypothesis import strategies as st

from muscle_bayes.bench.boards import messages
from muscle_bayes.bench.boards.messages import MESSAGES, Fault, Field, ResetCause, Role
from muscle_bayes.bench.boards.protocol import (
    FRAME_MAX,
    Boot,
    ChecksumReport,
    Decoder,
    Error,
    FaultReport,
    Garbled,
    Identity,
    Prompt,
    Reply,
    Sample,
    crc16,
    decode_line,
    encode,
    frame,
    read_answer,
)
from muscle_bayes.errors import MuscleBayesError

VERBS = [command.verb for command in MESSAGES.commands]


def arguments_of(fields: tuple[Field, ...]) -> st.SearchStrategy:
    def values(field: Field) -> st.SearchStrategy:
        numbers = st.integers(field.low, field.high)
        return st.none() | numbers if field.optional else numbers

    return st.tuples(*map(values, fields))


def commands() -> st.SearchStrategy:
    return st.sampled_from(MESSAGES.commands).flatmap(
        lambda command: st.tuples(st.just(command.verb), arguments_of(command.arguments))
    )


def test_checksum_has_its_published_check_value():
    assert crc16(b"123456789") == 0x29B1


@given(st.binary(max_size=100))
def test_checksum_is_the_standard_librarys(data):
    assert crc16(data) == binascii.crc_hqx(data, 0xFFFF)


def test_firmwares_checksum_is_the_hosts(firmware):
    board = HostFirmware(firmware)
    assert board.crc(b"123456789") == 0x29B1
    for byte in range(256):
        assert board.crc(bytes([byte, 7])) == crc16(bytes([byte, 7]))


def test_frames_as_written_down():
    # CRC of `>12 DUTY 255 0 251 -` by an independent implementation
    check = binascii.crc_hqx(b">12 DUTY 255 0 251 -", 0xFFFF)
    assert encode(12, "DUTY", 255, 0, 251, None) == b">12 DUTY 255 0 251 -*%04X\n" % check


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("=7 4294967295 1023 255 0 33 - -", Sample(7, 2**32 - 1, 1023, (255, 0), Fault(33))),
        ("=7 1 2 3 4 0 55 -66", Sample(7, 1, 2, (3, 4), Fault(0), 55, -66)),
        ("<9 OK", Reply(9, ())),
        ("<9 OK 1 2 3", Reply(9, ("1", "2", "3"))),
        ("<65535 ERR RANGE", Error(65535, "RANGE")),
        (
            "!BOOT 1 3 65535 8 HEATER",
            Boot(Identity(1, 3, 65535, ResetCause.WATCHDOG, Role.HEATER)),
        ),
        ("!FAULT 5", FaultReport(Fault.DEADMAN | Fault.HEAT)),
        ("!CRC 12", ChecksumReport(12)),
    ],
)
def test_every_kind_of_line_is_understood(text, message):
    assert decode_line(frame(text).rstrip(b"\n")) == message
    assert Decoder().feed(frame(text).replace(b"\n", b"\r\n")) == [message]


@pytest.mark.parametrize(
    "text",
    [
        "=7 4294967296 1023 255 0 0",
        "=7 1 8185 255 0 0",
        "=7 1 1023 256 0 0",
        "=7 1 1023 255 0",
        "=7 1 1023 255 0 0 0",
        "=7  1 1023 255 0 0",
        "=+7 1 1023 255 0 0",
        "=٧ 1 1023 255 0 0",
        "<9 ERR NOVEL",
        "<9 OKAY",
        "<70000 OK",
        "!BOOT 1 3 1 8 TOASTER",
        "!FAULT -1",
        "!NEWS 1",
        "",
        "hello",
    ],
)
def test_what_is_no_message_is_garbled_even_with_a_right_checksum(text):
    data = text.encode()
    line = data + b"*%04X" % crc16(data)
    assert decode_line(line) == Garbled(line)


@given(commands(), st.data())
def test_no_change_of_one_byte_goes_unnoticed(command, data):
    verb, arguments = command
    line = encode(5, verb, *arguments).rstrip(b"\n")
    at = data.draw(st.integers(0, len(line) - 1))
    other = data.draw(st.integers(0, 255).filter(lambda byte: byte != line[at]))
    damaged = line[:at] + bytes([other]) + line[at + 1 :]
    assert damaged[-5:] != b"*%04X" % crc16(damaged[:-5])


@given(st.lists(st.integers(0, 65535), max_size=5), st.data())
def test_the_way_a_stream_is_cut_does_not_matter(numbers, data):
    stream = b"".join(frame(f"={n} 1 2 3 4 0 - -") for n in numbers) + b"w\r\nnoise\n"
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=8)))
    decoder = Decoder()
    pieces = zip([0, *cuts], [*cuts, len(stream)], strict=True)
    messages = [m for start, end in pieces for m in decoder.feed(stream[start:end])]
    assert messages == [
        *(Sample(n, 1, 2, (3, 4), Fault(0)) for n in numbers),
        Prompt(),
        Garbled(b"noise"),
    ]


@given(st.lists(st.binary(max_size=300), max_size=6))
def test_nothing_that_a_line_delivers_is_an_error(pieces):
    decoder = Decoder()
    for piece in pieces:
        for message in decoder.feed(piece):
            assert isinstance(message, Garbled | Prompt)


def test_a_line_without_end_is_given_up():
    decoder = Decoder()
    assert decoder.feed(b"x" * (2 * FRAME_MAX + 1)) == [Garbled(b"x" * (2 * FRAME_MAX + 1))]
    assert decoder.feed(frame("<1 OK")) == [Reply(1, ())]


@pytest.mark.parametrize("verb", VERBS)
def test_no_command_is_longer_than_a_frame(verb):
    command = MESSAGES.command(verb)
    widest = [min((f.low, f.high), key=lambda v: -len(str(v))) for f in command.arguments]
    assert len(encode(65535, verb, *widest)) <= FRAME_MAX + 1


@pytest.mark.parametrize(
    ("verb", "arguments", "told"),
    [
        ("HEAT", (), "'HEAT' is no command. Fix: one of ID, DUTY"),
        ("DUTY", (1, 2), "DUTY got 2 arguments. Fix: it takes D0 D1 T0 T1"),
        ("ID", (1,), "ID got 1 arguments. Fix: it takes nothing"),
        ("DUTY", (256, 0, 1, 1), "D0 is 256. Fix: 0 to 255"),
        ("DUTY", (None, 0, 1, 1), "D0 is None"),
        ("STREAM", (-1,), "PERIOD_MS is -1"),
    ],
)
def test_commands_that_cannot_be_sent_say_so(verb, arguments, told):
    with pytest.raises(MuscleBayesError, match=told.replace("(", r"\(")):
        encode(1, verb, *arguments)


def test_an_answer_of_another_version_says_so():
    with pytest.raises(MuscleBayesError, match="load the firmware of this version"):
        read_answer("ID", Reply(1, ("1", "1")))


def test_every_fault_is_explained():
    assert set(messages.FAULT_MEANINGS) == set(Fault)
    assert messages.explain(0) == "none"
    assert "hung" in messages.explain(Fault.WATCHDOG)


@settings(max_examples=300)
@given(commands(), st.integers(0, 65535))
def test_the_firmware_understands_every_command_of_the_table(firmware, command, sequence):
    verb, arguments = command
    board = HostFirmware(firmware)
    board.sample(1000, 512)
    first = board.ask(verb, *arguments, sequence=sequence)[0]
    if verb == "STREAM" and 0 < arguments[0] < 5:
        assert first == Error(sequence, "RANGE")
    elif verb == "ENCODER" or (verb == "INPUT" and any(arguments[2:5])):
        assert first == Error(sequence, "ROLE")
    elif verb == "HOLD":
        assert first == Error(sequence, "GAINS")
    else:
        assert isinstance(first, Reply)
        assert first.sequence == sequence
        read_answer(verb, first)


@settings(max_examples=300)
@given(
    st.lists(st.sampled_from([*VERBS, "1", "-1", "300", "", "-", "x", "99999999999"]), max_size=7)
)
def test_the_firmware_refuses_what_the_table_does_not_hold(firmware, words):
    board = HostFirmware(firmware)
    board.sample(1000, 512)
    line = frame(">" + " ".join(words))
    messages = Decoder().feed(board.feed(line))
    if len(line) > FRAME_MAX + 1:
        assert messages == [ChecksumReport(1)]
        return
    assert len([m for m in messages if isinstance(m, Reply | Error)]) == 1
    assert all(isinstance(m, Reply | Error | FaultReport) for m in messages)
