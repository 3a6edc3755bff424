"""Units do not matter: one model in many units, every request that is eliminated over the tree.

A model is drawn from a seed and built again with its masses multiplied by one power of two and its lengths by another. Every number of
one is then a power of two times the other's, so answers made dimensionless must be the same to the last bit: pivots,
refusals and the number of corrections may depend on nothing else. And in units far from SI's they must be right: the reference is the
dense matrix inverted in 60 digits.

    python tests/campaigns/units.py --seeds 500
"""

import argparse
import sys
from pathlib import Path

import mpmath
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import pycraft as pc
from pycraft.accuracy.hard_cases.cases_elimination import UNITS

LENGTHS = {"pin": (0,), "slider": (1,), "cylindrical": (0, 1), "ball": (0, 0, 0), "universal": (0, 0)}
"""Powers of a length in each coordinate."""

POWERS = ((4, 0), (1, 0), (-81, 0), (0, 21), (0, -33), (-84, -33), (21, 10))
"""Binary exponents of masses and lengths."""
TIMES = (0, 1, -7)
"""Binary exponents of times, in turn."""


def solid(rng):
    """The inertia of eight points of mass 1/8 about their centre: of some solid, in units of mass and length."""
    points = rng.normal(size=(8, 3)) * 0.3
    spread = points - points.mean(axis=0)
    return (np.sum(spread**2) * np.eye(3) - spread.T @ spread) / 8


def add_drawn(model, rng, k, parent, kind, units, inertia, **options):
    """Body k on body `parent` (the base where that is -1), placed at random and with random masses, in units of (mass, length)."""
    mass, length = units
    placed = {"position": length * rng.uniform(-1, 1, 3), "mass": mass * rng.uniform(0.1, 2), "com": length * rng.uniform(-0.3, 0.3, 3)}
    model.add_body(f"body{k}", f"body{parent}" if parent >= 0 else None, kind, inertia=mass * length**2 * inertia, **placed, **options)


class Moving:
    """A random tree of every kind of hinge in motion, in units of `mass`, `length` and `time`."""

    KINDS = {
        "pin": (0,),
        "slider": (1,),
        "screw": (0,),
        "cylindrical": (0, 1),
        "universal": (0, 0),
        "gimbal": (0, 0, 0),
        "planar": (1, 1, 0),
        "ball": (0, 0, 0),
        "free": (0, 0, 0, 1, 1, 1),
    }
    """Powers of a length in each velocity."""

    def __init__(self, seed, mass=1.0, length=1.0, time=1.0):
        rng = np.random.default_rng(seed)
        self.mass, self.length, self.time = mass, length, time
        self.model = pc.Multibody("moving")
        own_powers = {}
        for k in range(int(rng.integers(2, 8))):
            kind = str(rng.choice(list(self.KINDS)))
            inertia = solid(rng)
            parent, own = int(rng.integers(0, k)) if k else -1, np.array(self.KINDS[kind])
            rotors = mass * length ** (2.0 - 2 * own) * rng.uniform(0, 0.2, len(own)) * (rng.random() < 0.3)
            options = {"axis": rng.normal(size=3)} if kind in ("pin", "slider", "screw", "cylindrical") else {}
            options |= {"pitch": 0.25 * length} if kind == "screw" else {}
            add_drawn(self.model, rng, k, parent, kind, (mass, length), inertia, rotor_inertia=rotors, **options)
            own_powers[f"body{k}"] = own, {"ball": np.zeros(4), "free": np.r_[np.zeros(4), np.ones(3)]}.get(kind, own)
        n = self.model.nv
        self.powers, positions = np.zeros(n), np.zeros(self.model.nq)
        for name, hinge in self.model.hinges.items():
            self.powers[hinge.v_slice], positions[hinge.q_slice] = own_powers[name]
        self.rates = length**self.powers / time
        self.q = rng.uniform(-1, 1, self.model.nq) * length**positions
        self.v = rng.uniform(-1, 1, n) * self.rates
        self.tau = rng.uniform(-1, 1, n) * mass * (length / time) ** 2 / length**self.powers
        self.model.gravity = rng.uniform(-1, 1, 3) * length / time**2

    def answers(self):
        """Name -> a dimensionless array, for each direct call in the fast form."""
        model, q, v, tau = self.model, self.q, self.v, self.tau
        lengths, energy = self.length**self.powers, self.mass * (self.length / self.time) ** 2
        accelerations, forces = lengths / self.time**2, energy / lengths
        inertias = self.mass * self.length**2 / np.outer(lengths, lengths)
        dq, dv, dtau = model.forward_dynamics_derivatives(q, v, tau)
        return {
            "forward dynamics": model.forward_dynamics(q, v, tau) / accelerations,
            "forward dynamics of a batch": model.forward_dynamics(*(np.tile(x, (9, 1)) for x in (q, v, tau))) / accelerations,
            "inverse dynamics": model.inverse_dynamics(q, v, 0.5 * v / self.time) / forces,
            "bias forces": model.bias_forces(q, v) / forces,
            "ℳ": model.mass_matrix(q) / inertias,
            "ℳ⁻¹": model.mass_matrix_inverse(q) * inertias,
            "∂θ̈/∂q": dq / np.outer(accelerations, 1 / lengths),
            "∂θ̈/∂v": dv / np.outer(accelerations, 1 / self.rates),
            "∂θ̈/∂τ": dtau / np.outer(accelerations, 1 / forces),
            "ΥM": np.array(float((model.soa.Upsilon @ model.soa.M).at(q).trace())),
            "[I-HψK]": (model.soa.I - model.soa.H @ model.soa.psi @ model.soa.K).at(q).dense() * np.outer(1 / forces, forces),
        }


