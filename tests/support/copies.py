"""Arrays in what a user gave or got: found, changed, compared."""

from collections.abc import Mapping

import numpy as np


def arrays_in(value):
    """All arrays in lists, mappings, functions of time and polynomials of SciPy's."""
    if isinstance(value, np.ndarray):
        return [value]
    if isinstance(value, Mapping):
        return [array for each in value.values() for array in arrays_in(each)]
    if isinstance(value, (list, tuple)):
        return [array for each in value for array in arrays_in(each)]
    if hasattr(value, "c") and hasattr(value, "x"):
        return [value.c, value.x]
    return [array for each in vars(value).values() for array in arrays_in(each)] if hasattr(value, "in_core") else []


def disturbed(value):
    """Changes numbers in arrays and lists where they can be changed; whether there were any."""
    if isinstance(value, np.ndarray):
        if value.flags.writeable:
            value += 0.125
        return value.flags.writeable
    if hasattr(value, "c") and hasattr(value, "x"):
        return disturbed(value.c)
    if isinstance(value, dict):
        found = [disturbed(each) for each in value.values()]
        numbers = [key for key, each in value.items() if isinstance(each, float)]
    elif isinstance(value, list):
        found = [disturbed(each) for each in value]
        numbers = [i for i, each in enumerate(value) if isinstance(each, float)]
    else:
        return any([disturbed(each) for each in value]) if isinstance(value, tuple) else False
    for key in numbers:
        value[key] += 0.125
    return any(found) or bool(numbers)


def lists_for_arrays(value):
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, dict):
        return {key: lists_for_arrays(each) for key, each in value.items()}
    return type(value)(map(lists_for_arrays, value)) if type(value) in (list, tuple) else value


def alike(a, b):
    """Check that two objects have the same values."""
    if isinstance(a, Mapping):
        return isinstance(b, Mapping) and set(a) == set(b) and all(alike(a[key], b[key]) for key in a)
    if isinstance(a, (list, tuple)):
        return len(a) == len(b) and all(map(alike, a, b))
    if hasattr(a, "c") and hasattr(a, "x"):
        return np.array_equal(a.c, b.c) and np.array_equal(a.x, b.x)
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b)
    return alike(vars(a), vars(b)) if hasattr(a, "in_core") else a is b or a == b
