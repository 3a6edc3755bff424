"""Refusals: requests of ℳ⁻¹, Ω and Λ as a whole beside ℳ⁻¹x, and the elimination of ℳ typed without a J that the model has.

A model is drawn from a seed: a random tree of hinges of every kind, masses, lengths and rotor inertias over many decades. ln det, trace,
diagonal and blocks come from the sweep that ℳ⁻¹x comes from, in every form, so they refuse where it does and nowhere else. HφMφ*H*
beside rotor inertias has no sweep: its inverse is eliminated over the tree, and may refuse only where the matrix itself, in units
that make its diagonal one, is singular to the digits of a double.

    python tests/campaigns/refusals.py --models 400
"""

import argparse
import sys
from pathlib import Path

import mpmath
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import pycraft as pc

KINDS = ("pin", "slider", "universal", "ball", "cylindrical", "planar", "gimbal")
FORMS = ("fast", "ud", "square-root")
CONDITION = 1e12
"""Of the scaled matrix: beyond it a refusal is fair."""


def drawn(seed, rotors=False):
    """A tree of 2 to 8 bodies at a state; masses over `decades`, now and then a body that is all but a point or a line."""
    rng = np.random.default_rng(seed)
    decades = rng.choice([0, 2, 5, 8])
    unit = 10.0 ** rng.uniform(-14, 14), 10.0 ** rng.uniform(-7, 5)
    model = pc.Multibody("drawn")
    for k in range(int(rng.integers(2, 9))):
        kind = str(rng.choice(KINDS))
        mass, length = unit[0] * 10.0 ** rng.uniform(-decades, decades), unit[1] * 10.0 ** rng.uniform(-1, 1)
        points = rng.normal(size=(6, 3)) * 10.0 ** rng.choice([-0.5, -4, -9], p=[0.8, 0.15, 0.05])
        spread = points - points.mean(axis=0)
        inertia = (np.sum(spread**2) * np.eye(3) - spread.T @ spread) / 6
        options = {"axis": rng.normal(size=3)} if kind in ("pin", "slider", "cylindrical") else {}
        model.add_body(
            f"body{k}",
            f"body{int(rng.integers(0, k))}" if k else None,
            kind,
            position=length * rng.normal(size=3) if k else (0, 0, 0),
            mass=mass,
            com=length * rng.uniform(-0.3, 0.3, 3),
            inertia=mass * length**2 * inertia,
            **options,
        )
    model.take_warnings()
    model.q = model.random_state(seed).q
    if rotors:
        diagonal = np.diag(model.mass_matrix(model.q))
        for hinge in model.hinges.values():
            hinge.rotor_inertia = 0.1 * diagonal[hinge.v_slice]
    model.add_node("tool", f"body{k}", position=unit[1] * rng.normal(size=3))
    return model


def refuses(work):
    try:
        work()
    except (pc.SingularOperatorError, pc.SingularHingeError):
        return True
    return False


def whole(model, form):
    """Name -> whether it refuses: ℳ⁻¹x and the requests of the whole inverse."""
    H, phi, M, Omega = model.soa("H phi M Omega")
    inverse, Omega = ((op).at(model.q, form=form) for op in ((H @ phi @ M @ phi.T @ H.T).inv(), Omega))
    x = np.ones(model.nv)
    return {
        "ℳ⁻¹x": refuses(lambda: inverse @ x),
        "ln det": refuses(lambda: inverse.logdet().value()),
        "trace": refuses(lambda: inverse.trace().value()),
        "diagonal": refuses(inverse.diagonal),
        "blocks": refuses(lambda: pc.blockdiag(inverse).dense()),
        "diagonal of Ω": refuses(Omega.diagonal),
    }


def scaled_condition(model):
    """Of ℳ in units that make its diagonal one, in 60 digits."""
    H, phi, M = model.soa("H phi M")
    exact = (H @ phi @ M @ phi.T @ H.T).at(model.q, precision=100).dense(dtype=object)
    with mpmath.workdps(100):
        unit = [mpmath.sqrt(exact[i, i]) for i in range(len(exact))]
        if not all(unit):
            return np.inf
        A = mpmath.matrix([[exact[i, j] / unit[i] / unit[j] for j in range(len(unit))] for i in range(len(unit))])
        try:
            return float(mpmath.mnorm(A, "f") * mpmath.mnorm(A**-1, "f"))
        except ZeroDivisionError:
            return np.inf


def eliminated(seed):
    """Return True where (HφMφ*H*)⁻¹x is refused beside rotor inertias, and the condition of the scaled ℳ."""
    model = drawn(seed, rotors=True)
    H, phi, M = model.soa("H phi M")
    inverse = (H @ phi @ M @ phi.T @ H.T).inv()
    return refuses(lambda: inverse @ np.ones(model.nv)), scaled_condition(model)


def run(seeds):
    """Counts of what refused, and what is wrong, one line each."""
    counts, wrong = {"models": 0, "eliminated ℳ": 0, "of them for their units": 0}, []
    for seed in seeds:
        counts["models"] += 1
        for form in FORMS:
            found = whole(drawn(seed), form)
            for name, refused in found.items():
                key = f"{form}: {name}"
                counts[key] = counts.get(key, 0) + refused
                if refused != found["ℳ⁻¹x"]:
                    wrong.append(f"seed {seed}, {form}: {name} {'refuses' if refused else 'answers'}, ℳ⁻¹x does not")
        refused, condition = eliminated(seed)
        counts["eliminated ℳ"] += refused
        if refused and condition < CONDITION:
            counts["of them for their units"] += 1
            wrong.append(f"seed {seed}: the eliminated ℳ⁻¹x refuses at a condition of {condition:.1e}")
    return counts, wrong


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--models", type=int, default=400)
    counted, found = run(range(parser.parse_args().models))
    print("\n".join(f"{name:28} {count}" for name, count in counted.items()))
    print("\n".join(found[:40]))
    sys.exit(f"{len(found)} wrong" if found else 0)
