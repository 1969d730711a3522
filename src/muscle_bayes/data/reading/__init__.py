"""From a log's bytes to its cells: text, rows, header, numbers, clock formats and other file kinds."""
