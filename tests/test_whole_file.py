"""A file is the old or the new one whole, also where several threads write it."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.whole_file import write_whole


def test_threads_replace_one_file_and_none_takes_anothers_part(tmp_path):
    path = tmp_path / "deep" / "progress"
    contents = [bytes([letter]) * 1000 for letter in range(65, 73)]

    def write(content):
        for _ in range(300):
            write_whole(path, content)
            assert path.read_bytes() in contents

    with ThreadPoolExecutor(len(contents)) as pool:
        list(pool.map(write, contents))
    assert [child.name for child in path.parent.iterdir()] == ["progress"]


def test_a_place_that_cannot_be_written_is_told_and_nothing_is_left(tmp_path):
    (tmp_path / "held").mkdir()
    (tmp_path / "held" / "child").touch()
    with pytest.raises(MuscleBayesError, match=r"held: cannot be written: .*Fix"):
        write_whole(tmp_path / "held", b"x")
    assert [child.name for child in tmp_path.iterdir()] == ["held"]
