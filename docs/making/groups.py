"""Public names in groups by task, for the pages of the reference."""

MULTIBODY = {
    "Build": (
        "add_body add_node add_frame bodies hinges nodes frames frame name gravity mass has_rotor_inertia keeps_welds "
        "strict actuators left_aside not_read offers description from_description warn take_warnings"
    ),
    "State": (
        "q v nq nv coordinate_names zero_q neutral random_state clamped distance_to_limits check_q integrate difference configuration_rate"
    ),
    "Operators": "soa certify compile",
    "Kinematics": (
        "pose jacobian jacobian_dot jacobian_derivative centre_of_mass centre_of_mass_velocity "
        "centre_of_mass_jacobian centre_of_mass_frame centroidal_momentum composite_inertia momentum solve_ik"
    ),
    "Dynamics": (
        "forward_dynamics inverse_dynamics hybrid_dynamics bias_forces mass_matrix mass_matrix_inverse "
        "coriolis_matrix kinetic_energy potential_energy innovations refinement prepare integrate_ode "
        "hamiltonian_dynamics diagonalised_dynamics task_space operational_space_inertia operational_space_compliance"
    ),
    "Forces and statics": "interbody_forces interbody_forces_derivatives base_reaction equilibrium counterbalance",
    "Derivatives and linear models": (
        "forward_dynamics_derivatives inverse_dynamics_derivatives hybrid_dynamics_derivatives "
        "kinetic_energy_derivatives mass_matrix_derivative christoffel log_determinant_gradient linearize "
        "quadratic_model"
    ),
    "Identification and statistics": (
        "identify inertial_parameters inertial_regressor rotor_forces rotor_regressor equipartition fixman_potential "
        "fixman_torque dof_shares"
    ),
    "Loops": (
        "loops add_loop add_coupling add_curve add_rolling add_surface assemble assembly_branches mobility "
        "mobility_along constrained_dynamics constrained_velocities constrained_inverse_dynamics constrained_inverse_dynamics_derivatives"
    ),
    "Change the structure": (
        "attach detach reattach reroot rerootings merge copy_subtree remove_body prune lock unlock locked coalesce coalesced split"
    ),
    "Parts": "subgraph whole carrier moving_base follow_base path state_of q_of v_of q_index v_index accelerations_of",
    "Files and pictures": "save tree plot view shapes collision_shapes",
}
"""Members of `Multibody`, by heading."""

PYCRAFT = {
    "Models": "Multibody load robots chain tree sko_model models State Spline",
    "Operators": ("Operator OperatorSet Scalar Space vector constant identity zero blockdiag euclidean parse symbolic from_sympy to_sympy"),
    "Statements and proofs": "check truth prove prove_derivative derivative repair hypothesis_switches Proof exercise Exercise worksheet",
    "Scenes and runs": "Scene effects mechanisms load_scene load_run Event Checkpoint loops_compared",
    "Ensembles": "sweep samples load_sweep",
    "Accuracy and comparison": "accuracy work_precision compare",
    "Estimation": "kalman",
    "Other packages and C++": "interop cmake_dir instruction_set",
    "Errors and warnings": (
        "Error ModelError SpaceError SingularHingeError SingularOperatorError StaleOperatorError EvaluationError "
        "RefinementError UndecidedError ModelWarning"
    ),
}
"""Names of `pycraft`, by heading."""


def grouped(groups: dict[str, str], names: list[str]) -> dict[str, list[str]]:
    """Return the names by heading. Raise ValueError for a name in no group, in two groups, or in a group but not in the list."""
    made = {heading: listed.split() for heading, listed in groups.items()}
    listed = [name for group in made.values() for name in group]
    if wrong := (set(listed) ^ set(names)) | {name for name in listed if listed.count(name) > 1}:
        raise ValueError(f"docs/making/groups.py: {', '.join(sorted(wrong))} must be in one group, and exist")
    return made
