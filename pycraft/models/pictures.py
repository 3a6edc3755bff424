"""How a model looks: its tree as text, and as figures of sticks that the rooms above draw, still or live."""

from __future__ import annotations

from typing import Any

from .. import _core
from .shapes import Shape
from .tree_diagram import TreeDiagram, tree_diagram


class Pictures:
    """What is printed and drawn of a model."""

    _shapes: list[Shape]

    def _repr_html_(self) -> str:
        return str(_core._face["model_html"](self))

    def tree(self, most: int | None = 200, *, nodes: bool = False) -> TreeDiagram:
        """The tree as text in 80 columns: each body below and right of the one that carries it, its hinge, and its places in q and v.

        Parameters
        ----------
        most : int or None
            Lines of bodies that are shown; the middle of a longer tree is left out. None: all.
        nodes : bool
            Whether nodes have lines.

        Returns
        -------
        TreeDiagram
            Text when it is printed. A tree of more than a dozen levels does not indent only children. Names of hinges are left out where
            there is no room for them, and not repeated where they are their bodies'.

        Examples
        --------
        >>> import pycraft as pc
        >>> print(pc.tree([-1, 0, 0], ["free", "pin", "ball"]).tree())
        tree of 3: 3 bodies, 10 degrees of freedom
        base
        └─ body0     free  hinge0  q[0:7] v[0:6]
           ├─ body1  pin   hinge1  q[7] v[6]
           └─ body2  ball  hinge2  q[8:12] v[7:10]
        """
        return tree_diagram(self, most, nodes)  # type: ignore[arg-type]  # a part of the model's class

    def plot(
        self,
        q=None,
        ax: Any = None,
        *,
        view: str = "auto",
        com: bool = False,
        names: bool = False,
        legend: bool = True,
        shadow: bool = True,
        alpha: float = 1.0,
    ) -> Any:
        """A stick figure of the model at a state, by Matplotlib alone: no mesh is needed.

        Bones go from hinge to hinge; of a body that carries no other, to its nodes, or else to where a uniform rod of its mass and second
        moment ends. Markers tell the kinds of hinges, lines through them their axes, dashed lines what has slid. Equal scales, metres.

        Parameters
        ----------
        q : (nq,) or a State; the model's own where left out
        ax : Axes of Matplotlib, in space or in the plane
            New ones where left out. What they show already stays in view, so that several states can be laid over each other.
        view : {"auto", "3d", "xy", "xz", "yz"}
            "auto": the plane that a flat model never leaves, space for any other.
        com : bool
            Centres of mass: of each body, its area by its mass, and of all.
        names : bool
            Of the hinges, beside them.
        legend, shadow, alpha : what markers mean; the shadow of the bones on the floor, in space; opacity

        Returns
        -------
        Axes

        Raises
        ------
        ModelError
            A q that is none of this model's.
        EvaluationError
            Another view, or one that does not fit the axes.

        `pycraft.view.StickFigure` is the same figure as an object that can be moved to another state, for animations.

        Examples
        --------
        >>> import pycraft as pc
        >>> ax = pc.chain(3).plot([0.3, 0.3, 0.3])
        >>> ax.get_xlabel(), ax.get_ylabel()
        ('x (m)', 'y (m)')
        """
        options = dict(view=view, com=com, names=names, legend=legend, shadow=shadow, alpha=alpha)
        return _core._face["plot_model"](self, q, ax, **options)

    def dof_shares(self, q=None) -> Any:
        """Each body's share of the degrees of freedom, tr(Υ(k)M(k)), as numbers and as colour on the robot. O(N); with rotors O(N²).

        The shares of bodies, and those of rotors tr(ℳ⁻¹(k,k)J(k)), add up to the number of coordinates N. Loops are not looked at: they are
        the tree's shares.

        Parameters
        ----------
        q : (nq,) or a State; the model's own where left out

        Returns
        -------
        Shares
            `by_body`, `of_bodies`, `of_rotors`, `total`; a table when printed, a picture with a colour bar in a notebook, `plot()` one by
            Matplotlib.

        Raises
        ------
        ModelError
            A q that is none of this model's.
        SingularHingeError
            A hinge that moves without inertia.

        Source: A. Jain, Robot and Multibody Dynamics, Springer 2011 (operational space inertias); `soa.theorems()`, "the bodies' shares
        add up to N".

        Examples
        --------
        >>> import pycraft as pc
        >>> print(pc.chain(3, seed=1).dof_shares())
        shares of the degrees of freedom of 'chain of 3', tr Υ(k)M(k)
          body0   0.0585  █
          body1   1.1511  ███████████████
          body2   1.7903  ████████████████████████
          together 3 of N = 3
        """
        return _core._face["dof_shares"](self, q)

    @property
    def shapes(self) -> list[Shape]:
        """The shapes by which the model's file shows its bodies, in the file's order; none for a model that was not loaded.

        Visuals of a URDF or SDF file, geoms of the groups 0 to 2 of an MJCF file, `[[shapes]]` of a TOML file. The viewer and pages of
        runs draw them, and read meshes then (extra `meshes`). `Multibody.save` writes them; meshes that were in an MJCF file itself go
        into none.

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.chain(2).shapes
        []
        """
        return [shape for shape in self._shapes if shape.purpose == "visual"]

    @property
    def collision_shapes(self) -> list[Shape]:
        """The shapes by which the model's file lets its bodies touch, in the file's order; none for a model that was not loaded.

        Collisions of a URDF or SDF file, geoms of an MJCF file that collide. No dynamics uses them; `Multibody.save` writes them.
        """
        return [shape for shape in self._shapes if shape.purpose == "collision"]

    def rerootings(self, q=None, v=None) -> Any:
        """The same motion seen from every base body in turn: a page with a slider for the base, and what changes with it and what stays.

        The tree, coordinates and P(k) belong to the base that was chosen; poses, velocities, accelerations, energy, momentum, ln det ℳ
        and Υ(k) do not: a body of a free tree is felt as Υ(k)⁻¹ = P(k) + S⁺(k), of which the base decides what is outboard. Loops are not
        looked at: all numbers are the tree's.

        Parameters
        ----------
        q, v : (nq,), (nv,), or a State; the model's own where left out

        Returns
        -------
        RerootingPage
            A notebook shows it; `save("bases.html")` writes a page that opens offline; `stays` and `changes` are its numbers. O(N²):
            every body is made the base of a copy, by `reroot`; O(N⁴) for the condition numbers.

        Raises
        ------
        ModelError
            A tree whose root is not on a free hinge, and what else `reroot` refuses; a q or v that is none of this model's.
        EvaluationError
            More than 60 bodies.

        Examples
        --------
        >>> import pycraft as pc
        >>> robot = pc.tree([-1, 0, 1], ["free", "pin", "ball"], seed=1)
        >>> page = robot.rerootings(robot.random_state(0).q)
        >>> page.bases, page.changes["bodies on the longest path"]
        (['body0', 'body1', 'body2'], [3.0, 2.0, 3.0])
        """
        return _core._face["rerootings"](self, q, v)

    def view(self, q=None, v=None, *, host: str = "127.0.0.1", port: int = 0) -> Any:
        """The model in a live viewer: `Scene.view` of a scene that has nothing but the model's own gravity, if it has one.

        Parameters
        ----------
        q, v : (nq,), (nv,), or a State; the model's own where left out
        host, port : as `Scene.view` takes them

        Returns
        -------
        View

        Raises
        ------
        ModelError
            A q or v that is none of this model's.
        EvaluationError
            A port that is taken, a host that is none.

        Examples
        --------
        >>> import pycraft as pc
        >>> with pc.chain(3).view() as view:
        ...     view.is_local
        True
        """
        return _core._face["view_model"](self, q, v, host=host, port=port)
