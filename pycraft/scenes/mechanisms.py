"""Scenes of well-known mechanisms, ready to simulate: `pc.mechanisms.pendulum().simulate(10.0)`."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..arguments import one_number, whole
from ..models import linkages, vehicles
from ..models.multibody import Multibody
from .effects import Gravity, Loop, NodeDamper, NodeSpring, PointMassGravity, TorqueSource
from .scene import Scene

DOWN = (0.0, 0.0, -9.81)
"""m/s²"""
ALONG_Y = (0.0, -9.81, 0.0)
"""Gravity, m/s², for mechanisms in the plane of x and y"""
EARTH = 3.986004418e14
"""μ = G m of the Earth, m³/s² (IERS Conventions 2010)."""


def _positive(**numbers: float) -> None:
    for name, value in numbers.items():
        if not 0 < float(value) < np.inf:
            raise _core.ModelError(f"{name}={value}: give a positive number")


def _rod(length: float, mass: float, axis: int) -> dict[str, Any]:
    """Return a thin rod along an axis from its hinge."""
    direction = np.eye(3)[axis]
    return {"mass": mass, "com": length / 2 * direction, "inertia": mass * length**2 / 12 * (np.eye(3) - np.diag(direction))}


def pendulum(length: float = 1.0, mass: float = 1.0, angle: float = 0.0) -> Scene:
    """Return a point mass on a massless rod under gravity, released at rest; at 0 the rod is horizontal.

    For 1 m, 1 kg from the horizontal the period is 2.367841947576 s (IFToMM library of benchmark problems, A01).

    Parameters
    ----------
    length, mass : m, kg
    angle : rad, from the horizontal, positive downwards
    """
    _positive(length=length, mass=mass)
    model = Multibody("pendulum")
    model.add_body("bob", axis=(0, 1, 0), mass=mass, com=(length, 0, 0))
    model.q = [angle]
    return Scene(model).add(Gravity(DOWN))


def double_pendulum(lengths: Any = (1.0, 1.0), masses: Any = (1.0, 1.0), angles: Any = (0.3, 0.5)) -> Scene:
    """Return two thin rods, one on the other's end, released at rest under gravity: chaotic for large swings.

    Parameters
    ----------
    lengths, masses : m, kg
    angles : rad, of the upper rod from the horizontal, and of the lower rod relative to it
    """
    _positive(lengths=min(lengths), masses=min(masses))
    model = Multibody("double pendulum")
    model.add_body("upper", axis=(0, 1, 0), **_rod(lengths[0], masses[0], 0))
    model.add_body("lower", "upper", axis=(0, 1, 0), position=(lengths[0], 0, 0), **_rod(lengths[1], masses[1], 0))
    model.q = list(angles)
    return Scene(model).add(Gravity(DOWN))


def heavy_top() -> Scene:
    """Return a fast top with a fixed tip, under gravity: 15 kg, 1 m from tip to centre of mass, spinning with 150 rad/s about it.

    The benchmark of O. Brüls and A. Cardona, On the use of Lie group time integrators in multibody dynamics, J. Computational and Nonlinear
    Dynamics 5, 2010: energy 5435.69679 J; the centre of mass is at (0.1733439641, 0.6400885921, -0.7484907911) m after 1 s.
    """
    model = Multibody("heavy top")
    model.add_body("top", hinge="ball", mass=15.0, com=(0, 1, 0), inertia=np.diag([0.234375, 0.46875, 0.234375]))
    model.v = [0.0, 150.0, -4.61538]
    return Scene(model).add(Gravity(DOWN))


def cart_pole(cart: float = 1.0, pole: float = 0.1, length: float = 1.0, angle: float = 0.1) -> Scene:
    """Return a pole on a cart that runs on a rail: unstable upright. A controller drives the hinge "rail".

    The equations of A. G. Barto, R. S. Sutton, C. W. Anderson, Neuronlike adaptive elements, IEEE Trans. Systems, Man, and Cybernetics 13,
    1983, without their friction.

    Parameters
    ----------
    cart, pole : kg
    length : m, length of the pole, a thin rod
    angle : rad, angle of the pole from upright
    """
    _positive(cart=cart, pole=pole, length=length)
    model = Multibody("cart-pole")
    model.add_body("cart", hinge="slider", axis=(1, 0, 0), mass=cart, hinge_name="rail")
    model.add_body("pole", "cart", axis=(0, 1, 0), hinge_name="pivot", **_rod(length, pole, 2))
    model.q = [0.0, angle]
    return Scene(model).add(Gravity(DOWN))


def kepler(semi_major_axis: float = 8.0e6, eccentricity: float = 0.2, mu: float = EARTH, mass: float = 1.0) -> Scene:
    """Return a satellite about a point mass at the origin, at its pericentre: an ellipse, with the period 2π √(a³/μ).

    Parameters
    ----------
    semi_major_axis : m
    eccentricity : at least 0 and below 1
    mu : m³/s²; default: the Earth's
    mass : kg
    """
    _positive(semi_major_axis=semi_major_axis, mu=mu, mass=mass)
    if not 0 <= eccentricity < 1:
        raise _core.ModelError(f"eccentricity={eccentricity}: give at least 0 and less than 1, as for an ellipse")
    model = Multibody("satellite")
    model.add_body("satellite", hinge="free", mass=mass, inertia=mass * np.eye(3))
    speed = np.sqrt(mu / semi_major_axis * (1 + eccentricity) / (1 - eccentricity))
    model.q, model.v = [1, 0, 0, 0, semi_major_axis * (1 - eccentricity), 0, 0], [0, 0, 0, 0, speed, 0]
    return Scene(model).add(PointMassGravity(mu))


def furuta(arm: float = 0.0826, pendulum: float = 0.064, angle: float = 0.1) -> Scene:
    """Return Furuta's pendulum: an arm that turns about the vertical, driven at "motor", with a pendulum on its end, unstable upright.

    Thin rods of 0.1 kg and 0.05 kg, the size of a desktop device. Source: K. Furuta, M. Yamakita, S. Kobayashi, Swing-up control of
    inverted pendulum using pseudo-state feedback, J. Systems and Control Engineering 206, 1992.

    Parameters
    ----------
    arm, pendulum : m
    angle : rad, angle of the pendulum from upright
    """
    _positive(arm=arm, pendulum=pendulum)
    model = Multibody("Furuta pendulum")
    model.add_body("arm", axis=(0, 0, 1), hinge_name="motor", **_rod(arm, 0.1, 0))
    model.add_body("pendulum", "arm", axis=(1, 0, 0), position=(arm, 0, 0), hinge_name="pivot", **_rod(pendulum, 0.05, 2))
    model.q = [0.0, angle]
    return Scene(model).add(Gravity(DOWN))


def acrobot(angles: Any = (0.2, -0.1)) -> Scene:
    """Return two links hanging from a fixed "shoulder", with a drive only at the "elbow".

    Parameters of R. S. Sutton, Generalization in reinforcement learning, Advances in Neural Information Processing Systems 8, 1996: links
    of 1 m and 1 kg, centres of mass in the middle, inertias of 1 kg m² about them.

    Parameters
    ----------
    angles : rad, of the first link from hanging down, and of the second relative to it
    """
    model = Multibody("acrobot")
    link: dict[str, Any] = {"mass": 1.0, "com": (0, 0, -0.5), "inertia": np.eye(3)}
    model.add_body("upper", axis=(0, 1, 0), hinge_name="shoulder", **link)
    model.add_body("lower", "upper", axis=(0, 1, 0), position=(0, 0, -1), hinge_name="elbow", **link)
    model.q = list(angles)
    return Scene(model).add(Gravity(DOWN))


def n_four_bar(N: int = 2, method: str = "augment") -> Scene:
    """Return N four-bars side by side in a vertical plane: N + 1 cranks of 1 m on the ground, N rods between their tips, 1 kg each.

    Cranks start upright, with 1 rad/s: for N = 2 the energy is 35.835 J. Within 10 s they pass the line with the ground, a singular state,
    ten times; then the first tip is at (0.3284581115, 0.9445185382) m for N = 2, at (0.180512227, 0.983572741) m for N = 40. Coordinate 0
    is the angle of the first crank from +x. Source: as `pycraft.models.linkages.n_four_bar`.

    Parameters
    ----------
    N : 1 or more
    method : method of `effects.Loop`
    """
    N = whole(N, "N")
    model = linkages.n_four_bar(N)
    model.v = [-1.0, 1.0] * N + [-1.0]
    return Scene(model).add(Gravity(ALONG_Y), Loop(method=method))


def andrews(method: str = "augment") -> Scene:
    """Return Andrews' squeezer: seven bodies of centimetre size, driven by 0.033 N m; in 30 ms the crank turns two and a half times.

    The angles at 0.03 s of the test set for initial value problems: β = 15.81077, Θ = -15.75637, γ = 0.0408224, δ = 0.524410,
    φ = -0.534730, ε = 1.048081, ω = 0.534730 rad, in the model's order. Source: as `pycraft.models.linkages.andrews`.
    """
    model = linkages.andrews()
    spring = NodeSpring("anchor", "spring", 4530.0, 0.07785)
    return Scene(model).add(TorqueSource(0.033, hinges="K1"), spring, Loop(method=method))


def bricard(method: str = "augment") -> Scene:
    """Return Bricard's linkage under gravity along -y: one degree of freedom, and one redundant row, which may be any of its rows.

    Source: as `pycraft.models.linkages.bricard`.
    """
    return Scene(linkages.bricard()).add(Gravity(ALONG_Y), Loop(method=method))


def slider_crank(speed: float = 10.0, method: str = "augment") -> Scene:
    """Return a crank of 0.15 m that turns freely, and a block of 0.5 kg that its rod pushes along x; no gravity.

    Parameters
    ----------
    speed : rad/s, of the crank at first
    """
    model = linkages.slider_crank()
    model.v = model.assemble(model.q, [speed, 0, 0], fix="crank").v
    return Scene(model).add(Loop(method=method))


def peaucellier(speed: float = 1.0, method: str = "augment") -> Scene:
    """Return Peaucellier's linkage, turning about its centre line: node "pen" stays on a straight line, to rounding. No gravity.

    Parameters
    ----------
    speed : rad/s, of the crank at first
    """
    model = linkages.peaucellier()
    model.v = model.assemble(model.q, [speed, *[0.0] * (model.nv - 1)], fix="crank").v
    return Scene(model).add(Loop(method=method))


def five_bar(method: str = "augment") -> Scene:
    """Return a planar parallel robot under gravity along -y, initially at rest, with its two motors off."""
    return Scene(linkages.five_bar()).add(Gravity(ALONG_Y), Loop(method=method))


def stewart(method: str = "augment") -> Scene:
    """Return a hexapod under gravity along -z, initially at rest, with its six legs free to slide."""
    return Scene(linkages.stewart()).add(Gravity(DOWN), Loop(method=method))


def delta(method: str = "augment") -> Scene:
    """Return a Delta robot under gravity along -z, initially at rest, with its three motors off: its plate falls and swings without
    turning.

    Source: as `pycraft.models.linkages.delta`.
    """
    return Scene(linkages.delta(position=(0.05, 0.02, -0.5))).add(Gravity(DOWN), Loop(method=method))


def flyball_governor(rigid: bool = False, method: str = "augment") -> Scene:
    """Return Watt's governor under gravity, its shaft turning freely, initially with 2π rad/s: balls fly out, the slider rises, and they
    swing.

    Its couplers are springs of 8e5 N/m and dampers of 4e4 N s/m, which are stiff: use integrator="rosenbrock4"; or rigid, as loops.
    Source: as `pycraft.models.linkages.flyball_governor`.

    Parameters
    ----------
    rigid : True for rigid couplers
    method : method of `effects.Loop` for rigid couplers

    Examples
    --------
    >>> import pycraft as pc
    >>> run = pc.mechanisms.flyball_governor(rigid=True).simulate(0.2)
    >>> bool(abs(run.q[-1, 1] - (1 - np.sin(run.q[-1, 2]))) < 1e-12)  # the height, of a rhombus
    True
    """
    model = linkages.flyball_governor(rigid)
    model.v = [2 * np.pi, 0, 0, 0]
    scene = Scene(model).add(Gravity(DOWN))
    if rigid:
        return scene.add(Loop(method=method))
    for i in range(2):
        scene.add(NodeSpring(f"middle{i}", f"collar{i}", 8e5, 0.5), NodeDamper(f"middle{i}", f"collar{i}", 4e4))
    return scene


def bicycle(speed: float = 4.6, lean_rate: float = 0.0, method: str = "augment") -> Scene:
    """Return the Whipple bicycle with its rider, benchmark parameters, rolling upright along x, uncontrolled; wheels do not slip.

    Coordinate "frame[0]" is its lean, "steer" its steer, both positive to the right. It is self-stable from 4.292 m/s (weave) to
    6.024 m/s (capsize). Source: as `pycraft.models.vehicles.bicycle`.

    Parameters
    ----------
    speed : m/s
    lean_rate : rad/s, initial lean rate

    Examples
    --------
    >>> import pycraft as pc
    >>> running = pc.mechanisms.bicycle(speed=5.0).linearize(inputs="steer")
    >>> len(running.states)  # seven displacements, three velocities
    10
    """
    model = vehicles.bicycle()
    speed, lean_rate = one_number(speed, "speed"), one_number(lean_rate, "lean_rate")
    model.v = [lean_rate, 0, 0, speed, 0, 0, speed / 0.3, 0, speed / 0.35]
    model.v = model.assemble(model.q, model.v, fix=["rear wheel"]).v
    return Scene(model).add(Gravity(DOWN), Loop(method=method))
