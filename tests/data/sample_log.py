"""Text of a good run of the fixture, and how to break it."""

from muscle_bayes.data import HEADER

TOML = """\
format = 1
protocol = "staircase"
origin = "synthetic"

[fixture]
rotor_radius_a = 0.030
anchor_x_a = 0.030
anchor_y_a = 0.115
disc_radius = 0.0889
stops = [-1.2, 1.2]
room_temperature = 25.0

[potentiometer]
zero_reading = 512.0
radians_per_count = 0.0058

[element_a]
kind = "muscle"
base_length = 0.100

[element_b]
kind = "none"

[load]
time = [0.0, 1.0]
mass = [0.139, 0.166]
"""
ROWS = 101


def fixture_rows(rows: int = ROWS) -> list[str]:
    """Lines of a log, header first: 0.03 s apart, readings 500, 501, ... 509, 500, ..."""
    lines = [", ".join(HEADER)]
    for i in range(rows):
        temperature = 30 + 0.1 * (i // 13)
        lines.append(f"{100 + 0.03 * i:.3f},{temperature:.1f},40.0,0,25.0,25.0,1,1,{500 + i % 10}")
    return lines


def edit_cell(lines: list[str], row: int, column: int, cell: str) -> list[str]:
    """The lines with one cell changed; `row` is the line of the file, the header 1."""
    cells = lines[row - 1].split(",")
    cells[column] = cell
    return [*lines[: row - 1], ",".join(cells), *lines[row:]]
