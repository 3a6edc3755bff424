"""Models of well-known linkages: trees with their loops declared (docs/loops.md), at a state on them.

Bodies are thin rods unless stated otherwise; lengths in m, masses in kg.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..arguments import one_number, whole
from .multibody import Multibody


def rod(length: float = 1.0, mass: float = 1.0, direction: Any = (1, 0, 0)) -> dict[str, Any]:
    """Return a thin rod from its hinge along a direction: mass, com and inertia of `add_body`."""
    along = np.asarray(direction, float) / np.linalg.norm(direction)
    return {"mass": mass, "com": length / 2 * along, "inertia": mass * length**2 / 12 * (np.eye(3) - np.outer(along, along))}


def _numbers(**given: Any) -> list[float]:
    return [one_number(value, name) for name, value in given.items()]


def _heading(way: np.ndarray) -> float:
    return float(np.arctan2(way[1], way[0]))


def _on_circle(radius: float, angle: float, height: float) -> np.ndarray:
    return np.array([radius * np.cos(angle), radius * np.sin(angle), height])


def n_four_bar(windows: int = 1, angle: float = np.pi / 2) -> Multibody:
    """Return N four-bars side by side: N + 1 cranks on the ground, joined at their tips by N rods, all of 1 m and 1 kg, in the plane of x
    and y.

    Coordinate 0 is the angle of the first crank from +x. At angle 0, stretched out, the linkage is singular: every rhombus may become an
    antiparallelogram there.

    Source: M. González, F. González, A. Luaces, J. Cuadrado, A collaborative benchmarking framework for multibody system dynamics,
    Engineering with Computers 26, 2010 (IFToMM library of benchmark problems, A02).

    Parameters
    ----------
    windows : N, 1 or more
    angle : rad, of all cranks
    """
    windows, angle = whole(windows, "windows"), one_number(angle, "angle")
    if windows < 1:
        raise _core.ModelError(f"windows={windows}: give a whole number, 1 or more")
    model = Multibody(f"{windows} four-bars")
    for i in range(windows + 1):
        model.add_body(f"crank{i}", None, position=(i, 0, 0), **rod())
        tip = model.add_node(f"tip{i}", f"crank{i}", position=(1, 0, 0))
        if i:
            model.add_loop(model.add_node(f"end{i}", f"rod{i}", position=(1, 0, 0)), tip, hinge="pin", name=f"loop{i}")
        if i < windows:
            model.add_body(f"rod{i + 1}", f"crank{i}", position=(1, 0, 0), **rod())
    model.q = [angle, -angle] * windows + [angle]
    return model


def bricard() -> Multibody:
    """Return Bricard's linkage: six bars of 1 m along edges of a cube, one of them the ground, each pin perpendicular to both of its bars.

    One degree of freedom, although the rows suggest none: one of five is redundant at every state, and no particular one is.
    Source: as `n_four_bar`, A04.
    """
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)], float)
    edges = np.roll(corners, -1, axis=0) - corners
    model = Multibody("bricard")
    for i in range(5):
        axis, place = np.cross(edges[i - 1], edges[i]), corners[0] if i == 0 else edges[i - 1]
        model.add_body(f"bar{i}", f"bar{i - 1}" if i else None, axis=axis, position=place, **rod(direction=edges[i]))
    model.add_loop("bar4", hinge="pin", axis=np.cross(edges[4], edges[5]), point=edges[4], position=corners[5] - edges[4], name="loop")
    return model


def slider_crank(crank: float = 0.15, connecting_rod: float = 0.2, slider: float = 0.5, angle: float = np.pi / 4) -> Multibody:
    """Return a slider-crank: a crank turns about z, its rod pushes a block along x.

    Parameters
    ----------
    crank, connecting_rod : m, of 1 kg per metre; the rod is the longer one
    slider : kg
    angle : rad, of the crank from x
    """
    crank, connecting_rod, slider, angle = _numbers(crank=crank, connecting_rod=connecting_rod, slider=slider, angle=angle)
    if not 0 < crank < connecting_rod < np.inf:
        raise _core.ModelError(
            f"crank={crank}, connecting_rod={connecting_rod}: lengths are positive, and the rod is longer than the crank"
        )
    model = Multibody("slider-crank")
    model.add_body("crank", **rod(crank, crank))
    model.add_body("rod", "crank", position=(crank, 0, 0), **rod(connecting_rod, connecting_rod))
    model.add_body("block", hinge="slider", axis=(1, 0, 0), mass=slider)
    model.add_loop(model.add_node("end", "rod", position=(connecting_rod, 0, 0)), "block", hinge="pin", name="wrist")
    bend = -np.arcsin(crank * np.sin(angle) / connecting_rod)
    model.q = [angle, bend - angle, crank * np.cos(angle) + connecting_rod * np.cos(bend)]
    return model


def peaucellier(long: float = 1.0, short: float = 0.4, crank: float = 0.35, angle: float = 0.3) -> Multibody:
    """Return Peaucellier's and Lipkin's linkage: node "pen" of body "far0" moves along a straight line, x = (long² - short²)/(2 crank).

    Two bars of the length `long` turn about the origin, between them a rhombus of the side `short`, with its near corner carried by a crank
    on a circle through the origin: near and far corner are inverse to each other.

    Parameters
    ----------
    long, short, crank : m, of 1 kg per metre; 2 crank cos(angle/2) must lie between long - short and long + short
    angle : rad, of the crank from x
    """
    long, short, crank, angle = _numbers(long=long, short=short, crank=crank, angle=angle)
    near = crank * np.array([1 + np.cos(angle), np.sin(angle)])
    reach = np.linalg.norm(near)
    if not (0 < short < long < np.inf and long - short < reach < long + short):
        raise _core.ModelError(
            f"long={long}, short={short}, crank={crank}, angle={angle}: the bars do not reach from the origin to the crank's end"
        )
    model = Multibody("peaucellier")
    model.add_body("crank", position=(crank, 0, 0), **rod(crank, crank))
    end = model.add_node("near", "crank", position=(crank, 0, 0))
    out = near / reach
    along = (reach**2 + long**2 - short**2) / (2 * reach)
    far = (long**2 - short**2) / reach * out  # inverse to near
    corners = [along * out + side * np.sqrt(long**2 - along**2) * np.array([-out[1], out[0]]) for side in (1, -1)]
    q = [angle]
    for i, corner in enumerate(corners):
        model.add_body(f"long{i}", **rod(long, long))
        model.add_body(f"near{i}", f"long{i}", position=(long, 0, 0), **rod(short, short))
        model.add_body(f"far{i}", f"long{i}", position=(long, 0, 0), **rod(short, short))
        first = _heading(corner)
        q += [first, _heading(near - corner) - first, _heading(far - corner) - first]
        model.add_loop(model.add_node(f"end{i}", f"near{i}", position=(short, 0, 0)), end, hinge="pin", name=f"near{i}")
    pen = model.add_node("pen", "far0", position=(short, 0, 0))
    model.add_loop(model.add_node("other", "far1", position=(short, 0, 0)), pen, hinge="pin", name="far")
    model.q = q
    return model


def five_bar(base: float = 0.3, inner: float = 0.2, outer: float = 0.3, angles: Any = (2.0, 1.1)) -> Multibody:
    """Return a planar parallel robot: two motors on the ground, two arms that hold one tip, node "tip" of body "outer0".

    Parameters
    ----------
    base, inner, outer : m, between the motors and of the bars, of 1 kg per metre
    angles : rad, of the two motors from x
    """
    base, inner, outer = _numbers(base=base, inner=inner, outer=outer)
    angles = _core.real_array(angles, "angles")
    if angles.shape != (2,):
        raise _core.ModelError(f"angles must be two values, for the motors, not an array {angles.shape}")
    model = Multibody("five-bar")
    elbows = [np.array([side * base / 2, 0]) + inner * np.array([np.cos(a), np.sin(a)]) for side, a in zip((-1, 1), angles, strict=True)]
    between = (elbows[1] - elbows[0]) / 2
    half = np.linalg.norm(between)
    if not 0 < half < outer:
        raise _core.ModelError(
            f"base={base}, inner={inner}, outer={outer}, angles={angles.tolist()}: the outer bars do not reach each other"
        )
    tip = elbows[0] + between + np.sqrt(outer**2 - half**2) * np.array([-between[1], between[0]]) / half
    q = []
    for i, elbow in enumerate(elbows):
        model.add_body(f"inner{i}", position=((-1, 1)[i] * base / 2, 0, 0), **rod(inner, inner))
        model.add_body(f"outer{i}", f"inner{i}", position=(inner, 0, 0), **rod(outer, outer))
        way = tip - elbow
        q += [angles[i], float(np.arctan2(way[1], way[0])) - angles[i]]
    node = model.add_node("tip", "outer0", position=(outer, 0, 0))
    model.add_loop(model.add_node("end", "outer1", position=(outer, 0, 0)), node, hinge="pin", name="tip")
    model.q = q
    return model


def stewart(base: float = 1.0, plate: float = 0.6, height: float = 1.0) -> Multibody:
    """Return a hexapod: a free plate on six legs with universal hinges, sliders, and balls at the plate; node "plate" is its centre.

    Parameters
    ----------
    base, plate : m, radii of the legs' feet and of their heads, in pairs 120° apart
    height : m, of the plate at the model's state
    """
    base, plate, height = _numbers(base=base, plate=plate, height=height)
    for name, value in (("base", base), ("plate", plate), ("height", height)):
        if not 0 < value < np.inf:
            raise _core.ModelError(f"{name}={value}: give a positive length")
    model = Multibody("stewart")
    model.add_body("platform", hinge="free", mass=2.0, inertia=plate**2 * np.diag([0.5, 0.5, 1.0]))
    model.add_node("plate", "platform")
    pairs = np.repeat(np.arange(3), 2) * 2 * np.pi / 3
    feet = pairs + np.tile([-0.25, 0.25], 3)
    heads = pairs + np.tile([-np.pi / 3 + 0.25, np.pi / 3 - 0.25], 3)
    q = [1.0, 0, 0, 0, 0, 0, height]
    for i in range(6):
        foot, head = _on_circle(base, feet[i], 0), _on_circle(plate, heads[i], height)
        way = head - foot
        length = float(np.linalg.norm(way))
        x, y, z = way / length
        model.add_body(f"lower{i}", hinge="universal", axes=[(1, 0, 0), (0, 1, 0)], position=foot, **rod(0.5, 0.4, (0, 0, 1)))
        model.add_body(
            f"upper{i}", f"lower{i}", hinge="slider", axis=(0, 0, 1), mass=0.3, com=(0, 0, -0.25), inertia=0.3 * 0.25**2 * np.eye(3)
        )
        model.add_loop(
            f"upper{i}", model.add_node(f"head{i}", "platform", position=_on_circle(plate, heads[i], 0)), hinge="ball", name=f"leg{i}"
        )
        q += [float(np.arctan2(-y, z)), float(np.arcsin(x)), length]  # R_x(a) R_y(b) takes z there
    model.q = q
    return model


def delta(base: float = 0.2, plate: float = 0.05, upper: float = 0.3, lower: float = 0.6, position: Any = (0.0, 0.0, -0.5)) -> Multibody:
    """Return a Delta robot: three motors on the ground turn arms, each holds the plate by two parallel rods, so that it moves without
    turning.

    Node "plate" is the centre of its body "platform". Coordinates belong to the free platform, then for each arm its angle below the
    horizontal and those of its two rods, universal hinges.

    Source: R. Clavel, Conception d'un robot parallèle rapide à 4 degrés de liberté, thèse 925, EPFL, 1991.

    Parameters
    ----------
    base, plate : m, radii of the motors and of the rods' ends
    upper, lower : m, of the arms and of the rods, 1 kg per metre
    position : (3,) m, of the plate at the model's state, below the motors; elbows point outward
    """
    base, plate, upper, lower = _numbers(base=base, plate=plate, upper=upper, lower=lower)
    place = np.asarray(_core.real_array(position, "position"), float)
    if place.shape != (3,) or not (min(base, plate, upper, lower) > 0 and np.isfinite([base, plate, upper, lower, *place]).all()):
        raise _core.ModelError("delta: base, plate, upper and lower are positive lengths, position is three finite numbers")
    model, apart, z = Multibody("delta"), min(plate, base) / 2, np.array([0.0, 0, 1])
    model.add_body("platform", hinge="free", mass=0.5, inertia=0.5 * plate**2 * np.diag([0.25, 0.25, 0.5]))
    model.add_node("plate", "platform")
    q = [1.0, 0, 0, 0, *place]
    for i in range(3):
        out = _on_circle(1.0, 2 * np.pi * i / 3, 0)
        side = np.cross(z, out)
        way = place + (plate - base) * out  # from the motor to the end of the rods
        along, down = way @ out, -way @ z
        cosine = (way @ way + upper**2 - lower**2) / (2 * upper * np.hypot(along, down))
        if not abs(cosine) <= 1:
            raise _core.ModelError(f"delta: position={place.tolist()} is out of the reach of arm {i}")
        angle = float(np.arctan2(down, along) - np.arccos(cosine))
        rest = (way - upper * (np.cos(angle) * out - np.sin(angle) * z)) / lower
        model.add_body(f"arm{i}", axis=side, position=base * out, **rod(upper, upper, out))
        q.append(angle)
        for j, off in enumerate((apart * side, -apart * side)):
            model.add_body(
                f"rod{i}{j}", f"arm{i}", hinge="universal", axes=[side, out], position=upper * out + off, **rod(lower, lower, -z)
            )
            end = model.add_node(f"end{i}{j}", f"rod{i}{j}", position=-lower * z)
            model.add_loop(end, model.add_node(f"hold{i}{j}", "platform", position=plate * out + off), hinge="ball", name=f"rod{i}{j}")
            q += [float(np.arctan2(-rest @ out, -rest @ z)) - angle, float(np.arcsin(rest @ side))]  # R_side(a) R_out(b) takes -z there
    model.q = q
    return model


def andrews() -> Multibody:
    """Return Andrews' squeezer: seven bodies in a plane, three loops that end in one point, moving within 30 ms and some centimetres.

    Its spring joins nodes "spring" of "K3" and "anchor" of the base, with 4530 N/m and 0.07785 m at rest; "K1" is driven by 0.033 N m. No
    gravity.
    Source: F. Mazzia, C. Magherini, Test set for initial value problem solvers, 2008, "Andrews' squeezing mechanism" (IFToMM A03).
    """
    model = Multibody("andrews")
    A, B = (-0.06934, -0.00227, 0), (-0.03635, 0.03273, 0)
    model.add_body("K1", mass=0.04325, com=(92e-5, 0, 0), inertia=2.194e-6 * np.eye(3))
    model.add_body("K2", "K1", position=(7e-3, 0, 0), mass=0.00365, com=(-115e-4, 0, 0), inertia=4.410e-7 * np.eye(3))
    model.add_body("K3", position=B, mass=0.02373, com=(1043e-5, -1874e-5, 0), inertia=5.255e-6 * np.eye(3))
    model.add_body("K5", position=A, mass=0.07050, com=(2308e-5, 916e-5, 0), inertia=1.169e-5 * np.eye(3))
    model.add_body("K4", "K5", position=(4e-2, 0, 0), mass=0.00706, com=(0, -(2e-2 - 1421e-5), 0), inertia=5.667e-7 * np.eye(3))
    model.add_body("K7", position=A, mass=0.05498, com=(-449e-5, -1228e-5, 0), inertia=1.912e-5 * np.eye(3))
    model.add_body("K6", "K7", position=(0, -4e-2, 0), mass=0.00706, com=(2e-2 - 1421e-5, 0, 0), inertia=5.667e-7 * np.eye(3))
    point = model.add_node("E", "K2", position=(-28e-3, 0, 0))
    for name, body, end in (("BE", "K3", (0, -35e-3, 0)), ("K4E", "K4", (0, -2e-2, 0)), ("K6E", "K6", (2e-2, 0, 0))):
        model.add_loop(model.add_node(f"end of {body}", body, position=end), point, hinge="pin", name=name)
    model.add_node("spring", "K3", position=(2e-2, -18e-3, 0))
    model.add_node("anchor", None, position=(0.014, 0.072, 0))
    phi, epsilon = 0.222668390165885884674473185609, 1.23054744454982119249735015568
    model.q = [
        -0.0617138900142764496358948458001,
        0.0,
        0.455279819163070380255912382449,
        0.487364979543842550225598953530,
        phi,
        epsilon,
        -phi,
    ]
    return model


def _box(mass: float, *sides: float) -> np.ndarray:
    """Return the inertia of a solid box about its centre of mass, kg m²."""
    squares = np.square(sides)
    return np.asarray(mass / 12 * np.diag(squares.sum() - squares))


def flyball_governor(rigid: bool = False) -> Multibody:
    """Return Watt's governor: a shaft turns about z, a slider moves along it, two rods hang from its top, of 1 m, with 5 kg at their ends.

    Nodes "middle0" and "middle1" of the rods and "collar0" and "collar1" of the slider are 0.5 m from each other, held by springs and
    dampers, or with rigid=True by loops, "coupler0" and "coupler1". Coordinates are the shaft's angle, the slider's height and the angles
    of the rods below the horizontal, initially 0.5 m and 30°.

    Source: M. González, D. Dopico, U. Lugrís, J. Cuadrado, A benchmarking system for MBS simulation software, Multibody System Dynamics 16,
    2006 (IFToMM library of benchmark problems, A05, "stiff flyball governor", with springs as couplers).
    """
    model, density, thin = Multibody("flyball governor"), 3000.0, 0.01
    bar, ball = density * thin**2, 5.0
    model.add_body("shaft", axis=(0, 0, 1), mass=bar, com=(0, 0, 0.5), inertia=_box(bar, thin, thin, 1.0))
    cube = density * 0.1**3
    model.add_body("slider", "shaft", hinge="slider", axis=(0, 0, 1), mass=cube, inertia=_box(cube, 0.1, 0.1, 0.1))
    for i, side in enumerate((1.0, -1.0)):
        centre = (bar / 2 + ball) / (bar + ball)
        off = bar * (centre - 0.5) ** 2 + ball * (1 - centre) ** 2
        inertia = _box(bar, 1.0, thin, thin) + off * np.diag([0.0, 1.0, 1.0])
        rod_body: dict[str, Any] = {"mass": bar + ball, "com": (side * centre, 0, 0), "inertia": inertia}
        model.add_body(f"rod{i}", "shaft", axis=(0, side, 0), position=(0.05 * side, 0, 1.0), **rod_body)
        middle = model.add_node(f"middle{i}", f"rod{i}", position=(0.5 * side, 0, 0))
        collar = model.add_node(f"collar{i}", "slider", position=(0.05 * side, 0, 0))
        if rigid:
            model.add_surface(middle, collar, A=np.eye(3), b=(0, 0, 0), c=-0.25, name=f"coupler{i}")
    model.q = [0.0, 0.5, np.pi / 6, np.pi / 6]
    return model
