"""Gains in the bench's integers, and as the header that `make firmware GAINS=...` compiles in."""

from typing import Final, NamedTuple

from muscle_bayes.control.design import Design
from muscle_bayes.control.gains import Gains
from muscle_bayes.errors import MuscleBayesError

KP_SCALE: Final = 2**8
KI_SCALE: Final = 2**16
LARGEST: Final = 32767
EXPORTED: Final = ("pi", "pi-antiwindup")
"""Laws that the firmware computes. It always guards its sum, which law `pi` does not say."""


class BenchGains(NamedTuple):
    """The numbers of `firmware/src/gains.h`."""

    period_ms: int
    kp: int
    """duty per count, times 2^8"""
    ki: int
    """duty per count and period, times 2^16"""
    bias: int
    """duty"""


def counts_gains(gains: Gains, design: Design) -> tuple[float, float]:
    """Proportional and integral gain per count [1/count, 1/(count period)], with the bench's sign.

    Muscle A lowers the angle. Where the reading rises with the angle both are negative.
    """
    count = design.potentiometer.radians_per_count
    return -gains.proportional * count, -gains.integral * count * gains.period


def bench_gains(gains: Gains, design: Design) -> BenchGains:
    """The nearest integers. Raises MuscleBayesError where the firmware cannot run such gains."""
    if gains.law not in EXPORTED:
        raise MuscleBayesError(
            f"law {gains.law!r} does not run on the firmware, which knows PI with anti-windup and "
            f"a bias. Fix: tune with --law {EXPORTED[1]}"
        )
    kp, ki = counts_gains(gains, design)
    found = BenchGains(
        gains.period_ms, round(kp * KP_SCALE), round(ki * KI_SCALE), round(gains.bias)
    )
    for name, value, exact in (("proportional", found.kp, kp), ("integral", found.ki, ki)):
        if abs(value) > LARGEST:
            raise MuscleBayesError(
                f"{name}: is {abs(value) / LARGEST:.1f} times what the firmware's integers hold. "
                "Fix: use smaller gains, or a longer period for a larger integral"
            )
        if value == 0 and exact != 0.0:
            raise MuscleBayesError(
                f"{name}: is too small for the firmware's integers and would be zero. Fix: "
                "use a larger gain, or a longer period"
            )
    return found


def on_the_bench(gains: Gains, design: Design) -> Gains:
    """The gains as the firmware's integers have them. Raises MuscleBayesError as `bench_gains`."""
    rounded = bench_gains(gains, design)
    count = abs(design.potentiometer.radians_per_count)
    return gains.model_copy(
        update={
            "law": "pi-antiwindup",
            "proportional": abs(rounded.kp) / KP_SCALE / count,
            "integral": abs(rounded.ki) / KI_SCALE / count / gains.period,
            "bias": float(rounded.bias),
        }
    )


def gains_header(gains: Gains, design: Design, head: str = "") -> str:
    """`gains.h`. Raises MuscleBayesError as `bench_gains`."""
    found = bench_gains(gains, design)
    count = design.potentiometer.radians_per_count
    lines = [line for line in head.splitlines() if line] + [
        f"{gains.proportional:.6g} duty/rad, {gains.integral:.6g} duty/(rad s), "
        f"{count:g} rad/count",
    ]
    comment = "\n".join(f" * {line}" for line in lines)
    return (
        f"/* Gains of the angle controller (HOLD), written by `muscle-bayes tune`.\n{comment} */\n"
        "#ifndef GAINS_H\n#define GAINS_H\n\n"
        f"#define GAINS_PERIOD_MS {found.period_ms}\n"
        f"#define GAINS_KP {found.kp}L      /* duty per count, times 2^8 */\n"
        f"#define GAINS_KI {found.ki}L      /* duty per count and period, times 2^16 */\n"
        f"#define GAINS_BIAS {found.bias}    /* duty of both heaters */\n\n"
        "#endif\n"
    )
