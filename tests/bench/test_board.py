"""A board's driver on a made-up line."""

import pytest
from fake_bench import FakeBoard, FakeClock

from muscle_bayes.bench.boards.board import Board, BoardError
from muscle_bayes.bench.boards.protocol import Sample


class LateBoard(FakeBoard):
    """What it says comes five times a second, all at once; CLEAR is refused."""

    _delivered = 0.0

    def read(self, max_bytes: int) -> bytes:
        if self._now < self._delivered + 0.2:
            return b""
        self._delivered = self._now
        return super().read(max_bytes)

    def _obey(self, text: str) -> None:
        sequence, verb = text[1:].split(" ")[:2]
        if verb == "CLEAR":
            self.say(f"<{sequence}", "ERR", "FAULT")
        else:
            super()._obey(text)


def _streaming() -> Board:
    clock, line = FakeClock(), LateBoard("S")
    clock.listeners.append(line.step)
    board = Board(line, clock, "board")
    board.stream(30)
    return board


def _numbers(board: Board) -> list[int]:
    return [one.number for one in board.poll() if isinstance(one, Sample)]


def test_samples_read_together_with_an_answer_are_kept():
    assert _numbers(_streaming())[:3] == [0, 1, 2]


def test_samples_read_together_with_a_refusal_are_kept():
    board = _streaming()
    before = _numbers(board)
    with pytest.raises(BoardError, match="the cause of a fault lasts"):
        board.clear()
    after = _numbers(board)
    assert after == list(range(before[-1] + 1, after[-1] + 1))
    assert len(after) > 3
