"""Models saved and loaded again, and how they differ: bit for bit, NaN and the sign of zero included."""

import warnings

import numpy as np

import pycraft as pc


def differences(one, other, at="model"):
    """Where two descriptions differ, in words; arrays and numbers by their bits."""
    if isinstance(one, dict):
        if list(one) != list(other):
            return [f"{at}: {list(one)} against {list(other)}"]
        return [text for key in one for text in differences(one[key], other[key], f"{at}.{key}")]
    if isinstance(one, list):
        if len(one) != len(other):
            return [f"{at}: {len(one)} against {len(other)}"]
        return [text for i, (a, b) in enumerate(zip(one, other, strict=True)) for text in differences(a, b, f"{at}[{i}]")]
    if isinstance(one, (float, np.ndarray)):
        same = np.shape(one) == np.shape(other) and np.asarray(one, float).tobytes() == np.asarray(other, float).tobytes()
        return [] if same else [f"{at}: {one!r} against {other!r}"]
    return [] if one == other and type(one) is type(other) else [f"{at}: {one!r} against {other!r}"]


def loaded(path, **options):
    """The model of a file, without what is said of it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pc.ModelWarning)
        return pc.load(path, **options)


def saved_and_loaded(model, path, **options):
    """The model that comes back from a file."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pc.ModelWarning)
        model.save(path)
    return loaded(path, **options)


def lost(model, path):
    """Return the properties that a model loses in a TOML file: an empty list."""
    again = saved_and_loaded(model, path)
    beside = differences(model.left_aside, again.left_aside, "left aside") + differences(model.actuators, again.actuators, "actuators")
    return differences(model.description(), again.description()) + beside
