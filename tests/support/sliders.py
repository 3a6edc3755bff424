"""One body of 1 kg that slides."""

import pycraft as pc


def slider(axis=(1, 0, 0), **given):
    b = pc.Multibody("b")
    b.add_body("b", None, "slider", axis=axis, mass=1.0, **given)
    return b
