"""Measurements of a scene: its cost, the value of each effect, the effects that matter, and the cost of accuracy."""

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
    """Measurements of a scene, which do not change the scene."""

    def cost(
        self, q=None, v=None, *, integrator: str = "dopri5", step: float | None = None, rtol: float = 1e-9, atol: float = 1e-12,
        seconds: float = 0.05, progress: Callable[[str], None] | None = None,
    ) -> CostTable:  # fmt: skip
        """Measure the cost of the scene: seconds of every pass, of the rest of a step, and of every effect.

        The cost of an effect that is on is the time saved without it (the shared cost of a pass belongs to no single effect); of an effect
        that is off, the time added with it. Shares are shares of a step: the time of a run per evaluation.

        Parameters
        ----------
        q, v : (K, nq), (K, nv) or one state; default: five random states. Time is t = 0
        integrator, step, rtol, atol : options of the measured run, as in `simulate`
        seconds : time per measured value; times are the least of several rounds over all values
        progress : called with the name of the next measurement

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
        """Measure the value of each effect: the error of leaving it out, in accelerations and trajectory, against the time saved.

        Parameters
        ----------
        without : names of effects, or sets of them, e.g. ["friction", ("friction", "damping")]
            One row each. Default: every effect that is on by itself, then sets of the effects that matter least.
        q, v : (nq,), (nv,) at t = 0, by the rule of direct calls
        T : s, of the run
        integrator, step, rtol, atol : options of all runs, as in `simulate`
        seconds : time per measured value; times are the least of several rounds over all rows
        progress : called with the name of the next measurement

        Returns
        -------
        ComparisonTable : with the Pareto front of run time and trajectory error marked; `.front`, `.plot()`

        Raises
        ------
        ModelError
            Effects that do not exist or are already off.
        EvaluationError
            T that is not positive; errors of `simulate` for the whole scene. A scene that does not run without an effect is a refused row.
        """
        from .comparison import compare

        options = {"integrator": integrator, "step": step, "rtol": rtol, "atol": atol}
        return compare(self, without, T, q, v, options, seconds, progress)

    def needed(
        self, tolerance: float, q=None, v=None, *, T: float | None = None, integrator: str = "dopri5", step: float | None = None,
        rtol: float = 1e-9, atol: float = 1e-12, progress: Callable[[str], None] | None = None,
    ) -> NeededTable:  # fmt: skip
        """Return the effects that matter at a tolerance.

        Without T, an effect matters if leaving it out changes accelerations by more than the tolerance, ‖δv̇‖ / ‖v̇‖, at one of the states.
        With T, it matters if the trajectory changes by more, in rad and m, root mean square over coordinates, at one of the times. Effects
        are left out together: effects with changes up to the tolerance are dropped, least first, as long as all dropped effects together
        stay within it.

        Parameters
        ----------
        tolerance : positive
        q, v : without T: (K, nq), (K, nv) or one state, default five random states; with T: (nq,), (nv,) at t = 0
        T : s, duration of a run
        integrator, step, rtol, atol : options of runs, as in `simulate`
        progress : called with what is measured next

        Returns
        -------
        NeededTable : `.names` of the effects that matter, `.others`, a row for each effect
        """
        from .needed import needed

        options = {"integrator": integrator, "step": step, "rtol": rtol, "atol": atol}
        return needed(self, tolerance, q, v, T, options, progress)

    def accuracy(
        self, q=None, v=None, *, T: float = 1.0, integrators: Any = None, tolerances: Any = None, steps: Any = None, forms: Any = None,
        refinements: Any = None, precisions: Any = None, without: Any = None, seconds: float = 0.05,
        progress: Callable[[str], None] | None = None,
    ) -> SceneAccuracyTable:  # fmt: skip
        """Measure the cost of accuracy of this scene: error of a run's trajectory against its time, varying three things in turn.

        Integrators and their tolerances or steps, with the scene as it is; forms, refinements and precisions, by an integrator of high
        order at a tolerance near rounding; effects, each left out. The reference is computed in extended precision, as in
        `pycraft.work_precision`, which also defines the rows. Implicit effects, which act in steps, are replaced in the reference and in
        rows of the arithmetic by their limits for small steps: plain damping and springs.

        Parameters
        ----------
        q, v : (nq,), (nv,) at t = 0, by the rule of direct calls
        T : s, of the run
        integrators : as in `simulate`; default: "dopri5", "dop853", "rkmk4"
        tolerances, steps : rtol and atol of controlled integrators; steps, s, of integrators with fixed steps
        forms, refinements, precisions : as in `pycraft.accuracy`; default: all forms, none and one with a wider residual, double and
            extended
        without : effects or sets of effects to leave out, as in `compare`; default: every effect that is on
        seconds : time over which a run is repeated, at least once; the least time counts
        progress : called with the name of the next run

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
        """Return the linear model of the scene, including its effects, near a state, or each of a batch or a run (`scene.linearize(run)`).

        States, inputs and outputs are as in `Multibody.linearize`, and the effects' own states follow the velocities ("state.0", ...).
        Inputs are generalized forces in addition to the effects'. Effects written in C++ are exact, by derivatives of their own arithmetic;
        effects in Python use central differences, with about ten correct digits. At the edge of a stop or of a drive's limit, derivatives
        are taken on the side of the present forces. Time is held, and so are the outputs of sampled controllers: their forces are constants
        here, independent of the states, as between two samples. Prescribed motion continues as prescribed:
        its rows and columns are zero, and an input there moves nothing. If effects keep loops, the states are displacements and
        velocities on the loops, in independent coordinates, as for `Multibody.linearize` with loops=True.

        Parameters
        ----------
        q, v : (nq,), (nv,), each with an optional leading batch axis
        t : s, one number or one for each state; default: the times of a run given as q, else 0
        states : (n,) or (B, n), the effects' own states; default: the states of a run given as q, else the initial ones
        inputs, outputs, dt, method, independent : as in `Multibody.linearize`

        Raises
        ------
        EvaluationError
            A scene in another precision than double; a singular state of loops; coinciding nodes of a spring or damper, where there are no
            derivatives.
        ModelError
            Unknown names, a wrong number of states; a state off the loops, coordinates that do not determine the others.

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
        """Return the second-order model of the scene, including its effects, near a state or each of a batch, as needed by iLQR and DDP.

        `linearize` is its first order; `Multibody.quadratic_model` is the same for a model without effects. Effects written in C++ are
        exact, by second derivatives of their own arithmetic. If one is written in Python, all effects use central differences with steps of
        2⁻¹³: the error is about 1e-7 for functions of the size of their arguments. Time is held, except that a step of an integrator
        (`discrete`) ends later; prescribed motion continues as prescribed, and outputs of controllers are held over a step.

        Parameters
        ----------
        q, v : (nq,), (nv,), each with an optional leading batch axis
        t : s, one number or one for each state; default: the times of a run given as q, else 0
        states : (n,) or (B, n), the effects' own states; default: the states of a run given as q, else the initial ones
        inputs : names of hinges, coordinates or patterns, or a list of them, with generalized forces as inputs; None: all

        Returns
        -------
        QuadraticModel : `contracted(costate)` and `tensors()`, at O(N · n²) per state for n = 2 nv + own, `discrete(dt, integrator)`

        Raises
        ------
        EvaluationError
            A scene that keeps loops, uses another precision than double, or acts by impulses; an effect without second
            derivatives at this state, by name: a coordinate exactly at its stop or at a limit of its drive, `QuadraticDamping` at rest,
            coinciding nodes of a spring or damper, a ball half a turn from its spring's rest.
        ModelError
            Unknown names, a wrong number of states.

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
