"""Which device computes: chosen before JAX starts."""

import os
from typing import Annotated, Literal

import typer

from muscle_bayes.errors import MuscleBayesError

Device = Literal["cpu", "gpu"]
DeviceOption = Annotated[
    Device, typer.Option("--device", help="What computes; gpu needs JAX with CUDA or ROCm.")
]


def compute_on(device: Device) -> None:
    """Have JAX compute on this kind of device. Must be called before anything is computed.

    Raises MuscleBayesError where JAX finds no such device.
    """
    typer.echo(f"starting JAX on the {device} ...", err=True)
    import jax

    jax.config.update("jax_platforms", "cpu" if device == "cpu" else None)
    if device == "cpu":
        return
    os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")
    try:
        jax.devices("gpu")
    except RuntimeError:
        raise MuscleBayesError(
            "--device gpu: JAX finds no GPU. Fix: install JAX with CUDA (`pip install "
            "'jax[cuda13]'`) on a machine that has one, or use --device cpu"
        ) from None