class Drawn:
    """A random tree with masses of about `mass` and lengths of about `length`, at a state; `lengths`: per coordinate, as in LENGTHS."""

    def __init__(self, seed, mass=1.0, length=1.0):
        rng = np.random.default_rng(seed)
        self.mass, self.length = mass, length
        self.model = pc.Multibody("drawn")
        kinds = {}
        for k in range(int(rng.integers(2, 9))):
            kind = str(rng.choice(list(LENGTHS)))
            axis = rng.normal(size=3)
            inertia = solid(rng)
            parent = int(rng.integers(-1, k)) if k else -1
            options = {"axis": axis} if kind in ("pin", "slider", "cylindrical") else {}
            add_drawn(self.model, rng, k, parent, kind, (mass, length), inertia, **options)
            kinds[f"body{k}"] = kind
        self.q = np.array(self.model.random_state(seed=1).q)
        self.lengths = np.zeros(self.model.nv)
        for name, hinge in self.model.hinges.items():
            powers = LENGTHS[kinds[name]]
            self.lengths[hinge.v_slice] = powers
            if hinge.q_slice.stop - hinge.q_slice.start == len(powers):
                self.q[hinge.q_slice] *= length ** np.array(powers, float)
        self.rates = length**self.lengths
        self.forces = mass * length**2 / self.rates
        H, phi, M = self.model.soa("H phi M")
        self.MM = H @ phi @ M @ phi.T @ H.T
        n = self.model.nv
        self.damping = np.linspace(0.1, 1.0, n) * self.forces / self.rates
        self.C = pc.constant(np.diag(self.damping), self.model.soa.Theta, self.model.soa.Theta, name="C")
        self.x = np.linspace(-1.0, 1.0, n) * self.forces

    def answers(self):
        """Name -> a dimensionless array, for each request."""
        damped, inverse = (self.MM + self.C).inv().at(self.q), self.MM.inv().at(self.q)
        squares = self.forces / self.rates
        return {
            "(ℳ+C)⁻¹x": (damped @ self.x) / self.rates,
            "diagonal of (ℳ+C)⁻¹": damped.diagonal() * squares,
            "tr C(ℳ+C)⁻¹": np.array([float((self.C @ damped).trace())]),
            "ln det C⁻¹(ℳ+C)": np.array([float((self.C.inv() @ (self.MM + self.C).at(self.q)).logdet())]),
            'method="realization"': self.model.forward_dynamics(self.q, np.zeros(len(self.x)), self.x, method="realization") / self.rates,
            "ℳ⁻¹x": (inverse @ self.x) / self.rates,
            "diagonal of ℳ⁻¹": inverse.diagonal() * squares,
            "tr Cℳ⁻¹": np.array([float((self.C @ inverse).trace())]),
            "ln det C⁻¹ℳ": np.array([float((self.C.inv() @ self.MM.at(self.q)).logdet())]),
        }

    def exact(self):
        """The same from the dense matrix in double, equilibrated and inverted in 60 digits; and the condition number that it had."""
        rates, forces = self.rates, self.forces
        dense = np.asarray(self.MM.at(self.q).dense()) * np.outer(rates, rates) / (self.mass * self.length**2)
        damping = self.damping * rates / forces
        with mpmath.workdps(60):
            A = mpmath.matrix(dense.tolist())
            C = mpmath.diag(damping.tolist())
            x = mpmath.matrix((self.x / forces).tolist())
            results = {}
            for name, X in (("(ℳ+C)", A + C), ("ℳ", A)):
                Y = X**-1
                diagonal = [Y[i, i] for i in range(len(damping))]
                results[f"{name}⁻¹x"] = Y * x
                results[f"diagonal of {name}⁻¹"] = diagonal
                C_name = "tr C" + name + "⁻¹"
                results[C_name] = [mpmath.fsum(d * c for d, c in zip(diagonal, damping.tolist(), strict=True))]
                results[f"ln det C⁻¹{name}"] = [mpmath.log(mpmath.det(X)) - mpmath.log(mpmath.det(C))]
            results['method="realization"'] = results["ℳ⁻¹x"]
        return {name: np.array([float(y) for y in value]) for name, value in results.items()}, np.linalg.cond(dense)


