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
    "test_stale_numbers.py",
    "test_calculus_rules.py",
    "test_cli_options.py",
    "test_failing_reports.py",
    "test_readings.py",
    "test_methods.py",
]

# Whose tests are to notice a change of these sources: they are tried first.
AREAS = {
    "cpp/algebra/language/source.cpp": ["test_stale_numbers.py"],
    "cpp/dynamics/workspace_pool.h": ["test_stale_numbers.py"],
    "cpp/model/multibody.cpp": ["test_stale_numbers.py", "test_arguments.py"],
    "cpp/algebra/engine/engine.cpp": ["test_stale_numbers.py", "test_eliminations.py", "test_singular_forms.py"],
    "cpp/algebra/engine/workspace.h": ["test_eliminations.py", "test_refinement.py"],
    "cpp/algebra/engine/elimination/elimination_solve.h": ["test_eliminations.py", "test_units.py", "test_batches.py"],
    "cpp/algebra/theorems/differentiate.cpp": ["test_calculus_rules.py"],
    "cpp/operators/directions.cpp": ["test_calculus_rules.py"],
    "cpp/dynamics/rigid_dynamics.cpp": ["test_singular_forms.py", "test_refinement.py", "test_galilean.py"],
    "cpp/recursions/point_accelerations.h": ["test_galilean.py"],
    "cpp/rigid/rigid_blocks.h": ["test_singular_hinges.py", "test_refinement_rounding.py"],
    "cpp/numerics/refinement.h": ["test_refinement.py", "test_refinement_rounding.py"],
    "cpp/algebra/planning/plan_diagonals.cpp": ["test_whole_inverse.py", "test_operators_algebra.py"],
    "cpp/algebra/planning/plan_vectors.cpp": ["test_plans.py", "test_operators_algebra.py", "test_refinement_rounding.py"],
    "cpp/dynamics/methods.cpp": ["test_methods.py"],
    "cpp/simulation/trajectory.cpp": ["test_trajectory_steps.py", "test_integration.py"],
    "cpp/dynamics/packed_dynamics.cpp": ["test_packs.py"],
    "cpp/model/checks.cpp": ["test_arguments.py", "test_errors_models.py"],
    "cpp/bindings/conversions.cpp": ["test_arguments.py"],
    "cpp/bindings/direct_calls.h": ["test_overlaps.py"],
    "cpp/runtime/interrupt.cpp": ["test_interrupts.py"],
    "pycraft/identities/report.py": ["test_failing_reports.py", "test_judge.py", "test_terminal.py"],
    "pycraft/identities/judge.py": ["test_judge.py"],
    "pycraft/identities/checker.py": ["test_judge.py", "test_failing_reports.py", "test_checker.py"],
    "pycraft/identities/residual_bounds.py": ["test_judge.py"],
    "pycraft/identities/book.py": ["test_readings.py"],
    "pycraft/identities/parse.py": ["test_readings.py", "test_statements.py"],
    "pycraft/identities/spelling.py": ["test_spellings.py", "test_readings.py"],
    "pycraft/identities/truth.py": ["test_truth.py", "test_statements.py"],
    "pycraft/identities/family.py": ["test_truth.py"],
    "pycraft/identities/search.py": ["test_statements.py", "test_truth.py"],
    "pycraft/identities/edits.py": ["test_repair.py"],
    "pycraft/identities/paper.py": ["test_paper.py"],
    "pycraft/proofs/repair.py": ["test_repair.py"],
    "pycraft/identities/block_check.py": ["test_block_statements.py"],
    "pycraft/identities/block_reading.py": ["test_block_statements.py"],
    "pycraft/identities/block_relations.py": ["test_block_statements.py"],
    "pycraft/identities/block_values.py": ["test_block_statements.py"],
    "pycraft/proofs/worksheet.py": ["test_worksheet.py", "test_exercise.py"],
    "pycraft/proofs/presuppositions.py": ["test_prove_presuppositions.py", "test_prove_assumptions.py"],
    "pycraft/proofs/relations.py": ["test_prove_statements.py", "test_prove_assumptions.py", "test_prove_catalogue.py"],
    "pycraft/peers/compare.py": ["test_compare.py"],
    "pycraft/peers/twins.py": ["test_compare.py"],
    "pycraft/models/loaders/rotations.py": ["test_urdf.py", "test_mjcf.py"],
    "pycraft/models/loaders/xml_file.py": ["test_loaders_hostile.py", "test_urdf.py"],
    "pycraft/cli/bench.py": ["test_cli_options.py"],
    "pycraft/cli/commands.py": ["test_cli_options.py"],
}

# (file, change, part of the line): why no test can tell.
EQUIVALENT = {
    (
        "cpp/rigid/rigid_blocks.h",
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
}


def reason(mutant):
    for (file, change, part), why in EQUIVALENT.items():
        if mutant.file == file and mutant.change == change and part in mutant.shown:
            return why
    return ""
