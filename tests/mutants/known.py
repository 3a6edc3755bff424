"""Survivors that are no fault of the tests, each with its reason, and the dozen of every `make test-peers`."""

# In sources that few others include, so that little is compiled.
DOZEN = [
    "stale numbers of the present state",
    "stale numbers of a bound state",
    "plans for J = 0 kept",
    "a fraction read upside down",
    "∂P without G ∂J G*",
    "∂ blockdiag(AXA*) as if X were symmetric",
    "a coordinate moves its own twist",
    "conjugate gradients never refuse",
    "a report counts what fails as passed",
    "bench loses its bounds",
    "check --json without its seed",
    "a divisor as a factor",
]

# The files whose tests meet the dozen.
DOZEN_TESTS = [
    "whole/test_stale_numbers.py",
    "algebra/test_calculus_rules.py",
    "cli/test_cli_options.py",
    "identities/test_failing_reports.py",
    "identities/test_readings.py",
    "dynamics/test_methods.py",
]

# Whose tests are to notice a change of these sources: they are tried first.
AREAS = {
    "cpp/algebra/language/source.cpp": ["whole/test_stale_numbers.py"],
    "cpp/dynamics/workspace_pool.h": ["whole/test_stale_numbers.py"],
    "cpp/model/multibody.cpp": ["whole/test_stale_numbers.py", "models/test_arguments.py"],
    "cpp/algebra/engine/engine.cpp": ["whole/test_stale_numbers.py", "algebra/test_eliminations.py", "sweeps/test_singular_forms.py"],
    "cpp/algebra/engine/refined_solves.h": ["algebra/test_eliminations.py", "sweeps/test_refined_calls.py", "sweeps/test_refinement.py"],
    "cpp/algebra/engine/block_steps.h": ["algebra/test_eliminations.py", "sweeps/test_refined_calls.py", "sweeps/test_refinement.py"],
    "cpp/algebra/engine/elimination/elimination_solve.h": [
        "algebra/test_eliminations.py",
        "algebra/test_units.py",
        "operators/test_batches.py",
    ],
    "cpp/algebra/engine/elimination/elimination_factor.h": [
        "algebra/test_eliminations.py",
        "algebra/test_units.py",
        "operators/test_batches.py",
    ],
    "cpp/algebra/engine/elimination/elimination_accuracy.h": [
        "algebra/test_eliminations.py",
        "algebra/test_units.py",
        "operators/test_batches.py",
    ],
    "cpp/algebra/theorems/differentiate.cpp": ["algebra/test_calculus_rules.py"],
    "cpp/operators/directions.cpp": ["algebra/test_calculus_rules.py"],
    "cpp/dynamics/rigid_dynamics.cpp": [
        "sweeps/test_singular_forms.py",
        "sweeps/test_minimum_norm.py",
        "sweeps/test_refinement.py",
        "sweeps/test_refined_calls.py",
        "dynamics/test_galilean.py",
    ],
    "cpp/dynamics/singular_hinges.h": ["sweeps/test_minimum_norm.py", "sweeps/test_singular_forms.py"],
    "cpp/recursions/point_accelerations.h": ["dynamics/test_galilean.py"],
    "cpp/rigid/rigid_elimination.h": ["sweeps/test_singular_hinges.py", "sweeps/test_refinement_rounding.py"],
    "cpp/rigid/rigid_residuals.h": ["sweeps/test_singular_hinges.py", "sweeps/test_refinement_rounding.py"],
    "cpp/model/subhinge_kinds.h": ["dynamics/test_direct_calls.py", "dynamics/test_integration.py"],
    "cpp/model/hinge.cpp": ["models/test_arguments.py", "dynamics/test_direct_calls.py"],
    "cpp/model/compiled_model.cpp": ["dynamics/test_direct_calls.py", "dynamics/test_galilean.py"],
    "cpp/dynamics/batches.h": ["dynamics/test_direct_calls.py"],
    "cpp/dynamics/batches.cpp": ["models/test_arguments.py"],
    "cpp/operators/multibody_operators.cpp": ["algebra/test_calculus_rules.py"],
    "cpp/numerics/refinement.h": ["sweeps/test_refinement.py", "sweeps/test_refined_calls.py", "sweeps/test_refinement_rounding.py"],
    "cpp/algebra/planning/plan_diagonals.cpp": ["algebra/test_whole_inverse.py", "operators/test_operators_algebra.py"],
    "cpp/algebra/planning/recognise.cpp": [
        "algebra/test_plans.py",
        "algebra/test_results_of_plans.py",
        "operators/test_operators_algebra.py",
    ],
    "cpp/algebra/language/properties.cpp": ["algebra/test_mixed_trees.py", "algebra/test_grouped_bodies.py"],
    "cpp/algebra/planning/plan_vectors.cpp": [
        "algebra/test_plans.py",
        "algebra/test_results_of_plans.py",
        "operators/test_operators_algebra.py",
        "sweeps/test_refinement_rounding.py",
    ],
    "cpp/dynamics/methods.cpp": ["dynamics/test_methods.py"],
    "cpp/simulation/trajectory.cpp": ["dynamics/test_trajectory_steps.py", "dynamics/test_integration.py"],
    "cpp/kernels/forward_dynamics.h": ["dynamics/test_kernels.py", "dynamics/test_kernels_digits.py", "dynamics/test_packs.py"],
    "cpp/kernels/mass_matrix_of_links.h": ["dynamics/test_kernels_digits.py"],
    "pycraft/compiled/trace.py": ["compiled/test_trace.py", "compiled/test_compiled_expressions.py"],
    "pycraft/compiled/source.py": ["compiled/test_compiled_calls.py"],
    "pycraft/compiled/expressions.py": ["compiled/test_compiled_expressions.py"],
    "pycraft/compiled/kinematics.py": ["compiled/test_compiled_expressions.py"],
    "pycraft/compiled/frames.py": ["compiled/test_compiled_calls.py"],
    "pycraft/compiled/compiled.py": ["compiled/test_compiled_calls.py", "compiled/test_compiled_expressions.py"],
    "pycraft/compiled/build.py": ["compiled/test_compiled_calls.py"],
    "pycraft/dynamics/threads.py": ["dynamics/test_threads_of_batches.py"],
    "cpp/kernels/steps.h": ["dynamics/test_kernels.py"],
    "cpp/kernels/motions.h": ["dynamics/test_kernels.py"],
    "cpp/kernels/sine_cosine.h": ["dynamics/test_kernels.py"],
    "cpp/kernels/link_model.cpp": ["dynamics/test_kernels.py", "sweeps/test_singular_hinges.py"],
    "cpp/dynamics/link_dynamics.h": ["dynamics/test_packs.py"],
    "cpp/dynamics/packed_dynamics.cpp": ["dynamics/test_packs.py"],
    "cpp/model/checks.cpp": ["models/test_arguments.py", "models/test_errors_models.py"],
    "cpp/bindings/conversions.cpp": ["models/test_arguments.py"],
    "cpp/bindings/direct_calls.h": ["dynamics/test_overlaps.py"],
    "cpp/runtime/interrupt.cpp": ["whole/test_interrupts.py"],
    "pycraft/identities/report.py": ["identities/test_failing_reports.py", "identities/test_judge.py", "cli/test_terminal.py"],
    "pycraft/identities/judge.py": ["identities/test_judge.py"],
    "pycraft/identities/checker.py": ["identities/test_judge.py", "identities/test_failing_reports.py", "identities/test_checker.py"],
    "pycraft/identities/residual_bounds.py": ["identities/test_judge.py"],
    "pycraft/identities/book.py": ["identities/test_readings.py"],
    "pycraft/identities/parse.py": ["identities/test_readings.py", "identities/test_statements.py"],
    "pycraft/identities/spelling.py": ["identities/test_spellings.py", "identities/test_readings.py"],
    "pycraft/identities/truth.py": ["identities/test_truth.py", "identities/test_statements.py"],
    "pycraft/identities/family.py": ["identities/test_truth.py"],
    "pycraft/identities/search.py": ["identities/test_statements.py", "identities/test_truth.py"],
    "pycraft/identities/edits.py": ["proofs/test_repair.py"],
    "pycraft/identities/paper.py": ["identities/test_paper.py"],
    "pycraft/proofs/repair.py": ["proofs/test_repair.py"],
    "pycraft/identities/block_check.py": ["identities/test_block_statements.py"],
    "pycraft/identities/block_reading.py": ["identities/test_block_statements.py"],
    "pycraft/identities/block_relations.py": ["identities/test_block_statements.py"],
    "pycraft/identities/block_values.py": ["identities/test_block_statements.py"],
    "pycraft/proofs/worksheet.py": ["proofs/test_worksheet.py", "proofs/test_exercise.py"],
    "pycraft/proofs/presuppositions.py": ["proofs/test_prove_presuppositions.py", "proofs/test_prove_assumptions.py"],
    "pycraft/proofs/relations.py": [
        "proofs/test_prove_statements.py",
        "proofs/test_prove_assumptions.py",
        "proofs/test_prove_catalogue.py",
    ],
    "pycraft/peers/compare.py": ["peers/test_compare.py"],
    "pycraft/peers/twins.py": ["peers/test_compare.py"],
    "pycraft/models/loaders/rotations.py": ["models/test_urdf.py", "models/test_mjcf.py"],
    "pycraft/models/loaders/xml_file.py": ["models/test_loaders_hostile.py", "models/test_urdf.py"],
    "pycraft/cli/bench.py": ["cli/test_cli_options.py"],
    "pycraft/cli/commands.py": ["cli/test_cli_options.py"],
    "pycraft/recursions/copied_parts.py": ["recursions/test_written_helpers.py"],
    "pycraft/recursions/runtime/matrices.py": ["recursions/test_written_helpers.py"],
    "pycraft/recursions/runtime/stacking.py": ["recursions/test_written_helpers.py"],
    "pycraft/recursions/runtime/cross_products.py": ["recursions/test_written_helpers.py"],
    "pycraft/recursions/runtime/tree_system.py": ["recursions/test_written_helpers.py"],
    "cpp/algebra/trees/mixed_blocks.h": ["algebra/test_mixed_trees.py"],
    "cpp/algebra/trees/reordered_values.h": ["algebra/test_mixed_trees.py"],
    "cpp/algebra/trees/grouping.h": ["algebra/test_mixed_trees.py"],
    "cpp/operators/grouped_operators.cpp": ["algebra/test_mixed_trees.py"],
}