def differing_bits_in_motion(seed):
    """(exponents of mass, length and time, call) of every direct call in the fast form that is not the same to the bit."""
    reference = Moving(seed).answers()
    wrong = []
    for i, (mass, length) in enumerate(POWERS):
        powers = mass, length, TIMES[i % len(TIMES)]
        answers = Moving(seed, *(2.0**p for p in powers)).answers()
        wrong += [(*powers, name) for name, value in answers.items() if not np.array_equal(value, reference[name])]
    return wrong


def differing_bits(seed):
    """(masses' exponent, lengths' exponent, request) of every answer that is not the same to the bit.

    Except ln det, a difference of logarithms of numbers with units: each of them rounds.
    """
    reference = Drawn(seed).answers()
    wrong = []
    for mass, length in POWERS:
        answers = Drawn(seed, 2.0**mass, 2.0**length).answers()
        wrong += [
            (mass, length, name) for name, value in answers.items() if name[:2] != "ln" and not np.array_equal(value, reference[name])
        ]
    return wrong


def worst_errors(seed, units):
    """Largest relative error of each request over a bound: 2000 n eps times the condition of the dense matrix. Above 1 is wrong."""
    drawn = Drawn(seed, *UNITS[units])
    exact, condition = drawn.exact()
    bound = 2000 * drawn.model.nv * np.finfo(float).eps * condition
    errors = {}
    for name, value in drawn.answers().items():
        size = max(np.linalg.norm(exact[name]), 1.0 if name.startswith("ln det") else 0.0)
        errors[name] = float(np.linalg.norm(value - exact[name]) / size / bound)
    return errors


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=100)
    wrong = 0
    for seed in range(parser.parse_args().seeds):
        for mass, length, name in differing_bits(seed):
            wrong += 1
            print(f"seed {seed}: masses 2^{mass}, lengths 2^{length}: {name} is not the same")
        for mass, length, time, name in differing_bits_in_motion(seed):
            wrong += 1
            print(f"seed {seed}: masses 2^{mass}, lengths 2^{length}, times 2^{time}: {name} is not the same")
        for units in UNITS:
            for name, error in worst_errors(seed, units).items():
                if not error <= 1:
                    wrong += 1
                    print(f"seed {seed}: {units}: {name} off by {error:.1e} of its bound")
    print(f"{wrong} wrong")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
