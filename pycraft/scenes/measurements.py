"""The measuring faces of a scene: what it costs, what each effect buys, which matter, what accuracy costs."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..dynamics.quadratic import QuadraticModel
    from ..linear.linear_model import LinearModel
    from .comparison import ComparisonTable
    from .cost import CostTable
    from .needed import NeededTable
    from .scene_accuracy import SceneAccuracyTable


class Measurements:
    """What a scene measures of itself. Nothing of the scene is changed by it."""

    def cost(
        self, q=None, v=None, *, integrator: str = "dopri5", step: float | None = None, rtol: float = 1e-9, atol: float = 1e-12,
        seconds: float = 0.05, progress: Callable[[str], None] | None = None,
    ) -> CostTable:  # fmt: skip
        """What the scene costs: seconds of every pass, of what a step spends beside them, and of every effect.

        An effect that is on costs what the scene is faster without it (what passes share, none of their effects costs alone); one that is
        off, what the scene would be slower with it. Its share is of a step: of what a run takes for each of its evaluations.

        Parameters
        ----------
        q, v : (K, nq), (K, nv) or one state; five random ones where left out. Time is t = 0
        integrator, step, rtol, atol : of the run whose steps are measured, as in `simulate`
        seconds : spent on each figure; times are the least of several rounds in which everything has its turn
        progress : called with what is measured next

        Returns
        -------
        CostTable : a table of rows (`to_pandas`, `to_csv`, ...), `.plot()`, `["damping"]`

        Examples
        --------
        >>> import pycraft as pc
        >>> scene = pc.Scene(pc.chain(5)).add(pc.effects.Gravity(), pc.effects.Damping(0.1))
        >>> table = scene.cost(seconds=0.001)
        >>> [row["what"] for row in table.of("pass")], [row["what"] for row in table.of("on")]
        (['damping', 'accelerations'], ['gravity', 'damping'])
        """
        from .cost import cost

        return cost(self, q, v, integrator, step, rtol, atol, seconds, progress)

    def compare(
        self, without: Any = None, q=None, v=None, *, T: float = 1.0, integrator: str = "dopri5", step: float | None = None,
        rtol: float = 1e-9, atol: float = 1e-12, seconds: float = 0.05, progress: Callable[[str], None] | None = None,
    ) -> ComparisonTable:  # fmt: skip
        """What each effect buys: the error that leaving it out makes, in accelerations and trajectory, against the time that it saves.

        Parameters
        ----------
        without : names of effects, or sets of them, e.g. ["friction", ("friction", "damping")]
            A row each. Where left out: every effect that is on by itself, then those that matter least together.
        q, v : (nq,), (nv,) at t = 0, by the rule of direct calls
        T : s, of the run
        integrator, step, rtol, atol : of all runs, as in `simulate`
        seconds : spent on each time; times are the least of several rounds in which every row has its turn
        progress : called with what is measured next

        Returns
        -------
        ComparisonTable : with the Pareto front of run's time and trajectory's error marked; `.front`, `.plot()`

        Raises
        ------
        ModelError
            Effects that are not there or off already.
        EvaluationError
            T that is not positive; what `simulate` says of the whole scene. A scene that does not run without an effect is a refused row.
        """
        from .comparison import compare

        options = {"integrator": integrator, "step": step, "rtol": rtol, "atol": atol}
        return compare(self, without, T, q, v, options, seconds, progress)

    def needed(
        self, tolerance: float, q=None, v=None, *, T: float | None = None, integrator: str = "dopri5", step: float | None = None,
        rtol: float = 1e-9, atol: float = 1e-12, progress: Callable[[str], None] | None = None,
    ) -> NeededTable:  # fmt: skip
        """The effects that matter at a tolerance.

        Without T: where leaving an effect out changes accelerations by more than the tolerance, ‖δv̇‖ / ‖v̇‖, at one of the states. With T:
        where it changes the trajectory by more, in rad and m, root mean square over coordinates, at one of the times. What is left out is
        left out together: effects that matter by no more than the tolerance are dropped as long as all that are dropped do not either, the
        least first.

        Parameters
        ----------
        tolerance : positive
        q, v : without T: (K, nq), (K, nv) or one state, five random ones where left out; with T: (nq,), (nv,) at t = 0
        T : s, of a run
        integrator, step, rtol, atol : of runs, as in `simulate`
        progress : called with what is measured next

        Returns
        -------
        NeededTable : `.names` of those that matter, `.others`, a row for each
        """
        from .needed import needed

        options = {"integrator": integrator, "step": step, "rtol": rtol, "atol": atol}
        return needed(self, tolerance, q, v, T, options, progress)

    def accuracy(
        self, q=None, v=None, *, T: float = 1.0, integrators: Any = None, tolerances: Any = None, steps: Any = None, forms: Any = None,
        refinements: Any = None, precisions: Any = None, without: Any = None, seconds: float = 0.05,
        progress: Callable[[str], None] | None = None,
    ) -> SceneAccuracyTable:  # fmt: skip
        """What accuracy costs in time, for this scene: error of a run's trajectory against its time, as each of three things is varied.

        Integrators and their tolerances or steps, of the scene as it is; forms, refinements and precisions, by an integrator of high order
        at a tolerance near rounding; effects, each left out. The reference is everything in extended precision, as in
        `pycraft.work_precision`, whose rows these are. Implicit effects, which act in steps, are in the reference and in rows of the
        arithmetic what they come to in small steps: plain damping and springs.

        Parameters
        ----------
        q, v : (nq,), (nv,) at t = 0, by the rule of direct calls
        T : s, of the run
        integrators : as in `simulate`; "dopri5", "dop853", "rkmk4"
        tolerances, steps : of controlled integrators, rtol and atol; s, of those with steps of one size
        forms, refinements, precisions : as in `pycraft.accuracy`; all forms, none and one with a wider residual, double and extended
        without : effects or sets of them that are left out, as in `compare`; every one that is on
        seconds : a run is repeated until this is spent, once at least; the least time counts
        progress : called with what is run next

        Returns
        -------
        SceneAccuracyTable : `.front`, `.fastest(error)`, `.plot()`
        """
        from .scene_accuracy import accuracy

        return accuracy(
            self, T, q, v, integrators=integrators, tolerances=tolerances, steps=steps, forms=forms, refinements=refinements,
            precisions=precisions, without=without, seconds=seconds, progress=progress,
        )  # fmt: skip

    def linearize(
        self, q=None, v=None, t: Any = None, *, states: Any = None, inputs: Any = None, outputs: Any = None, dt: float | None = None,
        method: str = "zoh", independent: Any = None,
    ) -> LinearModel:  # fmt: skip
        """The linear model of the scene near a state, its effects included, or near each of a batch or a run (`scene.linearize(run)`).

        States, inputs and outputs are as in `Multibody.linearize`, and the effects' own states follow the velocities ("state.0", ...).
        Inputs are generalized forces beside those of the effects. Exact: effects written in C++ by derivatives of their own arithmetic;
        those in Python by central differences, of which about ten digits are right. At the edge of a stop or of a drive's limit they are
        those of the side that the forces are of. Time itself is held, and so is what sampled controllers hold: their forces are constants
        here, whatever the states, as between two samples. Prescribed motion goes on as prescribed:
        its rows and columns are zero, and an input there moves nothing. Where effects keep loops the states are displacements and
        velocities on them, in independent coordinates, as of `Multibody.linearize` with loops=True.

        Parameters
        ----------
        q, v : (nq,), (nv,), each with an optional leading batch axis
        t : s, one number or one for each state; where left out that of the run that q is, else 0
        states : (n,) or (B, n), of the effects' own; where left out those of the run that q is, else as they are at first
        inputs, outputs, dt, method, independent : as in `Multibody.linearize`

        Raises
        ------
        EvaluationError
            A scene in another precision than double; a singular state of loops; nodes of a spring or damper at one place, where no side
            has derivatives.
        ModelError
            Names that are not there, another number of states; a state off the loops, coordinates that do not tell where the others are.

        Examples
        --------
        >>> import pycraft as pc
        >>> scene = pc.mechanisms.pendulum().add(pc.effects.Damping(0.5))
        >>> near = scene.linearize([1.5707963267948966])  # hanging
        >>> near.A.round(4).tolist()
        [[0.0, 1.0], [-9.81, -0.5]]
        """
        from .linearized import linearize

        return linearize(self, q, v, t, states=states, inputs=inputs, outputs=outputs, dt=dt, method=method, independent=independent)

    def quadratic_model(self, q=None, v=None, t: Any = None, *, states: Any = None, inputs: Any = None) -> QuadraticModel:
        """The model of the scene to second order near a state, its effects included, or near each of a batch: what iLQR and DDP ask for.

        `linearize` is its first order; `Multibody.quadratic_model` is the same of a model without effects. Exact: effects written in C++ by
        second derivatives of their own arithmetic. Where one is written in Python all effects are differenced, centrally, with steps of
        2⁻¹³: of functions of the size of their arguments 1e-7 is wrong. Time itself is held, but that a step of an integrator
        (`discrete`) ends later; what is prescribed stays as it is told, and what controllers hold stays over a step.

        Parameters
        ----------
        q, v : (nq,), (nv,), each with an optional leading batch axis
        t : s, one number or one for each state; where left out that of the run that q is, else 0
        states : (n,) or (B, n), of the effects' own; where left out those of the run that q is, else as they are at first
        inputs : names of hinges, coordinates or patterns, or a list of them, whose generalized forces are inputs; None: all

        Returns
        -------
        QuadraticModel : `contracted(costate)` and `tensors()`, at O(N · n²) a state for n = 2 nv + own, `discrete(dt, integrator)`

        Raises
        ------
        EvaluationError
            A scene that keeps loops, one in another precision than double, one that acts by impulses; an effect that has no second
            derivatives at this state, by name: a coordinate just at its stop or at a limit of its drive, `QuadraticDamping` at rest,
            nodes of a spring or damper at one place, a ball half a turn from its spring's rest.
        ModelError
            Names that are not there, another number of states.

        Examples
        --------
        >>> import pycraft as pc
        >>> scene = pc.mechanisms.pendulum().add(pc.effects.QuadraticDamping(0.5))  # v̇ = 9.81 cos q - 0.5 |v| v
        >>> near = scene.quadratic_model([0.5], [2.0])
        >>> near.contracted([0.0, 1.0]).xx.round(4).tolist()
        [[-8.6091, 0.0], [0.0, -1.0]]
        >>> near.discrete(0.01)
        <quadratic model: 'pendulum', 2 states, 1 inputs, 2 outputs, step 0.01 s>
        """
        from .scene_quadratic import quadratic_model

        return quadratic_model(self, q, v, t, states=states, inputs=inputs)
