"""
The compiled core of pycraft: operators, planner, engine and model. Use it through the package pycraft.
"""
from __future__ import annotations
import collections.abc
import fractions
import numpy
import numpy.typing
import typing
__all__: list[str] = ['Binding', 'Centroidal', 'Curvature', 'Dynamics', 'Effect', 'EmbeddedOperators', 'Error', 'EvaluationError', 'FrameTree', 'FunctionOfTime', 'GroupedOperators', 'HingeKind', 'HybridDynamics', 'Integration', 'InterbodyForces', 'Letter', 'LoopSet', 'MatrixTree', 'Methods', 'ModelError', 'Multibody', 'MultibodyOperators', 'Operator', 'Parameter', 'PassCounts', 'Plan', 'PreparedHybridDynamics', 'RefinementError', 'RunRecord', 'Scalar', 'SceneCalls', 'SceneEffects', 'Sensitivities', 'SingularHingeError', 'SingularOperatorError', 'SkoSource', 'Space', 'SpaceError', 'StaleOperatorError', 'SubhingeKind', 'SymbolDefinition', 'Theorem', 'alone', 'blockdiag', 'bushing_effect', 'check_pairing', 'checked_refinement', 'compiled_call', 'constant', 'constant_in_time', 'coordinates_named', 'coulomb_friction_effect', 'damping_effect', 'direct_call', 'direct_calls', 'epsilons', 'equal_by_theorems', 'euclidean', 'external', 'fixman_effect', 'float128', 'fluid_drag_effect', 'forms', 'frame_tape', 'gravity_compensation_effect', 'gravity_effect', 'gravity_gradient_effect', 'harmonic', 'held_states', 'hermite_between', 'hinge_kinds', 'identity', 'implicit_damping_effect', 'implicit_spring_effect', 'instruction_set', 'instruction_sets', 'integrator_table', 'integrators', 'kernel_headers', 'kernel_tape', 'langevin_effect', 'limits_effect', 'methods', 'motor_effect', 'node_damper_effect', 'node_spring_effect', 'nose_hoover_effect', 'numbers_in_q', 'operators_of', 'pack_width', 'piecewise_polynomial', 'point_mass_gravity_effect', 'precisions', 'prepared_call', 'prescribed_by', 'prescribed_effect', 'python_effect', 'python_function_of_time', 'quadratic_damping_effect', 'real_array', 'record_from', 'residual', 'retired_integrator', 'rotor_inertia_effect', 'run_scene', 'run_scenes', 'scalar', 'scalar_tape', 'scene_at_rest', 'scene_between', 'scene_curvature', 'scene_interbody_forces', 'scene_linearized', 'servo_effect', 'spring_effect', 'step_accelerations', 'step_kinds', 'subhinge_kinds', 'symbols', 'theorems', 'time_apply', 'time_by_hand', 'time_compiled', 'time_dynamics', 'time_forward', 'time_hybrid', 'time_method', 'time_packs', 'time_passes', 'time_scene', 'torque_source_effect', 'unbound_sources', 'vector', 'wider', 'wrench_effect', 'zero']

class Error(Exception): ...
class SpaceError(Error, TypeError): ...
class ModelError(Error, ValueError): ...
class EvaluationError(Error, ValueError): ...
class SingularHingeError(Error, ArithmeticError): ...
class SingularOperatorError(Error, ArithmeticError): ...
class RefinementError(Error, ArithmeticError): ...
class StaleOperatorError(Error, RuntimeError): ...
class Space:
    """
    A space that operators map between: Θ generalized coordinates, V and F stacked body motions and forces (dual), NodesV and
    NodesF those of nodes (dual), R^n a user's own. Spaces compare by kind, model and blocks, never by size alone.
    """
    @typing.overload
    def __eq__(self, arg0: object) -> bool:
        ...
    @typing.overload
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __hash__(self) -> int:
        ...
    def __len__(self) -> int:
        ...
    def __reduce__(self) -> tuple:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def _owner(self) -> int:
        ...
    @property
    def blocks(self) -> list:
        """
        List of (label, slice, body number) in the order of a vector's entries; body -1 for none.
        """
    @property
    def bodies(self) -> int:
        """
        Number of bodies that it is cut into; 0 for R^n.
        """
    @property
    def dimension(self) -> int:
        ...
    @property
    def dual(self) -> Space:
        ...
    @property
    def name(self) -> str:
        ...
