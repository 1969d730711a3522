"""The board holds an angle: the host tells it where, reports temperatures, and logs."""
