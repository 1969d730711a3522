"""doit's record of what was made from what, written whole, and only when it changes."""

from pathlib import Path

from doit.dependency import JsonDB

from muscle_bayes.whole_file import write_whole


class WholeFile(JsonDB):
    """A JSON file that a killed process leaves as it was."""

    def dump(self) -> None:
        """Write the records, unless they stand."""
        path, content = Path(self.name), self.codec.encode(self._db).encode()
        if not (path.exists() and path.read_bytes() == content):
            write_whole(path, content)
