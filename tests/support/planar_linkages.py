"""Planar linkages whose states are known in closed form."""

import numpy as np

import pycraft as pc


def four_bar(crank, coupler, rocker, ground):
    """Three bars from the origin; the end of the last is pinned at (ground, 0, 0)."""
    model = pc.Multibody("four-bar")
    parent, at = None, 0.0
    for name, length in (("crank", crank), ("coupler", coupler), ("rocker", rocker)):
        model.add_body(name, parent, position=(at, 0, 0), mass=1.0, inertia=np.eye(3))
        parent, at = name, length
    model.add_loop("rocker", hinge="pin", point=(rocker, 0, 0), position=(ground - rocker, 0, 0), name="closure")
    return model


def four_bar_angles(lengths, angle):
    """Relative angles of coupler and rocker at a crank angle, both branches; none where the triangle does not close."""
    a, b, c, g = lengths
    end, goal = a * np.exp(1j * angle), g + 0j
    way = goal - end
    d = abs(way)
    cosine = (b * b + d * d - c * c) / (2 * b * d)
    if abs(cosine) > 1:
        return []
    out = []
    for sign in (1, -1):
        coupler = np.angle(way) + sign * np.arccos(cosine)
        rocker = np.angle(goal - (end + b * np.exp(1j * coupler)))
        out.append([coupler - angle, rocker - coupler])
    return out


def off(a, b):
    """Of angles, by the shorter turn."""
    way = np.asarray(a) - b
    return np.abs(way - 2 * np.pi * np.round(way / (2 * np.pi))).max()


def slider_crank(r=0.4, rod=1.0):
    """A crank, a rod, and a slider along x that the rod's end is pinned to."""
    model = pc.Multibody("slider-crank")
    model.add_body("crank", mass=1.0, inertia=np.eye(3))
    model.add_body("rod", "crank", position=(r, 0, 0), mass=1.0, inertia=np.eye(3))
    model.add_body("piston", hinge="slider", axis=(1, 0, 0), mass=1.0, inertia=np.eye(3))
    model.add_loop("rod", "piston", "pin", point=(rod, 0, 0), position=(-rod, 0, 0), name="gudgeon")
    return model
