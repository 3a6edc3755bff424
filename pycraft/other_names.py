"""Names of other packages and what they are called here, for errors and for docs/coming_from.md."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

PACKAGES = ("Pinocchio", "MuJoCo", "Drake", "roboticstoolbox", "Simbody")


@dataclass(frozen=True)
class Row:
    """One thing and its names: here, in each of `PACKAGES` (several separated by commas), and words that users try.

    Attributes
    ----------
    what : the thing
    here : what it is called here, as a call
    of : the class that has it: "Multibody", "Scene", "Run" or "pycraft"
    names : the names in PACKAGES, in their order; "" where there is none
    words : further names that are asked for, and belong to no package
    """

    what: str
    here: str
    of: str
    names: tuple[str, str, str, str, str]
    words: str = ""

    def asked(self) -> Iterator[str]:
        """The identifiers under which someone may look for it: the last part of each dotted name."""
        for text in (*self.names, self.words):
            for name in text.split(","):
                if last := name.strip().rpartition(".")[2].partition("(")[0]:
                    yield last


def _row(what: str, here: str, of: str, *names: str, words: str = "") -> Row:
    return Row(what, here, of, (names[0], names[1], names[2], names[3], names[4]), words)


M, S, R, P = "Multibody", "Scene", "Run", "pycraft"
ROWS = (
    # models
    _row(
        "load a file",
        'pc.load("arm.urdf")',
        P,
        "buildModelFromUrdf, buildModelFromMJCF",
        "MjModel.from_xml_path",
        "Parser.AddModels",
        "ERobot.URDF",
        "",
        words="load_urdf, load_mjcf, from_urdf, loadURDF, read, read_urdf",
    ),
    _row(
        "a model",
        'pc.Multibody("arm")',
        P,
        "Model",
        "MjModel, MjSpec",
        "MultibodyPlant",
        "ERobot, DHRobot",
        "SimbodyMatterSubsystem",
        words="Robot, RobotModel, RobotWrapper",
    ),
    _row("robots to begin with", "pc.robots.panda()", P, "example_robot_data", "", "", "models", "", words="robot, example_robots"),
    _row(
        "joints",
        "hinges",
        M,
        "joints, names",
        "jnt_type, joint",
        "GetJointByName",
        "",
        "getMobilizedBody",
        words="joint_names, njoints, num_joints",
    ),
    _row(
        "links",
        "bodies",
        M,
        "inertias, frames",
        "body, body_mass",
        "GetBodyByName",
        "links",
        "getMobilizedBody",
        words="link_names, body_names, link, nbody, num_bodies, nlinks",
    ),
    _row(
        "frames and sites",
        'add_node("tcp", body), frame("tcp")',
        M,
        "addFrame, getFrameId",
        "site",
        "AddFrame, GetFrameByName",
        "tool, ets",
        "",
        words="add_site, sites, add_frame_to",
    ),
    _row(
        "degrees of freedom",
        "nv, nq",
        M,
        "nv, nq",
        "nv, nq",
        "num_velocities, num_positions",
        "n",
        "getNumMobilities",
        words="dof, ndof, dofs, num_dofs, nu, dim",
    ),
    _row(
        "configuration at zero",
        "zero_q()",
        M,
        "neutral",
        "qpos0",
        "GetDefaultPositions",
        "qz",
        "getDefaultState",
        words="q0, home, neutral_configuration",
    ),
    _row(
        "random configuration",
        "random_state(seed=0).q",
        M,
        "randomConfiguration",
        "",
        "SetRandomContext",
        "random_q",
        "",
        words="random_configuration, rand, random_q",
    ),
    _row(
        "limits of joints",
        "hinges[name].limits",
        M,
        "lowerPositionLimit, upperPositionLimit",
        "jnt_range",
        "GetPositionLowerLimits, GetPositionUpperLimits",
        "qlim",
        "",
        words="joint_limits, q_min, q_max, lower_limits, upper_limits",
    ),
    _row(
        "present state",
        "q, v",
        M,
        "",
        "qpos, qvel",
        "GetPositions, GetVelocities",
        "q, qd",
        "getQ, getU",
        words="state, positions, velocities, dq, qdot, joint_positions",
    ),
    _row(
        "mass of all bodies", "mass()", M, "computeTotalMass", "body_subtreemass", "CalcTotalMass", "", "calcSystemMass", words="total_mass"
    ),
    _row(
        "mass properties",
        'bodies["link"].mass, .com, .inertia',
        M,
        "inertias",
        "body_inertia, body_ipos",
        "CalcSpatialInertia",
        "links[i].m, r, I",
        "getBodyMassProperties",
        words="masses",
    ),
    _row(
        "rotor inertia",
        "hinges[name].rotor_inertia",
        M,
        "rotorInertia, armature",
        "dof_armature",
        "rotor_inertia",
        "Jm",
        "",
        words="reflected_inertia",
    ),
    # kinematics
    _row(
        "pose of a body or node",
        "pose(name, q)",
        M,
        "forwardKinematics, framesForwardKinematics, updateFramePlacements, oMf, oMi",
        "mj_kinematics, xpos, xmat",
        "EvalBodyPoseInWorld, CalcRelativeTransform",
        "fkine",
        "getBodyTransform, findStationLocationInGround",
        words="fk, forward_kinematics, transform, get_pose, body_pose, link_pose, position",
    ),
    _row(
        "Jacobian",
        "jacobian(name, q)",
        M,
        "computeJointJacobian, computeFrameJacobian, getFrameJacobian, computeJointJacobians",
        "mj_jac, mj_jacBody, mj_jacSite",
        "CalcJacobianSpatialVelocity",
        "jacobe",
        "calcFrameJacobian",
        words="jac, get_jacobian, J",
    ),
    _row(
        "Jacobian in the world's axes",
        'jacobian(name, q, axes="world")',
        M,
        "LOCAL_WORLD_ALIGNED",
        "mj_jac",
        "CalcJacobianSpatialVelocity",
        "jacob0",
        "",
        words="world_jacobian, geometric_jacobian",
    ),
    _row(
        "time derivative of the Jacobian",
        "jacobian_dot(name, q, v)",
        M,
        "computeJointJacobiansTimeVariation, getFrameJacobianTimeVariation",
        "mj_jacDot",
        "CalcBiasSpatialAcceleration",
        "jacob0_dot",
        "calcBiasForFrameJacobian",
        words="jdot, Jdot",
    ),
    _row(
        "velocity of a body",
        "frame(name).at(q, v).velocity",
        M,
        "getFrameVelocity, getVelocity",
        "mj_objectVelocity, cvel",
        "EvalBodySpatialVelocityInWorld",
        "",
        "getBodyVelocity",
        words="twist, body_velocity",
    ),
    _row(
        "centre of mass",
        "centre_of_mass(q)",
        M,
        "centerOfMass",
        "subtree_com",
        "CalcCenterOfMassPositionInWorld",
        "",
        "calcSystemMassCenterLocationInGround",
        words="com, center_of_mass, CoM",
    ),
    _row(
        "Jacobian of the centre of mass",
        "centre_of_mass_jacobian(q)",
        M,
        "jacobianCenterOfMass",
        "mj_jacSubtreeCom",
        "CalcJacobianCenterOfMassTranslationalVelocity",
        "",
        "",
        words="com_jacobian, Jcom",
    ),
    _row(
        "centroidal momentum",
        "centroidal_momentum(q)",
        M,
        "computeCentroidalMomentum, ccrba, computeCentroidalMap",
        "subtree_angmom",
        "CalcSpatialMomentumInWorldAboutPoint",
        "",
        "calcSystemCentralMomentum",
        words="centroidal, cmm",
    ),
    _row(
        "inverse kinematics",
        "solve_ik(name, pose)",
        M,
        "",
        "",
        "InverseKinematics",
        "ikine_LM, ik_LM",
        "Assembler",
        words="ik, inverse_kinematics, ikine",
    ),
    _row(
        "step along a velocity",
        "integrate(q, dv)",
        M,
        "integrate",
        "mj_integratePos",
        "MapVelocityToQDot",
        "",
        "multiplyByN",
        words="integrate_configuration, retract",
    ),
    _row(
        "difference of configurations",
        "difference(q0, q1)",
        M,
        "difference",
        "mj_differentiatePos",
        "MapQDotToVelocity",
        "",
        "multiplyByNInv",
        words="subtract",
    ),
    # dynamics
    _row(
        "forward dynamics",
        "forward_dynamics(q, v, tau)",
        M,
        "aba",
        "mj_forward, qacc",
        "EvalTimeDerivatives",
        "accel",
        "calcAcceleration",
        words="fd, articulated_body_algorithm, forward_dynamics_aba",
    ),
    _row(
        "inverse dynamics",
        "inverse_dynamics(q, v, vdot)",
        M,
        "rnea",
        "mj_inverse, qfrc_inverse",
        "CalcInverseDynamics",
        "rne",
        "calcResidualForceIgnoringConstraints",
        words="id, newton_euler, recursive_newton_euler",
    ),
    _row(
        "mass matrix",
        "mass_matrix(q)",
        M,
        "crba",
        "mj_fullM, mj_crb",
        "CalcMassMatrix, CalcMassMatrixViaInverseDynamics",
        "inertia",
        "calcM",
        words="joint_space_inertia, inertia_matrix, get_mass_matrix, MassMatrix, massMatrix",
    ),
    _row(
        "inverse of the mass matrix",
        "mass_matrix_inverse(q)",
        M,
        "computeMinverse",
        "mj_solveM",
        "",
        "",
        "calcMInv",
        words="minverse, inverse_mass_matrix",
    ),
    _row(
        "bias forces",
        "bias_forces(q, v)",
        M,
        "nonLinearEffects, nle",
        "qfrc_bias",
        "CalcBiasTerm",
        "",
        "calcResidualForce",
        words="nonlinear_effects, bias, h",
    ),
    _row(
        "gravity forces",
        "bias_forces(q)",
        M,
        "computeGeneralizedGravity",
        "qfrc_bias",
        "CalcGravityGeneralizedForces",
        "gravload",
        "",
        words="gravity_forces, gravity_compensation, gravity_vector",
    ),
    _row("Coriolis matrix", "coriolis_matrix(q, v)", M, "computeCoriolisMatrix", "", "", "coriolis", "", words="coriolis_forces, C"),
    _row(
        "operational-space inertia",
        "operational_space_inertia(name, q)",
        M,
        "",
        "",
        "",
        "inertia_x",
        "",
        words="lambda_matrix, task_inertia",
    ),
    _row(
        "derivatives of forward dynamics",
        "forward_dynamics_derivatives(q, v, tau)",
        M,
        "computeABADerivatives",
        "mjd_transitionFD",
        "ToAutoDiffXd",
        "",
        "",
        words="aba_derivatives, fd_derivatives",
    ),
    _row(
        "derivatives of inverse dynamics",
        "inverse_dynamics_derivatives(q, v, vdot)",
        M,
        "computeRNEADerivatives",
        "mjd_inverseFD",
        "ToAutoDiffXd",
        "",
        "",
        words="rnea_derivatives, id_derivatives",
    ),
    _row(
        "kinetic energy",
        "kinetic_energy(q, v)",
        M,
        "computeKineticEnergy",
        "mj_energyVel",
        "CalcKineticEnergy",
        "",
        "calcKineticEnergy",
        words="ke",
    ),
    _row(
        "potential energy of gravity",
        "potential_energy(q)",
        M,
        "computePotentialEnergy",
        "mj_energyPos",
        "CalcPotentialEnergy",
        "",
        "calcPotentialEnergy",
        words="pe",
    ),
    _row(
        "regressor", "inertial_regressor(q, v, vdot)", M, "computeJointTorqueRegressor", "", "", "", "", words="regressor, base_parameters"
    ),
    _row(
        "dynamics with loops",
        "constrained_dynamics(q, v, tau)",
        M,
        "constraintDynamics, initConstraintDynamics",
        "mj_fwdConstraint",
        "",
        "",
        "",
        words="constraint_dynamics, kkt",
    ),
    _row(
        "loops",
        "add_loop(b, a, hinge=...)",
        M,
        "RigidConstraintModel",
        "equality, eq_type",
        "AddDistanceConstraint, AddWeldConstraint",
        "",
        "Constraint",
        words="add_constraint, constraints, equalities",
    ),
    _row("linearization", "linearize()", M, "", "mjd_transitionFD", "Linearize", "", "", words="linearise, state_space"),
    # scenes and runs
    _row(
        "a simulation",
        "pc.Scene(model).add(effects).simulate(T)",
        P,
        "",
        "mj_step",
        "Simulator",
        "fdyn",
        "TimeStepper, Integrator",
        words="simulate, Simulation, Simulator, World",
    ),
    _row("simulate", "simulate(T)", S, "", "mj_step", "AdvanceTo", "fdyn", "stepTo", words="run, step, integrate, advance, play, solve"),
    _row(
        "gravity",
        "add(pc.effects.Gravity())",
        S,
        "model.gravity",
        "opt.gravity",
        "mutable_gravity_field",
        "gravity",
        "Gravity",
        words="set_gravity, add_gravity",
    ),
    _row(
        "forces",
        "add(pc.effects.TorqueSource(...))",
        S,
        "",
        "ctrl, qfrc_applied, xfrc_applied",
        "AddForceElement, get_actuation_input_port",
        "",
        "Force",
        words="apply_force, add_force, actuators, set_torque",
    ),
    _row(
        "joint damping",
        "add(pc.effects.Damping(0.1))",
        S,
        "damping",
        "dof_damping",
        "damping",
        "B",
        "MobilityLinearDamper",
        words="add_damping",
    ),
    _row(
        "joint limits",
        "add(pc.effects.Limits())",
        S,
        "",
        "jnt_limited",
        "set_position_limits",
        "",
        "MobilityLinearStop",
        words="add_limits, stops",
    ),
    _row(
        "viewer",
        "view()",
        S,
        "MeshcatVisualizer",
        "viewer.launch",
        "MeshcatVisualizer",
        "plot, teach",
        "Visualizer",
        words="render, show, visualize, visualise, display",
    ),
    _row("times", "t", R, "", "time", "get_time", "", "getTime", words="times, time_points, ts"),
    _row("coordinates over time", "q", R, "", "qpos", "", "q", "getQ", words="y, positions, trajectory, x"),
    _row("velocities over time", "v", R, "", "qvel", "", "qd", "getU", words="velocities, dq, qdot, qd"),
    _row("accelerations over time", "vdot", R, "", "qacc", "", "qdd", "getUDot", words="accelerations, ddq, qddot, a"),
    _row("generalized forces over time", "forces[effect]", R, "", "qfrc_applied", "", "", "", words="torques, tau"),
    _row("a film", 'animate(), to_html("run.html")', R, "", "Renderer", "", "plot", "", words="movie, video, to_gif, render, show, view"),
    _row("table", "to_dataframe(), to_xarray()", R, "", "", "", "", "", words="to_pandas, to_numpy, dataframe, to_csv"),
)


def _table() -> dict[tuple[str, str], Row]:
    found: dict[tuple[str, str], Row] = {}
    for row in ROWS:
        for name in row.asked():
            found.setdefault((row.of, name), row)
    return found


_BY_NAME: dict[tuple[str, str], Row] = {}


def remedy(of: str, name: str) -> str:
    """Return "; here that is ..." for a name of another package or of the trade, and "" for any other."""
    if not _BY_NAME:
        _BY_NAME.update(_table())
    row = _BY_NAME.get((of, name))
    if row is None and of == P:  # calls of modules there are methods of models here
        row = next((found for kind in (M, S, R) if (found := _BY_NAME.get((kind, name)))), None)
    if row is None:
        return ""
    where = {M: "model.", S: "scene.", R: "run.", P: ""}[row.of]
    here = (
        ", ".join(f"{where}{each}" for each in row.here.split(", ")) if where and "(" not in row.here.split(", ")[0] else where + row.here
    )
    return f"; here that is {here} (docs/coming_from.md)"


class Renamed:
    """A class whose missing attributes are answered with what they are called here."""

    _of = ""

    def __getattr__(self, name: str) -> object:
        """AttributeError that gives the name here. Called for names that are not there, and for no others."""
        text = f"{type(self).__name__!r} object has no attribute {name!r}"
        raise AttributeError(text if name.startswith("_") else text + remedy(self._of, name), name=name, obj=self)
