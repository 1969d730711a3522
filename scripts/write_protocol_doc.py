"""Write the tables of docs/protocol.md: from what the protocol is decoded by, and the limits."""

import re
from collections.abc import Iterable
from pathlib import Path

from muscle_bayes.bench.boards.messages import ERRORS, FAULT_MEANINGS, MESSAGES, SEQUENCE, Field
from muscle_bayes.bench.boards.protocol import encode, frame

PROJECT = Path(__file__).parents[1]
DOCUMENT = PROJECT / "docs" / "protocol.md"
LIMITS = PROJECT / "firmware" / "src" / "limits.h"


def example() -> str:
    """A command and its reply."""
    lines = (encode(12, "DUTY", 120, 0, 253, None), frame("<12 OK 120 0 0"))
    return "".join(f"    {line.decode()}" for line in lines)


def limits() -> str:
    """What keeps the heaters off, with the compiled limits."""
    found = re.findall(r"^#define (\w+) \(?(-?\d+)", LIMITS.read_text(), re.MULTILINE)
    value = {name: int(number) for name, number in found}
    dead = value["DEADMAN_MS"] / 1000
    most, cool, low, high, rise, show = (
        value[name] / 10
        for name in (
            "LIMIT_TEMPERATURE", "COOL_MARGIN", "ABSURD_LOW", "ABSURD_HIGH", "LIMIT_RISE",
            "MUST_SHOW",
        )
    )  # fmt: skip
    return _table(
        ("what", "heaters off", "until"),
        (
            ("start-up, any reset", "with the first instructions", "a DUTY"),
            (
                f"no valid heater command (DUTY, HOLD, old PWM) for {dead:g} s",
                "then, latched",
                "CLEAR",
            ),
            ("a hung program", "watchdog reset within 64 ms (+ 10 %), latched", "CLEAR"),
            ("supply too low", "brown-out reset, latched", "CLEAR"),
            (
                f"a reported temperature above {most:g} C",
                "at once, latched",
                f"all are {cool:g} C below it, then CLEAR",
            ),
            (
                f"a temperature below {low:g} C or above {high:g} C, or none on a heated channel",
                "at once, latched",
                "a plausible one, then CLEAR",
            ),
            (
                f"by the heat model a tube has warmed by {show:g} C, of late or in all, and less than "
                "a third of that was reported",
                "then, latched",
                f"the model says less than {show / 2:g} C, then CLEAR",
            ),
            (
                f"by the heat model a tube may be {rise:g} C warmer than the room, whatever is "
                "reported",
                "then, latched",
                f"it may be {rise - cool:g} C warmer, then CLEAR",
            ),
            ("output registers other than they were set", "within 1 ms, latched", "CLEAR"),
            (
                f"while HOLD is at work: the potentiometer reads within {value['ANGLE_END']} counts of an "
                f"end, or has jumped by more than {value['ANGLE_JUMP']} counts in 1 ms, for "
                f"{value['ANGLE_DOUBTED_MS']} ms",
                "then, latched",
                "CLEAR; HOLD is refused at an end",
            ),
        ),
    )


def tables() -> str:
    """The Markdown between the two marks."""
    commands = (
        (
            f"`{_form('>SEQ ' + command.verb, command.arguments)}`",
            f"`{_form('<SEQ OK', command.answer)}`",
            command.does,
        )
        for command in MESSAGES.commands
    )
    notices = (
        (f"`{_form(notice.start + notice.word, notice.fields)}`", notice.does)
        for notice in MESSAGES.notices
    )
    carried = [SEQUENCE]
    carried += [f for command in MESSAGES.commands for f in (*command.arguments, *command.answer)]
    carried += [f for notice in MESSAGES.notices for f in notice.fields]
    fields = {field.name: field for field in carried}
    return "\n".join(
        (
            "## Host to board\n",
            _table(("command", "reply", "effect"), commands),
            "A command that is refused is answered with `<SEQ ERR CODE`:\n",
            _table(("code", "meaning"), ((f"`{c}`", text) for c, text in ERRORS.items())),
            "## Board to host, unasked\n",
            _table(("frame", "meaning"), notices),
            "## Fields\n",
            _table(("field", "range", "meaning"), map(_described, fields.values())),
            "## Bits of FAULTS\n",
            _table(
                ("bit", "fault", "meaning"),
                ((str(int(f)), str(f.name), text) for f, text in FAULT_MEANINGS.items()),
            ),
        )
    )


def document(text: str) -> str:
    """The document's text with its generated parts written anew."""
    for name, part in (("example", example()), ("tables", tables()), ("limits", limits())):
        begin, end = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->\n"
        head, rest = text.split(begin)
        _, tail = rest.split(end)
        text = head + begin + part + end + tail
    return text


def _form(start: str, fields: tuple[Field, ...]) -> str:
    words = [field.name for field in fields]
    text = start if start[-1] != "=" else start + words.pop(0)
    return " ".join((text, *words))


def _described(field: Field) -> tuple[str, str, str]:
    span = ", ".join(field.words) if field.words else f"{field.low} to {field.high}"
    return f"`{field.name}`", span + (" or `-`" if field.optional else ""), field.meaning


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, tuple("---" for _ in head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


if __name__ == "__main__":
    DOCUMENT.write_text(document(DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")
