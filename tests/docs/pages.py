"""The pages that strangers read, and what they show."""

import re
import shlex
from pathlib import Path

PROJECT = Path(__file__).parents[2]
README = PROJECT / "README.md"
DOCS = PROJECT / "docs"
GUIDES = sorted((DOCS / "guides").glob("*.md"))
PAGES = [
    README,
    *(one for one in sorted(DOCS.glob("*.md")) if one.stem != "commands"),
    *GUIDES,
    *sorted((PROJECT / "notebooks").glob("*.py")),
]


def blocks(path: Path, language: str) -> list[str]:
    """Contents of the fenced blocks of a language, the comment signs of notebooks taken off."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        text = re.sub(r"^# ?", "", text, flags=re.MULTILINE)
    return re.findall(rf"^ *```{language}\n(.*?)^ *```", text, re.DOTALL | re.MULTILINE)


def command_lines(path: Path, program: str) -> list[list[str]]:
    """Arguments of every line of a shell block that calls `program`, environment left out."""
    found = []
    for block in blocks(path, "sh"):
        for line in block.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            while words and re.fullmatch(r"[A-Z_]+=.*", words[0]):
                words = words[1:]
            if words[:1] == [program]:
                found.append(words[1:])
    return found


def mentions(path: Path, program: str) -> list[list[str]]:
    """The same for code marked inside a line."""
    text = path.read_text(encoding="utf-8")
    return [shlex.split(one)[1:] for one in re.findall(rf"`({program} [^`\n]+)`", text)]
