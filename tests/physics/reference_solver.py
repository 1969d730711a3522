"""The rig's equations written anew, solved by a general solver that stops at every event.

Shares no code with the package. Slipping and sticking are modes: a slip ends where speed passes
zero, a stick where the other forces exceed dry friction.
"""

from itertools import pairwise
from math import cos, hypot, sin

import numpy as np
from scipy.integrate import solve_ivp

GRAVITY = 9.80665
ROUNDING = 1e-12
"""Excess over dry friction, relative, that moves nothing: else a rotor at rest just where it slid to
would break away and stop for ever."""


def spring_tension(length):
    """Eq. 12."""
    return 145.71 * length - 5.2097 if length > 0.04682 else 0.0


def opening_spring(x, stiffness, least, eps=1e-3):
    """Eq. 13, 14; stiffness per unit strain."""
    if x > eps:
        return stiffness * (x - eps) + least
    return least / eps * x if x > 0.0 else 0.0


def side_a(q, r, x, y):
    """Length (7) and the lever of (9), by which tension turns q back."""
    length = hypot(x - r * cos(q), y + r * sin(q))
    return length, r / length * (y * cos(q) + x * sin(q))


def side_b(q, r, x, y):
    """Length (8) and the lever of (10), by which tension turns q on."""
    length = hypot(x - r * cos(q), y - r * sin(q))
    return length, r / length * (y * cos(q) - x * sin(q))


def muscle_tension_and_rate(strain, hyst, heat, p, base, contact=(0.0, 0.0)):
    """Eq. 13-17, and eq. 18 with contact = (stiffness, onset): tension [N], HYST's rate [1/s]."""
    offset = p["A"] * heat**2 + p["B"] * heat + p["C"]
    modulus = opening_spring(strain - offset - hyst, base * p["K_modulus"], p["F_modulus_min"])
    held = opening_spring(hyst, base * p["K_hyst"], p["F_hyst_min"])
    damper = p["H"] * (heat + p["T_hyst_offset"])
    touching = contact[0] * min(strain - contact[1], 0.0)
    return modulus + touching, (modulus - held) / (damper * base)


def solve_stick_slip(piece, dry, state, nodes, pieces, rtol=1e-10, atol=1e-12, max_step=np.inf):
    """States (q, speed, hyst) at `nodes`, and how often the rotor reversed or stuck.

    `pieces` are times between which the drive is smooth; `piece(k)` gives, for piece k, the
    function (t, q, speed, hyst) -> (force, inertia, hyst rate).
    """
    out, events = np.empty((len(nodes), 3)), {"reversal": 0, "stick": 0}
    state = np.array(state, dtype=float)
    for k, (begin, end) in enumerate(pairwise(pieces)):
        model, t = piece(k), begin
        while t < end:
            force = model(t, *state)[0]
            breaks_away = np.sign(force) * (abs(force) > dry * (1.0 + ROUNDING))
            sign = np.sign(state[1]) if state[1] != 0.0 else breaks_away

            def slope(t, y, sign=sign, model=model):
                force, inertia, rate = model(t, *y)
                moving = sign != 0.0
                return [y[1] * moving, (force - sign * dry) / inertia * moving, rate]

            def over(t, y, sign=sign, model=model):
                return sign * y[1] if sign else abs(model(t, *y)[0]) - dry

            over.terminal, over.direction = True, -1.0 if sign else 1.0
            options = {"method": "DOP853", "rtol": rtol, "atol": atol, "max_step": max_step}
            first = np.searchsorted(nodes, t)
            part = solve_ivp(slope, (t, end), state, events=over, dense_output=True, **options)
            t, state = part.t[-1], part.y[:, -1].copy()
            last = np.searchsorted(nodes, t, side="right")
            if last > first:
                out[first:last] = part.sol(nodes[first:last]).T
            if part.status == 1:
                if sign:
                    state[1] = 0.0
                    sticks = abs(model(t, *state)[0]) <= dry
                    events["stick" if sticks else "reversal"] += 1
                else:
                    # Just past the threshold, so that the next round finds that it slips.
                    t = min(t + 1e-9, end)
    return out, events
