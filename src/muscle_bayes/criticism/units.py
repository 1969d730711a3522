"""The unit in which a person judges a rotor's coordinate."""

from math import pi

from muscle_bayes.inference.posteriors.predict import Prediction


def judged_unit(prediction: Prediction) -> tuple[str, float]:
    """Name of the unit, deg or mm, and how many of it one unit of reading is, with sign."""
    if prediction.unit in ("m", "mm"):
        return "mm", prediction.scale * 1e3
    return "deg", prediction.scale * 180.0 / pi