class Multibody:
    """
    A multibody model in the core; pycraft.Multibody is its Python face.
    """
    @typing.overload
    def __init__(self, name: str = 'multibody', keep_welds: bool = False, strict: bool = False) -> None:
        ...
    @typing.overload
    def __init__(self, whole: Multibody, name: str, bodies: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], moving_base: bool) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
    def _add_body(self, name: str, parent: str, hinge: str, hinge_name: str, axes: collections.abc.Sequence[typing.Any], point: typing.Any, pitch: typing.Any, subhinges: typing.Any, rotation: typing.Any, position: typing.Any, mass: typing.Any, com: typing.Any, inertia: typing.Any, rotor_inertia: typing.Any, lower: typing.Any, upper: typing.Any) -> None:
        ...
    def _add_node(self, arg0: str, arg1: str, arg2: typing.Any, arg3: typing.Any) -> None:
        ...
    def _body(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> dict:
        ...
    def _body_index(self, arg0: str) -> int:
        ...
    def _branch(self, root: typing.SupportsInt | typing.SupportsIndex) -> tuple[list[str], list[str], list[str]]:
        """
        Names of a body and all outboard of it (-1: of all), of their hinges, and of the nodes on them.
        """
    def _coalesce(self, bodies: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> list:
        ...
    def _follow_base(self) -> None:
        ...
    def _frame_body(self, arg0: str) -> int:
        """
        The number of the body that a body or node is on, -1 for the base.
        """
    def _graft(self, source: Multibody, root: typing.SupportsInt | typing.SupportsIndex, parent: str, rotation: typing.Any, position: typing.Any, places_hinge: bool, bodies: collections.abc.Sequence[str], hinges: collections.abc.Sequence[str], nodes: collections.abc.Sequence[str]) -> None:
        ...
    def _hinge_index(self, arg0: str) -> int:
        ...
    def _hinge_sizes(self) -> tuple[list[str], list[int]]:
        ...
    def _lock(self, bodies: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], v: typing.Any) -> None:
        ...
    def _names(self) -> tuple[list[str], list[str]]:
        ...
    def _node(self, arg0: str) -> dict:
        ...
    def _node_index(self, arg0: str) -> int:
        ...
    def _nodes(self) -> list:
        ...
    def _outboard_of(self, root: typing.SupportsInt | typing.SupportsIndex, without: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> list[int]:
        ...
    def _path_between(self, a: typing.SupportsInt | typing.SupportsIndex, b: typing.SupportsInt | typing.SupportsIndex) -> list[int]:
        ...
    def _rehang(self, body: str, parent: str, hinge: str, hinge_name: str, axes: collections.abc.Sequence[typing.Any], point: typing.Any, pitch: typing.Any, subhinges: typing.Any, rotation: typing.Any, position: typing.Any, rotor_inertia: typing.Any, lower: typing.Any, upper: typing.Any, q: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], v: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> None:
        ...
    def _relative_motion(self, body: str, frame: str) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]:
        """
        Rotation, position and twist of a body against a body, node, or the base (empty).
        """
    def _remove_body(self, name: str) -> None:
        ...
    def _require_new(self, bodies: collections.abc.Sequence[str], hinges: collections.abc.Sequence[str], nodes: collections.abc.Sequence[str], frames: collections.abc.Sequence[str], loose: collections.abc.Sequence[str]) -> None:
        ...
    def _reroot(self, body: str, rates: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> list[tuple[str, list[float]]]:
        """
        Returns the accelerations of the hinges that were turned, by name.
        """
    def _set_limits(self, arg0: typing.SupportsInt | typing.SupportsIndex, arg1: typing.Any, arg2: typing.Any) -> None:
        ...
    def _set_mass_properties(self, arg0: typing.SupportsInt | typing.SupportsIndex, arg1: typing.Any, arg2: typing.Any, arg3: typing.Any) -> None:
        ...
    def _set_placement(self, arg0: typing.SupportsInt | typing.SupportsIndex, arg1: typing.Any, arg2: typing.Any) -> None:
        ...
    def _set_rotor_inertia(self, arg0: typing.SupportsInt | typing.SupportsIndex, arg1: typing.Any) -> None:
        ...
    def _slices(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> tuple[slice, slice]:
        ...
    def _split(self, bodies: collections.abc.Sequence[dict]) -> None:
        ...
    def _stop_at_once(self, bodies: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]:
        """
        Velocities and impulses where the hinges of these bodies stop at once, at the present state.
        """
    def _unlock(self, hinges: collections.abc.Sequence[dict]) -> None:
        ...
    def check_q(self, arg0: typing.Any) -> None:
        ...
    def difference(self, q0: typing.Any, q1: typing.Any) -> numpy.typing.NDArray[numpy.float64]:
        """
        The velocity dv with integrate(q0, dv) = q1.
        """
    def integrate(self, q: typing.Any, dv: typing.Any) -> numpy.typing.NDArray[numpy.float64]:
        """
        q moved along the velocity dv for unit time: on the group for ball and free hinges (exponential of the body twist).
        """
    def take_warnings(self) -> list[tuple[str, str]]:
        ...
    def zero_q(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        All coordinates zero, quaternions (1, 0, 0, 0).
        """
    @property
    def _parameters(self) -> int:
        ...
    @property
    def _part(self) -> typing.Any:
        """
        Of a part: its bodies in the whole, its base and where its coordinates are there; None for a model of its own.
        """
    @property
    def _size(self) -> int:
        ...
    @property
    def coordinate_names(self) -> list[str]:
        """
        One per generalized velocity: the hinge's name, or "hinge[j]" where it has several.
        """
    @property
    def gravity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Gravity acceleration in world axes, m/s²; zero until it is set.
        """
    @gravity.setter
    def gravity(self, arg1: typing.Any) -> None:
        ...
    @property
    def has_rotor_inertia(self) -> bool:
        ...
    @property
    def keeps_welds(self) -> bool:
        ...
    @property
    def mass(self) -> float:
        """
        Of all bodies, kg.
        """
    @property
    def name(self) -> str:
        ...
    @property
    def nq(self) -> int:
        """
        Numbers in q: 4 for a ball, 7 for a free hinge, else one a coordinate.
        """
    @property
    def nv(self) -> int:
        """
        Generalized velocities: the degrees of freedom.
        """
    @property
    def q(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Generalized coordinates (nq,): copied in when set, a read-only view when read.
        """
    @q.setter
    def q(self, arg1: typing.Any) -> None:
        ...
    @property
    def strict(self) -> bool:
        ...
    @property
    def v(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Generalized velocities (nv,): copied in when set, a read-only view when read.
        """
    @v.setter
    def v(self, arg1: typing.Any) -> None:
        ...
class SkoSource:
    """
    Where the blocks of operators come from: a model, or a bare tree of matrices.
    """
    def __reduce__(self) -> tuple:
        ...
    def _symbol_again(self, arg0: str, arg1: tuple, arg2: str) -> Operator:
        ...
    def check_current(self) -> None:
        ...
    def nodes_space(self, arg0: collections.abc.Sequence[str], arg1: bool) -> Space:
        ...
    def symbol(self, name: str, nodes: collections.abc.Sequence[str] = [], coordinate: typing.SupportsInt | typing.SupportsIndex = -1) -> Operator:
        ...
    @property
    def F(self) -> Space:
        ...
    @property
    def Theta(self) -> Space:
        ...
    @property
    def V(self) -> Space:
        ...
    @property
    def body_names(self) -> list[str]:
        ...
    @property
    def coordinate_names(self) -> list[str]:
        ...
    @property
    def derived_from(self) -> typing.Any:
        """
        How this tree was made of a model's, "hinge subset", "world frame", "cut tree", "another root", "loops", "groups of bodies" or "embedded loops", and that model's source, of embedded loops that of the groups; None for a model's own.
        """
    @property
    def dof(self) -> list[int]:
        ...
    @property
    def groups(self) -> typing.Any:
        """
        Of grouped bodies: the numbers of the model's bodies in each group; None for other trees.
        """
    @property
    def hinge_names(self) -> list[str]:
        ...
    @property
    def model(self) -> typing.Any:
        """
        The multibody model whose operators these are; None for a tree of given matrices.
        """
    @property
    def name(self) -> str:
        ...
    @property
    def parents(self) -> list[int]:
        ...
    @property
    def sizes(self) -> list[int]:
        ...
    @property
    def traits(self) -> dict:
        ...
class Binding:
    """
    A state, or a batch of them, that an expression is bound to.
    """
    def __reduce__(self) -> tuple:
        ...
    @property
    def threads(self) -> int:
        """
        How many share the states of a batch.
        """
class Operator:
    """
    An operator expression: what was typed, as data. It holds no numbers and computes nothing until it is applied to an array
    (`op @ x`) or asked for one (`dense()`, `diagonal()`, `trace()`, ...). Then rules, planner and engine evaluate it by sweeps
    over the tree.
    """
    __array_priority__: typing.ClassVar[float] = 1000.0
    __array_ufunc__ = None
    def __add__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __array__(self, dtype: typing.Any = None, copy: typing.Any = None) -> typing.Any:
        ...
    def __eq__(self, arg0: typing.Any) -> typing.Any:
        """
        Structural equality after flattening sums and products: a bool, no numbers. Equality by value is pycraft.check.
        """
    def __hash__(self) -> int:
        ...
    def __matmul__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __mul__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __neg__(self) -> Operator:
        ...
    def __pos__(self) -> Operator:
        ...
    def __pow__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __radd__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __reduce__(self) -> tuple:
        ...
    def __repr__(self) -> str:
        ...
    def __rmatmul__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __rmul__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __rsub__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __str__(self) -> str:
        ...
    def __sub__(self, arg0: typing.Any) -> typing.Any:
        ...
    def __truediv__(self, arg0: typing.Any) -> typing.Any:
        ...
    def _bound(self, arg0: Binding) -> Operator:
        ...
    def _parts(self) -> tuple:
        ...
    def _repr_latex_(self) -> typing.Any:
        """
        The formula, broken where it is long, and below it spaces, structure and cost.
        """
    def _with_operand(self, arg0: Operator) -> Operator:
        """
        The same function of another operand.
        """
    def algorithm(self, language: str = 'text', request: str = 'apply') -> typing.Any:
        """
        The plan written out as the textbook recursion: language "text", "latex", or "python" (NumPy alone) and "cpp" (Eigen alone),
        source that runs by itself. See pycraft.recursions.
        """
    def animate(self, x: typing.Any = None, *, on: str = 'tree', request: str = 'apply') -> typing.Any:
        """
        The sweeps of the plan for x (ones where it is left out) as a film on the tree, or on="robot", with a page by save. See pycraft.view.SweepFilm.
        """
    def at(self, q: typing.Any = None, v: typing.Any = None, *, form: str = 'fast', refine: typing.Any = 0, residual: str = 'same', precision: str | int = 'double', threads: typing.Any = 1) -> Operator:
        """
        The same expression bound to a state: q (nq,) or a batch (B, nq), v likewise (zero if left out); q=None takes the model's present state.
        The innermost binding wins. form: "fast", "ud" or "square-root", of the articulated-inertia sweep; refine: corrections of what is solved, a
        number or "auto", with residual="same", "gather" or "wider"; precision: "single", "double", "extended", "quad", 50, 100; threads: share a batch.
        """
    def blocks(self, order: str = 'base-to-tip') -> typing.Any:
        """
        A labelled block view of the dense form; order="tip-to-base" shows the book's triangles.
        """
    def certify(self, *args, **kwargs) -> typing.Any:
        """
        certify(q=None, x=None, *, v=None, form="fast", refine=0, residual="same", precision="double", seed=0, seconds=0.02)

        The value at one state, the dense form or the product with x, with its measured error, what rounding of q, v and x does,
        condition, where digits are lost and what the next rung costs: a pycraft.accuracy.certificates.certificate.Certificate. q: (nq,) or a State,
        the model's present state where left out; x: (n,) or (n, m); v: (nv,), zero where left out; form, refine, residual and precision
        as in at; seed: of the signs by which the data are moved; seconds: spent on each timing. Raises EvaluationError where the
        expression is bound already, ModelError for arrays of another shape and for a model without coordinates.
        """
    def check_current(self) -> None:
        """
        Raises StaleOperatorError if a model's structure changed since this was made.
        """
    def compile(self, request: str = 'apply') -> typing.Any:
        """
        The plan written out as straight-line C++, built and loaded: a callable of q, of v where velocities matter, of x for "apply" and not
        for "dense", "diagonal", "trace", "logdet" and "norm"; one state or a batch, out=. See Multibody.compile, docs/compiled.md.
        """
    def dense(self, dtype: typing.Any = None, rules: bool = True) -> typing.Any:
        """
        The operator as an array (codomain, domain), with a leading batch axis if one is bound. dtype=object keeps a wider precision as
        mpmath numbers; rules=False evaluates what was typed, no theorem used.
        """
    def diagonal(self) -> typing.Any:
        """
        The diagonal entries (n,), or (B, n). Cost O(N).
        """
    def diff(self, *args, frame: str = 'body') -> typing.Any:
        """
        The derivative along a coordinate (its name or number), along a parameter (body.symbol("mass"), hinge.symbol("axis", 0), ...), or
        along several in turn: diff(i, j) is ∂_j(∂_i ·), and diff([i, j]) the list of both. An expression again, by rule, evaluated by sweeps; zero by structure is the zero
        operator. On ball and free hinges coordinates are quasi-velocities, along which derivatives do not commute.
        frame="world": of the operator as resolved in world axes, given in body axes; spaces and shape are the operator's own.
        """
    def dot(self, vdot: typing.Any = None, *, frame: str = 'body') -> Operator:
        """
        The time derivative along the model's velocity v; what depends on v itself needs the accelerations: vdot, an array (nv,) or a
        vector of Θ, of embedded loops θ̈_r. EvaluationError without them.
        """
    def explain(self, request: str = 'apply') -> typing.Any:
        """
        The plan as a table: steps, tiers, cost; shown when it is the last line of a cell.
        """
    def inv(self) -> Operator:
        """
        The inverse, as an expression; how it is evaluated is the planner's business (see explain).
        """
    def latex(self) -> str:
        ...
    def logdet(self) -> Scalar:
        """
        ln|det|, as a scalar expression. Cost O(N); exact by structure where a theorem gives it.
        """
    def norm(self) -> Scalar:
        """
        The Frobenius norm, as a scalar expression.
        """
    def plan(self, request: str = 'apply', rules: bool = True) -> Plan:
        """
        The plan: what is run, step by step, with its cost.
        """
    def play(self, x: typing.Any = None) -> typing.Any:
        """
        `animate` on the model as it stands.
        """
    def python(self) -> str:
        """
        As Python reads it.
        """
    def simplify(self) -> Operator:
        """
        The shortest expression that the rewriting theorems find equal to this one.
        """
    def sqrt(self) -> Operator:
        """
        L with A = L L.T, body by body; for symmetric block-diagonal operators.
        """
    def text(self) -> str:
        """
        As the book prints it, in Unicode; EvaluationError beyond ten million characters.
        """
    def trace(self) -> Scalar:
        """
        The trace, as a scalar expression. Cost O(N).
        """
    def value(self, **kwargs) -> typing.Any:
        """
        The value of a vector expression; named vectors (pycraft.vector) are given by name. rules=False evaluates what was typed.
        """
    @property
    def T(self) -> Operator:
        """
        The transpose, the book's star: A: X→Y gives A.T: Y'→X'. Cost: none.
        """
    @property
    def _state(self) -> typing.Any:
        """
        (q, v, precision) that it is bound to, None where it is not.
        """
    @property
    def batch(self) -> typing.Any:
        ...
    @property
    def children(self) -> list[Operator]:
        ...
    @property
    def codomain(self) -> typing.Any:
        ...
    @property
    def coefficient(self) -> float | fractions.Fraction:
        """
        The number in front: a float where it is one exactly, else a Fraction.
        """
    @property
    def definition(self) -> typing.Any:
        """
        What a letter abbreviates: EφG of K, B*φ*H* of 𝒥; None for what is no such letter.
        """
    @property
    def domain(self) -> typing.Any:
        """
        The space it acts on; None for an I that has none yet.
        """
    @property
    def is_block_diagonal(self) -> bool:
        """
        Known by rule.
        """
    @property
    def is_lower_triangular(self) -> bool:
        """
        By blocks: φ* and ψ* are. Known by rule.
        """
    @property
    def is_symmetric(self) -> bool:
        """
        Known by rule, no number looked at.
        """
    @property
    def is_upper_triangular(self) -> bool:
        """
        By blocks, parents before children: φ and ψ are. Known by rule.
        """
    @property
    def kind(self) -> str:
        ...
    @property
    def letter(self) -> typing.Any:
        """
        What stands behind a symbol, or a function of a model: a Letter. None for anything else.
        """
    @property
    def name(self) -> typing.Any:
        """
        A symbol's or a function's ASCII name, a vector's or a constant's own; None for what is composed.
        """
    @property
    def shape(self) -> tuple[int, int]:
        ...
    @property
    def sources(self) -> list:
        ...
class Scalar:
    """
    A scalar made of operators (trace, ln|det|, norm and their sums): an expression, evaluated by float() or numpy.asarray.
    """
    __array_ufunc__ = None
    def __abs__(self) -> float:
        ...
    @typing.overload
    def __add__(self, arg0: Scalar) -> Scalar:
        ...
    @typing.overload
    def __add__(self, arg0: typing.Any) -> Scalar:
        ...
    def __array__(self, dtype: typing.Any = None, copy: typing.Any = None) -> typing.Any:
        ...
    def __eq__(self, arg0: object) -> bool:
        ...
    def __float__(self) -> float:
        ...
    def __format__(self, arg0: str) -> typing.Any:
        ...
    def __ge__(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> bool:
        ...
    def __gt__(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> bool:
        ...
    def __hash__(self) -> int:
        ...
    def __le__(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> bool:
        ...
    def __lt__(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> bool:
        ...
    @typing.overload
    def __mul__(self, arg0: Scalar) -> Scalar:
        ...
    @typing.overload
    def __mul__(self, arg0: typing.Any) -> Scalar:
        ...
    def __neg__(self) -> Scalar:
        ...
    def __pow__(self, arg0: typing.Any) -> Scalar:
        ...
    def __radd__(self, arg0: typing.Any) -> Scalar:
        ...
    def __reduce__(self) -> tuple:
        ...
    def __repr__(self) -> str:
        ...
    def __rmul__(self, arg0: typing.Any) -> Scalar:
        ...
    def __rsub__(self, arg0: typing.Any) -> Scalar:
        ...
    def __rtruediv__(self, arg0: typing.Any) -> Scalar:
        ...
    @typing.overload
    def __sub__(self, arg0: Scalar) -> Scalar:
        ...
    @typing.overload
    def __sub__(self, arg0: typing.Any) -> Scalar:
        ...
    @typing.overload
    def __truediv__(self, arg0: Scalar) -> Scalar:
        ...
    @typing.overload
    def __truediv__(self, arg0: typing.Any) -> Scalar:
        ...
    def _parts(self) -> tuple[int, typing.Any, typing.Any, typing.Any]:
        ...
    def _repr_latex_(self) -> typing.Any:
        ...
    def algorithm(self, language: str = 'text') -> typing.Any:
        """
        The recursion that computes it: "text", "latex", "python" or "cpp". See pycraft.recursions.
        """
    def animate(self, *, on: str = 'tree') -> typing.Any:
        """
        As of operators: the sweeps of the plan as a film.
        """
    def at(self, *args, **kwargs) -> typing.Any:
        ...
    def bound(self, arg0: Binding) -> Scalar:
        ...
    def certify(self, *args, **kwargs) -> typing.Any:
        """
        certify(q=None, *, v=None, form="fast", refine=0, residual="same", precision="double", seed=0, seconds=0.02)

        The number at one state with its measured error, what rounding of q and v does, where digits are lost and what the next rung
        costs: a pycraft.accuracy.certificates.certificate.Certificate. q: (nq,) or a State, the model's present state where left out; v: (nv,), zero
        where left out; form, refine, residual and precision as in at; seed: of the signs by which the data are moved; seconds: spent
        on each timing. Raises EvaluationError where it is bound already, ModelError for arrays of another shape and for a model
        without coordinates.
        """
    def compile(self) -> typing.Any:
        """
        Written out for this model as straight-line C++, built and loaded: a callable of q, and of v where velocities matter. See
        Multibody.compile.
        """
    def diff(self, *args, frame: str = 'body') -> typing.Any:
        """
        The derivative along a coordinate or a parameter, as a scalar expression.
        """
    def dot(self, vdot: typing.Any = None, *, frame: str = 'body') -> Scalar:
        """
        The time derivative along the model's velocity.
        """
    def gradient(self, over: str = 'coordinates') -> typing.Any:
        """
        All derivatives at once, as an array: over "coordinates" (nv,), or (B, nv) where a batch is bound; where loops are embedded along the
        independent coordinates, zero where nothing moves. Of ln det(HφMφ*H* [+ J]) and
        ln det D in three sweeps, O(N), and then also over "inertias", "geometry", "axes" (see
        Multibody.log_determinant_gradient); of any other scalar one derivative after the other, O(N) each.
        """
    def latex(self) -> str:
        ...
    def operands(self) -> list:
        ...
    def text(self) -> str:
        ...
    def value(self) -> typing.Any:
        """
        The number; with a batch bound, an array (batch,).
        """
    @property
    def kind(self) -> str:
        """
        "number", "trace", "logdet", "norm", "sum", "scaled", "product" or "reciprocal".
        """
    @property
    def number(self) -> typing.Any:
        """
        The number, or that in front of what is scaled: a float where it is one exactly, else a Fraction. None for other kinds.
        """
    @property
    def operand(self) -> typing.Any:
        """
        The operator that a trace, ln|det| or norm is of; None for other kinds.
        """
    @property
    def terms(self) -> list[Scalar]:
        """
        What a sum, product, multiple or reciprocal is made of, as scalars.
        """
class Plan:
    """
    A plan: what an expression becomes before any number is touched. `str(plan)` is the table that explain() shows.
    """
    def __reduce__(self) -> tuple:
        ...
    def __repr__(self) -> str:
        ...
    def __str__(self) -> str:
        ...
    def numbers(self, context: typing.SupportsInt | typing.SupportsIndex, name: str, arguments: tuple = (), state: typing.SupportsInt | typing.SupportsIndex = 0) -> typing.Any:
        """
        A symbol's numbers at a context's state: a vector, or one block per body; `state` picks one of a batch.
        """
    def tape(self, most: typing.SupportsInt | typing.SupportsIndex) -> tuple:
        """
        What the plan does, operation by operation, at states that are decided as the one that it is bound to, a batch of one (tapes.h); the arrays
        that it reads, each ("q", "v", "x" or "vector", name, width), by number; rows and columns of the result.
        """
    @property
    def flops(self) -> float:
        """
        Floating-point operations, for one column.
        """
    @property
    def has_dense_step(self) -> bool:
        ...
    @property
    def memory(self) -> float:
        """
        Bytes of the registers written.
        """
    @property
    def notes(self) -> list[str]:
        """
        Theorems used, and the reason of a dense step.
        """
    @property
    def passes(self) -> PassCounts:
        """
        Counters of the last run.
        """
    @property
    def program(self) -> dict:
        """
        The plan as plain data: contexts, registers and steps in dictionaries; pycraft.recursions writes them out.
        """
    @property
    def run_notes(self) -> list[str]:
        ...
    @property
    def steps(self) -> list:
        """
        The steps as dictionaries: text, tier, flops, memory.
        """
class SubhingeKind:
    """
    A kind of subhinge: sizes, and what its coordinates are.
    """
    def __repr__(self) -> str:
        ...
    @property
    def angle(self) -> bool:
        """
        Whether its one coordinate is an angle, in radians.
        """
    @property
    def axis(self) -> bool:
        """
        Whether it has an axis.
        """
    @property
    def name(self) -> str:
        ...
    @property
    def nq(self) -> int:
        """
        Numbers in q.
        """
    @property
    def nv(self) -> int:
        """
        Velocities.
        """
    @property
    def pitch(self) -> bool:
        """
        Whether it has a pitch, in metres per radian.
        """
    @property
    def point(self) -> bool:
        """
        Whether it has a point.
        """
    @property
    def quaternion(self) -> typing.Any:
        """
        Where its unit quaternion (w, x, y, z) begins in its q; None where it has none.
        """
class HingeKind:
    """
    A kind of hinge: its subhinges, one after the other; a custom one has any.
    """
    def __repr__(self) -> str:
        ...
    @property
    def axes(self) -> int:
        """
        How many axes it is given.
        """
    @property
    def name(self) -> str:
        ...
    @property
    def nv(self) -> int:
        """
        Degrees of freedom.
        """
    @property
    def subhinges(self) -> tuple:
        """
        Names of their kinds.
        """
class MultibodyOperators(SkoSource):
    """
    The operators' source of a multibody model.
    """
    def __reduce__(self) -> tuple:
        ...
class GroupedOperators(SkoSource):
    """
    The source of a multibody model's operators with its bodies in groups.
    """
class EmbeddedOperators(SkoSource):
    """
    The source of a multibody model's operators with its loops embedded.
    """
    @property
    def dependent(self) -> list[list[int]]:
        """
        Of each set of loops that hang together: the tree's coordinates that follow from the others.
        """
    @property
    def grouped(self) -> GroupedOperators:
        """
        The same groups of bodies, nothing embedded.
        """
    @property
    def independent(self) -> list[int]:
        """
        The tree's coordinate of each of Θ.
        """
    @property
    def rows(self) -> list[list[int]]:
        """
        Of each set: the rows of loops that these are solved from.
        """
class MatrixTree(SkoSource):
    """
    A tree whose blocks E, H, M, J are given as matrices of any size.
    """
    def __init__(self, parents: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], sizes: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], dof: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], E: collections.abc.Sequence[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]], H: collections.abc.Sequence[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]], M: collections.abc.Sequence[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]], J: collections.abc.Sequence[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]], names: collections.abc.Sequence[str], name: str) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
class SymbolDefinition:
    """
    What is said of a letter without numbers: names, spaces, what it is of.
    """
    def __repr__(self) -> str:
        ...
    @property
    def codomain(self) -> str:
        ...
    @property
    def domain(self) -> str:
        ...
    @property
    def is_symmetric(self) -> bool:
        ...
    @property
    def is_vector(self) -> bool:
        """
        Whether it is a vector that the model provides.
        """
    @property
    def latex(self) -> str:
        ...
    @property
    def meaning(self) -> str:
        ...
    @property
    def name(self) -> str:
        """
        In ASCII: the attribute of an operator set.
        """
    @property
    def takes(self) -> str:
        """
        What it is called with: "nothing", "nodes", "coordinate"; what derivatives bring up: "selection", "inertia", "direction".
        """
    @property
    def text(self) -> str:
        """
        As it is shown.
        """
class Letter:
    """
    What stands behind a symbol of an expression: which letter, whose, of which nodes or coordinate, and at which state.
    """
    @property
    def arguments(self) -> tuple:
        """
        What it is of: () for most letters, ("nodes", names...), ("coordinate", number); of what derivatives bring up ("twist", body, subhinge, component), ("subhinges", body, from, to), ("inertia", body, parameters...).
        """
    @property
    def binding(self) -> typing.Any:
        """
        The state that it is bound to; None where it is not.
        """
    @property
    def name(self) -> str:
        """
        Its ASCII name.
        """
    @property
    def source(self) -> SkoSource:
        """
        The operators that it is one of.
        """
    @property
    def text(self) -> str:
        """
        Its arguments as they are shown.
        """
class Parameter:
    """
    What diff() takes beside a coordinate: a mass property, a rotor inertia, a placement, a hinge axis.
    """
    def __reduce__(self) -> tuple:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def name(self) -> str:
        ...
class PassCounts:
    """
    What the last run of a plan executed.
    """
    def __reduce__(self) -> tuple:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def dense(self) -> int:
        ...
    @property
    def eliminations(self) -> int:
        ...
    @property
    def gathers(self) -> int:
        ...
    @property
    def kernels(self) -> int:
        ...
    @property
    def scatters(self) -> int:
        ...
    @property
    def values(self) -> int:
        ...
class Dynamics:
    def __init__(self, arg0: Multibody) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
    def energy(self, q: typing.Any, v: typing.Any, datum: typing.Any) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def forward_dynamics(self, q: typing.Any, v: typing.Any, tau: typing.Any, form: str, refine: typing.Any, residual: str, precision: str | int, on_singular: str, out: typing.Any, threads: typing.SupportsInt | typing.SupportsIndex = 1) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def inverse_dynamics(self, q: typing.Any, v: typing.Any, vdot: typing.Any, precision: str | int, out: typing.Any, threads: typing.SupportsInt | typing.SupportsIndex = 1) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def jacobian(self, frame: str, q: typing.Any, precision: str | int, out: typing.Any) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def mass_matrix(self, q: typing.Any, precision: str | int, out: typing.Any) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def mass_matrix_inverse(self, q: typing.Any, form: str, refine: typing.Any, residual: str, precision: str | int, on_singular: str, out: typing.Any) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def memory(self, form: str, precision: str | int) -> int:
        """
        Bytes that one forward dynamics works in.
        """
    def operational_space(self, inverse: bool, frames: collections.abc.Sequence[str], q: typing.Any) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        B*ΩB of these nodes or its inverse; None where kernels are not sure.
        """
    def pose(self, frame: str, q: typing.Any) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def refinement(self, q: typing.Any, v: typing.Any, tau: typing.Any, form: str, refine: typing.Any, residual: str, precision: str | int) -> tuple[numpy.typing.NDArray[numpy.float64], list[float], typing.Any]:
        ...
class PreparedHybridDynamics:
    """
    Hybrid dynamics whose options were read once.
    """
    def __call__(self, q: typing.Any, v: typing.Any, tau: typing.Any, vdot: typing.Any) -> typing.Any:
        """
        Accelerations and forces; None where an argument is not a plain array, there are other states than was said, or the model was edited since.
        """
    def __reduce__(self) -> tuple:
        ...
class HybridDynamics:
    def __call__(self, q: typing.Any, v: typing.Any, tau: typing.Any, vdot: typing.Any, form: str, refine: typing.Any, residual: str, precision: str | int, threads: typing.SupportsInt | typing.SupportsIndex) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]:
        ...
    def __init__(self, model: Multibody, names: collections.abc.Sequence[str]) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
    def prepared(self, form: str, refine: typing.Any, residual: str, precision: str | int, states: typing.SupportsInt | typing.SupportsIndex) -> PreparedHybridDynamics:
        """
        For loops, of one state (-1) or so many a call.
        """
    @property
    def prescribed(self) -> list[bool]:
        """
        Whether each coordinate is.
        """
class Sensitivities:
    def __init__(self, arg0: Multibody) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
    def coriolis_matrix(self, q: typing.Any, v: typing.Any, form: str, precision: str | int, out: typing.Any) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def forward_dynamics(self, q: typing.Any, v: typing.Any, tau: typing.Any, form: str, refine: typing.Any, residual: str, precision: str | int) -> tuple:
        ...
    def hamiltonian(self, q: typing.Any, p: typing.Any, tau: typing.Any, precision: str | int) -> tuple:
        ...
    def inertial_regressor(self, q: typing.Any, v: typing.Any, vdot: typing.Any, precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def inverse_dynamics(self, q: typing.Any, v: typing.Any, vdot: typing.Any, precision: str | int) -> tuple:
        ...
    def jacobian_derivative(self, frame: str, q: typing.Any, precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def jacobian_rate(self, frame: str, q: typing.Any, v: typing.Any, precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def kinetic_energy(self, q: typing.Any, v: typing.Any, precision: str | int) -> tuple:
        ...
    def log_determinant(self, over: str, q: typing.Any, precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def momentum(self, q: typing.Any, v: typing.Any, precision: str | int) -> tuple:
        ...
    def rotor_coriolis(self, v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], christoffel: bool) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def rotor_regressor(self, v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], vdot: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def third_order(self, christoffel: bool, q: typing.Any, precision: str | int, out: typing.Any) -> numpy.typing.NDArray[numpy.float64]:
        ...
class Curvature:
    def __init__(self, arg0: Multibody) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
    def inverse_dynamics(self, q: typing.Any, v: typing.Any, vdot: typing.Any, mu: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        """
        Second derivatives of the power of virtual velocities mu (states, m, nv): (states, m, 4, nv, nv), along q and q, q and v, q and v̇, v and v.
        """
class FrameTree:
    """
    The frames of a model, by name, and their motions relative to each other: pycraft.models.frame_tree is its face.
    """
    def __init__(self, arg0: Multibody) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
    def acceleration_at(self, frame: str, other: str, axes: str, third: str, kind: str, q: typing.Any, v: typing.Any, vdot: typing.Any, t: typing.Any, precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def add(self, name: str, on: str, rotation: typing.Any, position: typing.Any, motion: typing.Any) -> None:
        ...
    def attach(self, name: str, on: str) -> None:
        ...
    def carrier(self, name: str) -> str:
        """
        The name of what a frame stands on, empty for the base.
        """
    def counts(self) -> typing.Annotated[list[int], "FixedSize(4)"]:
        """
        How many poses, velocities and accelerations of steps were computed at the present state, and how many motions of pairs.
        """
    def is_loose(self, name: str) -> bool:
        ...
    def jacobian(self, frame: str, other: str, axes: str, third: str, coordinates: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex] | None, q: typing.Any, v: typing.Any, t: typing.Any, precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        """
        The Jacobian, or where v is given its time derivative.
        """
    def loose_names(self) -> list[str]:
        ...
    def motion(self, frame: str, other: str, axes: str, third: str, acceleration: typing.Any) -> numpy.typing.NDArray[numpy.float64]:
        """
        The velocity, or the 'spatial' or 'classical' acceleration, at the present state.
        """
    def number(self, name: str) -> int:
        """
        -1 the base, then bodies, then nodes; below -1 loose frames. ModelError with the nearest name.
        """
    def on(self, name: str) -> str:
        """
        The name of what a loose frame was put on, whether it is there or not.
        """
    def place(self, name: str, rotation: typing.Any, position: typing.Any) -> None:
        ...
    def placement(self, name: str) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def pose(self, frame: str, other: str) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def pose_at(self, frame: str, other: str, q: typing.Any, t: typing.Any, precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def remove(self, name: str) -> None:
        ...
    def set_motion(self, name: str, motion: typing.Any) -> None:
        ...
    def velocity_at(self, frame: str, other: str, axes: str, third: str, q: typing.Any, v: typing.Any, t: typing.Any, precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @property
    def accelerations(self) -> numpy.typing.NDArray[numpy.float64]:
        ...
    @accelerations.setter
    def accelerations(self, arg1: typing.Any) -> None:
        ...
    @property
    def time(self) -> float:
        ...
    @time.setter
    def time(self, arg1: typing.Any) -> None:
        ...
class Centroidal:
    """
    Centre of mass of one model and what is about it.
    """
    def __init__(self, arg0: Multibody) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
    def columns(self, q: typing.Any, v: typing.Any, precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        """
        The centroidal momentum matrix, its rate, and the momentum's derivative, (6, nv) each.
        """
    def sums(self, q: typing.Any, v: typing.Any, precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        """
        Centre of mass (3), its velocity (3), inertia about it (9), momentum about it (6).
        """
class Methods:
    """
    Forward dynamics of one model by 'cholesky', 'ldl', 'conjugate-gradients', 'inverse' or 'divide-and-conquer'.
    """
    def __init__(self, arg0: Multibody) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
    def conjugate_gradients(self, q: typing.Any, v: typing.Any, tau: typing.Any, precision: str | int) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]:
        """
        (accelerations, iterations, relative residuals), each per state.
        """
    def forward_dynamics(self, method: str, q: typing.Any, v: typing.Any, tau: typing.Any, precision: str | int, out: typing.Any, threads: typing.SupportsInt | typing.SupportsIndex = 1) -> numpy.typing.NDArray[numpy.float64]:
        """
        Accelerations (nv,) or (B, nv).
        """
    def memory(self, method: str, precision: str | int) -> int:
        """
        Bytes that a method reads and writes at one evaluation.
        """
class Integration:
    """
    Rates of configurations and trajectories of one model.
    """
    def __init__(self, arg0: Multibody) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
    def configuration_rate(self, q: typing.Any, v: typing.Any, precision: str | int, out: typing.Any) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def trajectory(self, q: typing.Any, v: typing.Any, times: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], tau: typing.Any, damping: typing.Any, integrator: str, rtol: typing.SupportsFloat | typing.SupportsIndex, atol: typing.SupportsFloat | typing.SupportsIndex, step: typing.SupportsFloat | typing.SupportsIndex, normalise: bool, precision: str | int, form: str, refine: typing.Any, foreign: typing.Any = None, right_hand_side: typing.Any = None, stiff: typing.Any = None) -> dict:
        ...
class FunctionOfTime:
    """
    Numbers as a function of time, with two derivatives.
    """
    def __call__(self, t: typing.SupportsFloat | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float64]:
        """
        (3, size): values, rates and second derivatives.
        """
    @property
    def size(self) -> int:
        ...
class Effect:
    """
    An effect as the core has it; pycraft.effects makes them.
    """
    @property
    def coordinates(self) -> list[int]:
        ...
    @property
    def kind(self) -> str:
        ...
    @property
    def potential(self) -> bool:
        """
        Whether it has a potential energy.
        """
    @property
    def work(self) -> bool:
        """
        Whether some of its forces have none.
        """
class LoopSet:
    """
    The loops of a model, by name, and their rows at given states: pycraft.models.loop_set is its face.
    """
    def __init__(self, arg0: Multibody) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
    def accelerations(self, q: typing.Any, v: typing.Any, tau: typing.Any, names: collections.abc.Sequence[str], in_world: bool, wrenches: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], form: str, refine: typing.Any, residual: str, precision: str | int, alpha: typing.SupportsFloat | typing.SupportsIndex, beta: typing.SupportsFloat | typing.SupportsIndex) -> tuple:
        """
        v̇, λ, forces of loops on b and on a, rank.
        """
    def add_coupling(self, name: str, coordinates: collections.abc.Sequence[tuple[str, typing.SupportsInt | typing.SupportsIndex, collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]]], constant: typing.Any, function: typing.Any) -> None:
        ...
    def add_curve(self, name: str, a: str, b: str, coefficients: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], closed: bool) -> None:
        """
        A point on a curve of polynomials, c and m a power (cpp/model/curve.h).
        """
    def add_hinge(self, name: str, a: str, b: str, hinge: str, axes: collections.abc.Sequence[typing.Any], point: typing.Any, pitch: typing.Any, subhinges: typing.Any, rotation: typing.Any, position: typing.Any) -> None:
        ...
    def add_pair(self, name: str, a: str, b: str, kind: str, number: typing.Any, quadric: typing.Any) -> None:
        ...
    def bias(self, q: typing.Any, v: typing.Any, precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def derivatives(self, q: typing.Any, v: typing.Any, vdot: typing.Any, multipliers: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        """
        One under the other ∂(Qv)/∂q, ∂(Q v̇ + Q̇v)/∂q and ∂(Q̇v)/∂v, a row each, and ∂(Q*λ)/∂q.
        """
    def effect(self, names: collections.abc.Sequence[str], alpha: typing.SupportsFloat | typing.SupportsIndex, beta: typing.SupportsFloat | typing.SupportsIndex, embedded: bool) -> Effect:
        """
        What keeps these loops in a scene, all without names.
        """
    def embedded_accelerations(self, q: typing.Any, v: typing.Any, tau: typing.Any, names: collections.abc.Sequence[str], in_world: bool, wrenches: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], independent: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], refine: typing.Any, precision: str | int) -> tuple:
        """
        The same by independent coordinates, given by number or, without any, chosen at each state.
        """
    def ends(self, operators: SkoSource) -> list[str]:
        """
        The bodies and nodes that A is of.
        """
    def first_rows(self) -> list[int]:
        """
        Where each loop's rows begin, and the number of all.
        """
    def jacobian(self, q: typing.Any, precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def kind(self, name: str) -> str:
        ...
    def names(self) -> list[str]:
        """
        In order of declaration.
        """
    def operators(self, base: MultibodyOperators) -> SkoSource:
        """
        The source of rows as operators, Q and A by body: pycraft/operators/loop_letters.py.
        """
    def penalty(self, names: collections.abc.Sequence[str], frequency: typing.SupportsFloat | typing.SupportsIndex, damping_ratio: typing.SupportsFloat | typing.SupportsIndex) -> Effect:
        """
        What holds these loops in a scene by springs and dampers, all without names.
        """
    def rates(self, q: typing.Any, v: typing.Any, precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def remove(self, name: str) -> None:
        ...
    def residual(self, q: typing.Any, precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def rows(self) -> tuple[list[str], list[bool]]:
        """
        Names of all rows, and which are of positions.
        """
    def sizes(self, q: typing.Any, precision: str | int) -> numpy.typing.NDArray[numpy.float64]:
        ...
    def springs(self, names: collections.abc.Sequence[str], frequency: typing.SupportsFloat | typing.SupportsIndex, damping_ratio: typing.SupportsFloat | typing.SupportsIndex) -> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]:
        """
        Stiffness and damping of the rows of such an effect that is alone.
        """
    def tape(self, q: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], v: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], tau: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], most: typing.SupportsInt | typing.SupportsIndex) -> tuple:
        """
        What accelerations on the loops are, operation by operation, at states that are decided as this one (tapes.h).
        """
    def velocities(self, q: typing.Any, v: typing.Any, impulse: typing.Any, form: str, precision: str | int) -> tuple:
        """
        v⁺, impulses λ, impulses of loops on b and on a, rank.
        """
    @property
    def edits(self) -> int:
        """
        Another number after every change of the set.
        """
class SceneEffects:
    """
    A model and the effects that act on it, by name, on or off; pycraft.Scene is its face.
    """
    def __init__(self, model: Multibody) -> None:
        ...
    def add(self, name: str, effect: Effect, on: bool) -> str:
        ...
    def remove(self, name: str) -> None:
        ...
    def set_on(self, name: str, on: bool) -> None:
        ...
class SceneCalls:
    """
    What is computed of a scene as it was when this was made.
    """
    def __init__(self, scene: SceneEffects, form: str, refine: typing.Any, residual: str, precision: str | int) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
    def along(self, t: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], own: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> dict:
        ...
    def close(self, q: typing.Any, v: typing.Any, t: typing.SupportsFloat | typing.SupportsIndex) -> tuple:
        """
        q and v on the loops that are kept, v by an impulse of the loops.
        """
    def evaluate(self, q: typing.Any, v: typing.Any, t: typing.SupportsFloat | typing.SupportsIndex, own: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], step: typing.SupportsFloat | typing.SupportsIndex) -> dict:
        ...
    def plan(self, list: str) -> list:
        """
        (name, what, because) of the passes of a 'motion', at 'rest', or with 'works'.
        """
    @property
    def states(self) -> list[int]:
        """
        How many states of its own each effect has that is on, what it holds among them.
        """
    @property
    def workers(self) -> list[int]:
        """
        Numbers of the effects whose works are counted, among those that are on.
        """
class RunRecord:
    """
    What a run gave out, also of one that an error or an interrupt ended.
    """
    def __init__(self, keeps_steps: bool) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
    def raise_error(self) -> None:
        """
        What ended one run among several is raised.
        """
    @property
    def checkpoint(self) -> dict:
        ...
    @property
    def ended_by(self) -> int:
        """
        The event that ended it, -1: none.
        """
    @property
    def events(self) -> tuple[list[int], dict]:
        """
        Numbers of events, and the states at them.
        """
    @property
    def own_events(self) -> list[str]:
        """
        Events of the effects' own, by the effects; those that were asked for follow them.
        """
    @property
    def samples(self) -> dict:
        """
        The times asked for.
        """
    @property
    def statistics(self) -> dict:
        ...
    @property
    def steps(self) -> dict:
        """
        The ends of steps.
        """
    @property
    def stiffness(self) -> typing.Any:
        """
        What holds the steps of an explicit method, None: nothing.
        """
    @property
    def switches(self) -> list[tuple[float, int]]:
        """
        From when on which of several methods took the steps.
        """
class InterbodyForces:
    """
    Forces of hinges on the bodies that they move, with wrenches on nodes of these names.
    """
    def __init__(self, arg0: Multibody) -> None:
        ...
    def __reduce__(self) -> tuple:
        ...
    def after(self, q: typing.Any, v: typing.Any, vdot: typing.Any, names: collections.abc.Sequence[str], in_world: bool, wrenches: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], reaction: bool, precision: str | int) -> tuple:
        """
        f, X_WB, T and v̇, of accelerations.
        """
    def derivatives(self, q: typing.Any, v: typing.Any, vdot: typing.Any, names: collections.abc.Sequence[str], in_world: bool, wrenches: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], along_q: bool) -> tuple:
        """
        Of f and of T, along q, v and v̇, or along q alone.
        """
    def under(self, q: typing.Any, v: typing.Any, tau: typing.Any, names: collections.abc.Sequence[str], in_world: bool, wrenches: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], reaction: bool, form: str, refine: typing.Any, residual: str, precision: str | int) -> tuple:
        """
        f, X_WB, T and v̇, of generalized forces.
        """
class Theorem:
    """
    A theorem as data: both sides as expressions, its hypotheses, its source.
    """
    def __reduce__(self) -> tuple:
        ...
    def __repr__(self) -> str:
        ...
    def _repr_html_(self) -> typing.Any:
        ...
    def unmet(self, arg0: SkoSource) -> list[str]:
        """
        Hypotheses that the model does not meet.
        """
    @property
    def at_most(self) -> bool:
        ...
    @property
    def group(self) -> str:
        ...
    @property
    def hypotheses(self) -> list[str]:
        ...
    @property
    def latex(self) -> str:
        ...
    @property
    def lhs(self) -> typing.Any:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def on_one_path(self) -> bool:
        ...
    @property
    def rhs(self) -> typing.Any:
        ...
    @property
    def source(self) -> str:
        ...
    @property
    def text(self) -> str:
        ...
    @property
    def use(self) -> str:
        ...
    @property
    def waiting(self) -> str:
        ...
def _bind(operands: collections.abc.Sequence[Operator], q: typing.Any, v: typing.Any, form: str = 'fast', refine: typing.Any = 0, residual: str = 'same', precision: str | int = 'double', threads: typing.Any = 1) -> Binding:
    ...
def _binding(arg0: Operator) -> Binding:
    ...
def _binding_from_parts(arg0: typing.SupportsInt | typing.SupportsIndex, arg1: typing.SupportsInt | typing.SupportsIndex, arg2: typing.SupportsInt | typing.SupportsIndex, arg3: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], arg4: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], arg5: str | int, arg6: str, arg7: typing.SupportsInt | typing.SupportsIndex, arg8: typing.SupportsInt | typing.SupportsIndex, arg9: typing.SupportsInt | typing.SupportsIndex) -> Binding:
    ...
def _derived_operators(arg0: SkoSource, arg1: typing.Any) -> SkoSource:
    ...
@typing.overload
def _diff_on_loops(operand: Operator, of: EmbeddedOperators, coordinate: typing.SupportsInt | typing.SupportsIndex) -> Operator:
    """
    The derivative along an independent coordinate of embedded loops, also of letters of the tree alone.
    """
@typing.overload
def _diff_on_loops(operand: Scalar, of: EmbeddedOperators, coordinate: typing.SupportsInt | typing.SupportsIndex) -> Scalar:
    """
    The derivative along an independent coordinate of embedded loops, also of letters of the tree alone.
    """
def _embedded(base: MultibodyOperators, loops: LoopSet, sets: collections.abc.Sequence[tuple[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]]]) -> EmbeddedOperators:
    """
    Of each set: bodies, rows of loops, dependent coordinates, by number.
    """
def _embedded_again(arg0: typing.Any, arg1: typing.Any) -> typing.Any:
    """
    As it was pickled.
    """
def _function(arg0: SkoSource, arg1: str, arg2: Binding, arg3: Operator) -> Operator:
    ...
def _grouped(base: MultibodyOperators, groups: collections.abc.Sequence[collections.abc.Sequence[str]]) -> GroupedOperators:
    ...
def _inertia_parameter(arg0: MultibodyOperators, arg1: typing.SupportsInt | typing.SupportsIndex, arg2: typing.SupportsInt | typing.SupportsIndex, arg3: str) -> Parameter:
    ...
def _joined(mass: tuple, name: str, pose: tuple, welded: tuple, welded_name: str) -> tuple:
    """
    Mass properties of two bodies welded together, in the first one's frame.
    """
def _leaf_from_parts(arg0: str, arg1: typing.Any) -> Operator:
    ...
def _loop_operators_again(arg0: typing.Any) -> typing.Any:
    """
    As it was pickled.
    """
def _make(arg0: str, arg1: collections.abc.Sequence[Operator], arg2: float | fractions.Fraction) -> Operator:
    ...
def _moved(operands: collections.abc.Sequence[Operator]) -> SkoSource:
    """
    Whose coordinates diff() is along: embedded loops or a multibody model; None where nothing moves.
    """
def _parted(mass: tuple, name: str, pose: tuple, welded: tuple, welded_name: str) -> tuple:
    """
    The first body's mass properties without those of the one welded to it.
    """
def _rotor_parameter(arg0: MultibodyOperators, arg1: typing.SupportsInt | typing.SupportsIndex, arg2: str) -> Parameter:
    ...
def _rows_by_ends(loops: SkoSource) -> Operator | None:
    """
    A B* φ* H*, which Q of a source of rows is where all loops are of two ends; None where they are not.
    """
def _scalar_from_parts(arg0: typing.SupportsInt | typing.SupportsIndex, arg1: float | fractions.Fraction, arg2: typing.Any, arg3: collections.abc.Sequence[Scalar]) -> Scalar:
    ...
def _some_coordinates(base: SkoSource, kept: collections.abc.Sequence[bool]) -> SkoSource:
    ...
def _space_from_parts(arg0: tuple) -> Space:
    ...
def _theorem_from_parts(arg0: str, arg1: str, arg2: typing.Any, arg3: typing.Any, arg4: typing.SupportsInt | typing.SupportsIndex, arg5: str, arg6: typing.SupportsInt | typing.SupportsIndex, arg7: bool, arg8: bool, arg9: str, arg10: str, arg11: str) -> Theorem:
    ...
def _theorems_of_rows(loops: SkoSource) -> list[Theorem]:
    """
    What holds of a source of rows and of the tree that they are declared on.
    """
def _twist_parameter(arg0: MultibodyOperators, arg1: collections.abc.Sequence[tuple[typing.SupportsInt | typing.SupportsIndex, typing.SupportsInt | typing.SupportsIndex, collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]]], arg2: str) -> Parameter:
    ...
def _whole_rows(loops: SkoSource, letter: str) -> Operator:
    """
    Q or A of a source of rows, to R^rows.
    """
def alone(calls: SceneCalls, integrator: str) -> str:
    """
    Why runs cannot be side by side, in words; empty: they can.
    """
def blockdiag(operator: Operator) -> Operator:
    """
    The operator's diagonal blocks, body by body, zero elsewhere.
    """
def bushing_effect(model: Multibody, node_a: str, node_b: str, stiffness: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], damping: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], rotation: typing.Any, position: typing.Any) -> Effect:
    ...
def check_pairing(calls: SceneCalls, integrator: str, foreign: bool, implicit: bool) -> None:
    """
    EvaluationError where they do not fit each other.
    """
def checked_refinement(refine: typing.Any, residual: str, precision: str | int) -> typing.Any:
    """
    The number of corrections, or 'auto'; EvaluationError for anything else.
    """
def compiled_call(behind: typing.Any, library: str, function: str, widths: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], lengths: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], work: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
    """
    The callable of a built library; `behind` is called where arguments are not contiguous float64 arrays, or results in doubt.
    """
def constant(array: typing.Any, domain: typing.Any, codomain: typing.Any, name: str = 'C') -> Operator:
    """
    An array as an operator from `domain` to `codomain` (spaces, or a size n for R^n): a matrix, one diagonal, or a list of one block per
    body. What is block diagonal over the bodies is kept so; what has low rank is found when a plan needs it.
    """
def constant_in_time(values: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> FunctionOfTime:
    ...
def coordinates_named(model: Multibody, names: collections.abc.Sequence[str] | None, effect: str) -> list[int]:
    """
    Numbers of the coordinates that names of hinges, coordinates or patterns mean; None: all.
    """
def coulomb_friction_effect(model: Multibody, hinges: collections.abc.Sequence[str] | None, level: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], smoothing: typing.SupportsFloat | typing.SupportsIndex) -> Effect:
    ...
def damping_effect(model: Multibody, hinges: collections.abc.Sequence[str] | None, coefficient: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> Effect:
    ...
def direct_call(function: collections.abc.Callable, made: type | None = None) -> typing.Any:
    """
    The direct call of this name: its plain case in the core, everything else by the function. made: the tuple of its three results.
    """
def direct_calls() -> dict[str, tuple[tuple[str, ...], tuple[str, ...]]]:
    """
    By name: the arrays of each direct call, and the options that it is prepared with.
    """
def epsilons() -> dict:
    """
    Epsilon of each precision by name.
    """
def equal_by_theorems(a: Operator, b: Operator) -> bool:
    """
    Whether the rewriting theorems bring both to the same normal form.
    """
def euclidean(dimension: typing.Any) -> Space:
    """
    R^n, a space of a user's own: self-dual, cut into no bodies.
    """
def external(product: typing.Any, transposed: typing.Any, domain: Space, codomain: Space, name: str) -> Operator:
    ...
def fixman_effect(model: Multibody, kT: typing.SupportsFloat | typing.SupportsIndex) -> Effect:
    ...
def fluid_drag_effect(model: Multibody, density: typing.SupportsFloat | typing.SupportsIndex, viscosity: typing.SupportsFloat | typing.SupportsIndex, wind: typing.Any, nodes: collections.abc.Sequence[str], placements: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64]], sizes: collections.abc.Sequence[typing.Any]) -> Effect:
    ...
def forms() -> list[str]:
    """
    The forms of the articulated-inertia sweep.
    """
def frame_tape(model: Multibody, call: str, frame: str, most: typing.SupportsInt | typing.SupportsIndex) -> tuple:
    """
    The pose (4, 4) or the Jacobian (6, nv) of a body or node, operation by operation.
    """
def gravity_compensation_effect(model: Multibody, bodies: collections.abc.Sequence[str] | None, share: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], points: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], g: typing.Any) -> Effect:
    ...
def gravity_effect(g: typing.Any) -> Effect:
    ...
def gravity_gradient_effect(model: Multibody, mu: typing.SupportsFloat | typing.SupportsIndex, position: typing.Any, bodies: collections.abc.Sequence[str] | None) -> Effect:
    ...
def harmonic(amplitude: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], frequency: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], phase: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], offset: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> FunctionOfTime:
    ...
def held_states(calls: SceneCalls) -> list[int]:
    """
    Which of the effects' own states controllers hold from one sample to the next.
    """
def hermite_between(model: Multibody, t: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], after: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], before: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], times: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], at: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> tuple:
    ...
def identity(space: typing.Any = None) -> Operator:
    """
    I; without a space it takes that of the operator it is combined with.
    """
def implicit_damping_effect(model: Multibody, hinges: collections.abc.Sequence[str] | None, coefficient: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> Effect:
    ...
def implicit_spring_effect(model: Multibody, hinges: collections.abc.Sequence[str] | None, stiffness: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], rest: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> Effect:
    ...
def instruction_set() -> str:
    """
    The instruction set whose kernels direct calls run: the widest that this machine has, or the one that the environment variable PYCRAFT_ISA names.
    """
def instruction_sets() -> list[str]:
    """
    Those that were built and that this machine has, from narrow to wide.
    """
def integrator_table() -> list:
    """
    What the core's integrators are.
    """
def integrators() -> list[str]:
    """
    The names of the core's integrators.
    """
def kernel_headers() -> dict:
    """
    The text of the headers that compiled source begins with.
    """
def kernel_tape(model: Multibody, call: str) -> typing.Any:
    """
    What the kernel of a direct call does for this model, operation by operation; None where no kernel knows the model's hinges.
    """
def langevin_effect(model: Multibody, hinges: collections.abc.Sequence[str] | None, kT: typing.SupportsFloat | typing.SupportsIndex, friction: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], period: typing.SupportsFloat | typing.SupportsIndex, seed: typing.SupportsInt | typing.SupportsIndex) -> Effect:
    ...
def limits_effect(model: Multibody, hinges: collections.abc.Sequence[str] | None, stiffness: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], dissipation: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], lower: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], upper: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> Effect:
    ...
def methods() -> list[str]:
    """
    The methods of forward dynamics that Methods has.
    """
def motor_effect(model: Multibody, hinges: collections.abc.Sequence[str] | None, command: FunctionOfTime, stall_torque: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], no_load_speed: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], gear_ratio: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], rotor_inertia: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], effort_limit: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], speed_limit: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], speed_band: typing.SupportsFloat | typing.SupportsIndex) -> Effect:
    ...
def node_damper_effect(model: Multibody, node_a: str, node_b: str, coefficient: typing.SupportsFloat | typing.SupportsIndex) -> Effect:
    ...
def node_spring_effect(model: Multibody, node_a: str, node_b: str, stiffness: typing.SupportsFloat | typing.SupportsIndex, length: typing.SupportsFloat | typing.SupportsIndex) -> Effect:
    ...
def nose_hoover_effect(model: Multibody, hinges: collections.abc.Sequence[str] | None, kT: typing.SupportsFloat | typing.SupportsIndex, time_constant: typing.SupportsFloat | typing.SupportsIndex, chain: typing.SupportsInt | typing.SupportsIndex) -> Effect:
    ...
def numbers_in_q(model: Multibody, coordinates: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> int:
    """
    How many numbers these coordinates' subhinges have in q.
    """
def operators_of(model: Multibody) -> MultibodyOperators:
    ...
def pack_width() -> int:
    """
    States in a pack, in double precision.
    """
def piecewise_polynomial(breaks: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], coefficients: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], size: typing.SupportsInt | typing.SupportsIndex) -> FunctionOfTime:
    ...
def point_mass_gravity_effect(model: Multibody, mu: typing.SupportsFloat | typing.SupportsIndex, position: typing.Any, bodies: collections.abc.Sequence[str] | None) -> Effect:
    ...
def precisions() -> list[str | int]:
    """
    The precisions, from narrow to wide.
    """
def prepared_call(function: typing.Any, name: str, dynamics: typing.Any, batch: typing.SupportsInt | typing.SupportsIndex | None, made: type | None, *, frame: str = '', form: typing.Any = None, refine: typing.Any = 0, residual: str = 'same', precision: str | int = 'double', on_singular: str = 'raise') -> typing.Any:
    """
    A direct call of one model with its options, as `prepare` gives it. made: the tuple of three results.
    """
def prescribed_by(model: Multibody, names: collections.abc.Sequence[str], option: str = 'prescribed') -> list[bool]:
    """
    Whether each coordinate is prescribed, by names of hinges, coordinates or patterns; ModelError for one that is named twice.
    """
def prescribed_effect(model: Multibody, hinges: collections.abc.Sequence[str] | None, motion: FunctionOfTime) -> Effect:
    ...
def python_effect(model: Multibody, kind: str, coordinates: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], forces: typing.Any, rates: typing.Any, states: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], sample: typing.Any, period: typing.SupportsFloat | typing.SupportsIndex) -> Effect:
    ...
def python_function_of_time(call: typing.Any, size: typing.SupportsInt | typing.SupportsIndex, what: str) -> FunctionOfTime:
    ...
def quadratic_damping_effect(model: Multibody, hinges: collections.abc.Sequence[str] | None, coefficient: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> Effect:
    ...
def real_array(value: typing.Any, what: str) -> numpy.typing.NDArray[numpy.float64]:
    """
    An array of doubles, or a ModelError that names `what`: complex numbers, text, dates, None and masked entries are none.
    """
def record_from(states: typing.SupportsInt | typing.SupportsIndex) -> int:
    """
    From how many states on a batch is recorded, whatever that takes; 0: as is best. Returns how it was before.
    """
def residual(a: typing.Any, b: typing.Any, vectors: collections.abc.Mapping[str, collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]] = {}, on_one_path: bool = False, at_most: bool = False) -> tuple[float, float, float]:
    """
    Largest entries of a - b, a and b: both evaluated as typed, no theorem used, the difference taken at the bound precision.
    """
def retired_integrator(name: str) -> str:
    """
    What to take in place of an integrator that there was once; empty: there was none of that name.
    """
def rotor_inertia_effect(model: Multibody, hinges: collections.abc.Sequence[str] | None, inertia: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], gear_ratio: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> Effect:
    ...
def run_scene(calls: SceneCalls, record: RunRecord, q: typing.Any, v: typing.Any, times: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], own: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], energy: bool, integrator: str, rtol: typing.SupportsFloat | typing.SupportsIndex, atol: typing.SupportsFloat | typing.SupportsIndex, step: typing.SupportsFloat | typing.SupportsIndex, max_step: typing.SupportsFloat | typing.SupportsIndex, normalise: bool, events: list, progress: typing.Any, checkpoint: typing.Any, foreign: typing.Any, stiff: typing.Any = None) -> None:
    ...
def run_scenes(calls: collections.abc.Sequence[SceneCalls], records: collections.abc.Sequence[RunRecord], q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], times: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], energy: bool, integrator: str, rtol: typing.SupportsFloat | typing.SupportsIndex, atol: typing.SupportsFloat | typing.SupportsIndex, step: typing.SupportsFloat | typing.SupportsIndex, max_step: typing.SupportsFloat | typing.SupportsIndex, normalise: bool) -> None:
    """
    Runs side by side, in packs of states; RunRecord.raise_error says what ended one.
    """
def scalar(value: float | fractions.Fraction) -> Scalar:
    ...
def scalar_tape(scalar: Scalar, most: typing.SupportsInt | typing.SupportsIndex) -> tuple:
    """
    As Plan.tape, of a scalar.
    """
def scene_at_rest(calls: SceneCalls, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], t: typing.SupportsFloat | typing.SupportsIndex, states: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> dict:
    """
    At a configuration at rest: what is left of all forces, its derivative along displacements, ℳ + J, and which coordinates are prescribed.
    """
def scene_between(calls: SceneCalls, integrator: str, t: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], states: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], work: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], times: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], at: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> dict:
    ...
def scene_curvature(calls: SceneCalls, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], t: typing.SupportsFloat | typing.SupportsIndex, own: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], vdot: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], mu: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> tuple:
    """
    Second derivatives at a state, contracted with mu (m, nv + own): of the effects' forces and rates along (displacements, v, own), (m, n, n), and of inverse dynamics as Curvature has them, (m, 4, nv, nv).
    """
def scene_interbody_forces(calls: SceneCalls, t: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], own: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], reaction: bool) -> tuple:
    """
    f in the bodies' axes and X_WB, of states along a run.
    """
def scene_linearized(calls: SceneCalls, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], t: typing.SupportsFloat | typing.SupportsIndex, states: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], between: bool = False) -> dict:
    """
    At a state, of A ż = g with z = (v, effects' own states): A, the derivatives of g along displacements and along z, ż, which coordinates are prescribed, and what is not in g, the forces of loops; q and v are on these, own the effects' states there, and implicit names effects that steps may take implicitly.
    """
def servo_effect(model: Multibody, hinges: collections.abc.Sequence[str] | None, stiffness: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], damping: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], target: FunctionOfTime, effort_limit: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], speed_limit: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], speed_band: typing.SupportsFloat | typing.SupportsIndex) -> Effect:
    ...
def spring_effect(model: Multibody, hinges: collections.abc.Sequence[str] | None, stiffness: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], rest: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> Effect:
    ...
def step_accelerations(calls: SceneCalls, t: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], states: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> tuple:
    """
    Accelerations (K, nv) with which steps begin and end at the rows of a run, by what acts in each.
    """
def step_kinds() -> list[str]:
    """
    The kinds of steps that plans are made of.
    """
def theorems(source: SkoSource) -> list[Theorem]:
    """
    Every theorem, stated on the letters of one model.
    """
def time_apply(operator: Operator, x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], seconds: typing.SupportsFloat | typing.SupportsIndex = 0.2, rules: bool = True) -> dict:
    """
    Seconds per application: minimum, median, calls.
    """
def time_by_hand(model: Multibody, what: str, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], seconds: typing.SupportsFloat | typing.SupportsIndex = 0.2) -> tuple[dict, numpy.typing.NDArray[numpy.float64]]:
    """
    Seconds per forward dynamics by the bare kernel with one effect written out by hand: minimum, median, calls; and v̇ at the first state.
    """
def time_compiled(library: str, function: str, given: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64]], results: typing.SupportsInt | typing.SupportsIndex, seconds: typing.SupportsFloat | typing.SupportsIndex = 0.2) -> dict:
    """
    Seconds per call of a compiled function over a set of states in rotation: minimum, median, calls.
    """
def time_dynamics(model: Multibody, call: str, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], seconds: typing.SupportsFloat | typing.SupportsIndex = 0.2) -> dict:
    """
    Seconds per direct call over a set of states in rotation: minimum, median, calls.
    """
def time_forward(model: Multibody, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], seconds: typing.SupportsFloat | typing.SupportsIndex = 0.2, form: str = 'fast', refine: typing.Any = 0, residual: str = 'same', precision: str | int = 'double') -> dict:
    """
    Seconds per forward dynamics over a set of states in rotation: minimum, median, calls.
    """
def time_hybrid(model: Multibody, prescribed: collections.abc.Sequence[bool], q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], seconds: typing.SupportsFloat | typing.SupportsIndex = 0.2) -> dict:
    """
    Seconds per hybrid dynamics over a set of states in rotation: minimum, median, calls.
    """
def time_method(model: Multibody, method: str, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], seconds: typing.SupportsFloat | typing.SupportsIndex = 0.2, precision: str | int = 'double') -> dict:
    """
    Seconds per forward dynamics by a method of the mass matrix: minimum, median, calls.
    """
def time_packs(model: Multibody, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], u: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], seconds: typing.SupportsFloat | typing.SupportsIndex = 0.2, form: str = 'fast', precision: str | int = 'double') -> dict:
    """
    Seconds per state of a batch in packs: minimum, median, calls.
    """
def time_passes(scene: SceneCalls, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], seconds: typing.SupportsFloat | typing.SupportsIndex = 0.2) -> list[float]:
    """
    Seconds of every pass of a scene's motion, in their order.
    """
def time_scene(scene: SceneCalls, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], v: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], seconds: typing.SupportsFloat | typing.SupportsIndex = 0.2, works: bool = False) -> dict:
    """
    Seconds per evaluation of a scene's accelerations: minimum, median, calls; with works, of the effects' powers, too.
    """
def torque_source_effect(model: Multibody, hinges: collections.abc.Sequence[str] | None, torque: FunctionOfTime, effort_limit: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], speed_limit: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], speed_band: typing.SupportsFloat | typing.SupportsIndex) -> Effect:
    ...
def unbound_sources(operands: collections.abc.Sequence[Operator]) -> list[SkoSource]:
    """
    The sources whose state `at` would bind.
    """
def vector(name: str, space: Space) -> Operator:
    """
    A named vector of a space: stands for an array that is given at the evaluation.
    """
def wider(precision: str | int) -> typing.Any:
    """
    The next wider precision, None for the widest.
    """
def wrench_effect(model: Multibody, node: str, wrench: FunctionOfTime, axes: str) -> Effect:
    ...
def zero(domain: Space, codomain: Space) -> Operator:
    """
    The zero operator.
    """
_face: dict[str, typing.Any]
float128: bool = True
hinge_kinds: dict
subhinge_kinds: dict
symbols: tuple