# (file, change, part of the line): why no test can tell.
EQUIVALENT = {
    (
        "cpp/rigid/rigid_elimination.h",
        "pivot bound without its J",
        "",
    ): "a pivot is no smaller than its share of J: eps of that decides nothing",
    (
        "cpp/algebra/engine/elimination/elimination_solve.h",
        "a refinement of an elimination need only shrink",
        "",
    ): "what loses more than a hundredth is refused, so corrections shrink a hundredfold or are rounding: one of these more, no digit else",
    (
        "pycraft/identities/search.py",
        "children of a body left out",
        "",
    ): "children of the body left out stand at its parent by then: no parent is k, and what is above k is above 0",
    (
        "pycraft/models/loaders/xml_file.py",
        "entities are expanded",
        "",
    ): "a file that declares entities is refused after, one that does not has none to expand, and none is fetched",
    (
        "cpp/algebra/trees/mixed_blocks.h",
        "mixed trees trust what rigid ones do",
        "",
    ): "a pivot that is noise is so beside diag P, as a rigid body sees; what a group rounds besides is looked at as a precaution",
    (
        "pycraft/recursions/runtime/tree_system.py",
        "`==` as `!=`",
        "known = ",
    ): "what is swept to see how much is lost is any vector of ones with signs",
}


def reason(mutant):
    for (file, change, part), why in EQUIVALENT.items():
        if mutant.file == file and mutant.change == change and part in mutant.shown:
            return why
    return ""
