"""Pictures of a model: its tree as text, and stick figures that higher layers draw, static or live."""

from __future__ import annotations

from typing import Any

from .. import _core
from .shapes import Shape
from .tree_diagram import TreeDiagram, tree_diagram


class Pictures:
    """Text and pictures of a model."""

    _shapes: list[Shape]

    def _repr_html_(self) -> str:
        return str(_core._face["model_html"](self))

    def tree(self, most: int | None = 200, *, nodes: bool = False) -> TreeDiagram:
        """Return the tree as text in 80 columns: each body below and right of its carrier, its hinge, and its places in q and v.

        Parameters
        ----------
        most : int or None
            Number of lines of bodies; the middle of a longer tree is omitted. None: all.
        nodes : bool
            Whether to show nodes.

        Returns
        -------
        TreeDiagram
            Text when it is printed. A tree of more than a dozen levels does not indent only children. Names of hinges are omitted if they
            do not fit, and not repeated if they equal their bodies'.

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
        """Draw a stick figure of the model at a state, by Matplotlib alone: no mesh is needed.

        Bones connect hinges; a body without children has bones to its nodes, or else to the end of a uniform rod of its mass and second
        moment. Markers show the kinds of hinges, lines through them their axes, dashed lines displacements of sliders. Equal scales,
        metres.

        Parameters
        ----------
        q : (nq,) or a State; default: the model's own
        ax : Axes of Matplotlib, in space or in the plane
            Default: new ones. Their contents stay in view, so that several states can be overlaid.
        view : {"auto", "3d", "xy", "xz", "yz"}
            "auto": the plane of a flat model, space for any other.
        com : bool
            Centres of mass: of each body, with area by its mass, and of all.
        names : bool
            Of the hinges, beside them.
        legend, shadow, alpha : a legend of the markers; the shadow of the bones on the floor, in space; opacity

        Returns
        -------
        Axes

        Raises
        ------
        ModelError
            A q that does not fit this model.
        EvaluationError
            Another view, or one that does not match the axes.

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
        """Return each body's share of the degrees of freedom, tr(Υ(k)M(k)), as values and as colour on the robot. O(N); with rotors O(N²).

        The shares of bodies, and of rotors tr(ℳ⁻¹(k,k)J(k)), add up to the number of coordinates N. Loops are ignored: the shares belong
        to the tree.

        Parameters
        ----------
        q : (nq,) or a State; default: the model's own

        Returns
        -------
        Shares
            `by_body`, `of_bodies`, `of_rotors`, `total`; a table when printed, a picture with a colour bar in a notebook, `plot()` one by
            Matplotlib.

        Raises
        ------
        ModelError
            A q that does not fit this model.
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
        """The shapes that display the bodies in the model's file, in the file's order; empty for a model that was not loaded.

        Visuals of a URDF or SDF file, geoms of the groups 0 to 2 of an MJCF file, `[[shapes]]` of a TOML file. The viewer and pages of runs
        draw them, and read meshes then (extra `meshes`). `Multibody.save` writes them, except meshes that were embedded in an MJCF file.

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.chain(2).shapes
        []
        """
        return [shape for shape in self._shapes if shape.purpose == "visual"]

    @property
    def collision_shapes(self) -> list[Shape]:
        """The collision shapes of the model's file, in the file's order; empty for a model that was not loaded.

        Collisions of a URDF or SDF file, geoms of an MJCF file that collide. No dynamics uses them; `Multibody.save` writes them.
        """
        return [shape for shape in self._shapes if shape.purpose == "collision"]

    def rerootings(self, q=None, v=None) -> Any:
        """Return a page of the same motion seen from every base body in turn, with a slider for the base, showing what changes and what
        stays.

        The tree, coordinates and P(k) depend on the chosen base; poses, velocities, accelerations, energy, momentum, ln det ℳ and Υ(k) do
        not: the inertia felt at a body of a free tree is Υ(k)⁻¹ = P(k) + S⁺(k), and the base determines what is outboard. Loops are
        ignored: all values belong to the tree.

        Parameters
        ----------
        q, v : (nq,), (nv,), or a State; default: the model's own

        Returns
        -------
        RerootingPage
            A notebook shows it; `save("bases.html")` writes a page that opens offline; `stays` and `changes` hold its values. O(N²): every
            body becomes the base of a copy, by `reroot`; O(N⁴) for the condition numbers.

        Raises
        ------
        ModelError
            A tree with a root that is not on a free hinge, and the errors of `reroot`; a q or v that does not fit this model.
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
        """Open the model in a live viewer: `Scene.view` of a scene with only the model's own gravity, if it has one.

        Parameters
        ----------
        q, v : (nq,), (nv,), or a State; default: the model's own
        host, port : as in `Scene.view`

        Returns
        -------
        View

        Raises
        ------
        ModelError
            A q or v that does not fit this model.
        EvaluationError
            A port that is in use, an invalid host.

        Examples
        --------
        >>> import pycraft as pc
        >>> with pc.chain(3).view() as view:
        ...     view.is_local
        True
        """
        return _core._face["view_model"](self, q, v, host=host, port=port)
