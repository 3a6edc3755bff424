"""Mechanisms whose hinges are singular or only look so.

What is regular here is so by its mechanism, with pivots at least 50 rounding units of the locked inertia; what is singular is so
exactly, and only rounding could make its pivots anything but zero.
"""

import numpy as np

import pycraft as pc
from support.descriptions import body, model, random_inertia, random_unit, subhinge

ROD = dict(com=[0.5, 0, 0], inertia=np.diag([0, 1 / 12, 1 / 12]))
SKEW, AWAY = [1.0, 2.0, 3.0], [0.3, -7.1, 0.2]


def links(*bodies):
    """A chain of bodies given as (subhinges, options)."""
    made = [
        body(f"b{k}", k - 1, subhinges, position=[0, 0, 0] if k == 0 else [1, 0, 0], **options)
        for k, (subhinges, options) in enumerate(bodies)
    ]
    return model(made)


def heavy_tip(n, ratio):
    """A folded chain of n unit rods whose last is `ratio` times heavier."""
    return links(
        *[
            (
                [subhinge("pin")],
                {**ROD, "mass": 1.0 if k < n - 1 else ratio, "inertia": ROD["inertia"] * (1 if k < n - 1 else ratio)},
            )
            for k in range(n)
        ]
    )


def scaled(mass, length):
    """A generic arm in other units."""
    rng = np.random.default_rng(3)
    made = []
    for kind in ("pin", "ball", "universal", "slider"):
        axes = [subhinge("pin", random_unit(rng), length * rng.normal(size=3)) for _ in range(2)]
        subhinges = axes if kind == "universal" else [subhinge(kind, random_unit(rng), length * rng.normal(size=3))]
        made.append((subhinges, dict(mass=mass, com=0.2 * length * rng.normal(size=3), inertia=length**2 * random_inertia(rng, mass))))
    return links(*made)


REGULAR = {
    "tip 1e6 times heavier": lambda: heavy_tip(10, 1e6),
    "tip 1e12 times heavier": lambda: heavy_tip(10, 1e12),
    "tip 1e12 times lighter": lambda: heavy_tip(10, 1e-12),
    "grams and micrometres": lambda: scaled(1e-12, 1e-6),
    "earths and megametres": lambda: scaled(6e24, 1e6),
    "inner body massless, outboard pin across": lambda: links(
        ([subhinge("pin")], dict(mass=0.0)), ([subhinge("pin", [0, 1, 0])], dict(mass=1.0, **ROD))
    ),
    "inner body massless, tiny mass outboard": lambda: links(
        ([subhinge("pin")], dict(mass=0.0)), ([subhinge("pin", [0, 1, 0])], dict(mass=1e-12, com=[1, 0, 0]))
    ),
    "massless tip with a rotor": lambda: links(
        ([subhinge("pin")], dict(mass=1.0, **ROD)), ([subhinge("pin")], dict(mass=0.0, rotor=[0.1]))
    ),
    "eight coordinates with rotors": lambda: links(
        (
            [subhinge("slider"), subhinge("free"), subhinge("pin")],
            dict(mass=1.0, com=[1, 0, 0], inertia=np.eye(3), rotor=[0.1] * 8),
        )
    ),
    "far from its axis": lambda: links(([subhinge("pin", SKEW, [1e6, 0, 0])], dict(mass=1.0, inertia=np.eye(3)))),
    "near its axis": lambda: links(([subhinge("pin")], dict(mass=1.0, com=[1e-7, 0, 0]))),
}
SINGULAR = {
    # name: description, body at fault
    "massless tip": (
        lambda: links(([subhinge("pin")], dict(mass=1.0, com=[1, 0, 0])), ([subhinge("pin", [1, 0, 0])], dict(mass=0.0))),
        "b1",
    ),
    "massless alone": (lambda: links(([subhinge("slider", SKEW)], dict(mass=0.0))), "b0"),
    "coaxial pins": (
        lambda: links(([subhinge("pin")], dict(mass=0.0)), ([subhinge("pin", point=[-1, 0, 0])], dict(mass=1.0, com=[1, 0, 0]))),
        "b0",
    ),
    "coaxial pins, skew and far": (
        lambda: model(
            [
                body("b0", -1, [subhinge("pin", SKEW, AWAY)], 0.0),
                body("b1", 0, [subhinge("pin", SKEW, AWAY)], 1.0, [1, 0, 0], np.eye(3)),
            ]
        ),
        "b0",
    ),
    "sliders along one line": (
        lambda: links(([subhinge("slider", SKEW)], dict(mass=0.0)), ([subhinge("slider", SKEW)], dict(mass=2.0, inertia=np.eye(3)))),
        "b0",
    ),
    "rod about its own axis": (lambda: links(([subhinge("pin", [1, 0, 0])], dict(mass=1.0, **ROD))), "b0"),
    "point on a ball": (lambda: links(([subhinge("ball")], dict(mass=1.0, com=[1, 0, 0]))), "b0"),
    "point on a ball, skew": (lambda: links(([subhinge("ball", point=AWAY)], dict(mass=1.0, com=[1, 0.3, 0]))), "b0"),
    "free point": (lambda: links(([subhinge("free")], dict(mass=1.0, com=[0.3, 0.2, 0.1]))), "b0"),
    "seven coordinates of one body": (
        lambda: links(([subhinge("slider"), subhinge("free")], dict(mass=1.0, com=[1, 0, 0], inertia=np.eye(3)))),
        "b0",
    ),
    "massless ball under a pin": (
        lambda: links(([subhinge("ball")], dict(mass=0.0)), ([subhinge("pin", SKEW)], dict(mass=1.0, com=[-1, 0, 0]))),
        "b0",
    ),
    "light coaxial link in a long arm": (
        lambda: links(
            *[([subhinge("pin", [0, 1, k % 3])], dict(mass=1.0, com=[1, 0, 0], inertia=np.eye(3))) for k in range(6)],
            ([subhinge("pin", SKEW, AWAY)], dict(mass=0.0)),
            (
                [subhinge("pin", SKEW, [x - y for x, y in zip(AWAY, [1, 0, 0], strict=True)])],
                dict(mass=1e3, com=[1, 0, 0], inertia=np.eye(3)),
            ),
        ),
        "b6",
    ),
}
# Coaxial in doubles only: 0.3 - 1 is rounded, and a wider precision sees the lever arm of 1e-17 that is left.
ROUNDED = ("light coaxial link in a long arm",)


def at_random_state(description, seed=0):
    with_warnings = pc.Multibody.from_description(description)
    with_warnings.take_warnings()  # massless bodies on hinges are worth a word, tested elsewhere
    state = with_warnings.random_state(seed)
    with_warnings.q, with_warnings.v = state.q, state.v
    return with_warnings


def what_needs_D(arm, precision):
    """Everything that needs D⁻¹, as calls."""
    H, phi, M, J, D, K, psi, Upsilon = arm.soa("H phi M J D K psi Upsilon")
    total = H @ phi @ M @ phi.T @ H.T + J
    x, zero = np.ones(arm.nv), np.zeros(arm.nv)
    return {
        "D": lambda: D.at(arm.q, precision=precision).dense(),
        "K": lambda: K.at(arm.q, precision=precision) @ x,
        "ψ": lambda: psi.at(arm.q, precision=precision).dense(),
        "Υ": lambda: Upsilon.at(arm.q, precision=precision).dense(),
        "ℳ⁻¹": lambda: total.inv().at(arm.q, precision=precision) @ x,
        "ln det D": lambda: float(D.logdet().at(arm.q, precision=precision)),
        "forward dynamics": lambda: arm.forward_dynamics(arm.q, zero, x, precision=precision),
        "mass matrix inverse": lambda: arm.mass_matrix_inverse(arm.q, precision=precision),
    }
