"""Tests excluded from the everyday subset besides tests that mark themselves: slow tests beside a quick one, and most of many cases."""

import os
import tempfile
from collections import defaultdict

# What examples compile is no business of the user's own folder.
os.environ.setdefault("PYCRAFT_CACHE", os.path.join(tempfile.gettempdir(), f"pycraft-tests-{os.getuid()}"))
# Before NumPy is imported: the tests run side by side, and threads of small products wait for each other.
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import pytest  # noqa: E402 - after the threads are counted

SLOW = {
    "test_symbolic": lambda item: "pendulum" not in item.nodeid,
    "test_notebooks": lambda item: "00_tour" not in item.nodeid,
    "test_checker": lambda item: (
        item.originalname == "test_with_rotor_inertia_what_needs_j_zero_is_expected_to_fail"
        or (
            item.originalname in ("test_one_letter_exchanged", "test_one_coefficient_off")
            and any(sign in item.callspec.params["name"] for sign in ("∂", "diagonalised", "quasi"))
        )
    ),
    "test_calculus": lambda item: (
        item.originalname in ("test_second_derivatives", "test_along_time", "test_along_parameters")
        or (item.originalname == "test_along_every_coordinate" and item.callspec.params["name"] not in ("E", "D", "ℳ"))
    ),
    "test_cli": lambda item: item.originalname in ("test_tour", "test_bench_holds_its_bounds"),
    "test_reference": lambda item: any(f"[{name}" in item.nodeid for name in ("every kind", "sequences, rotors")),
    "test_robots": lambda item: item.originalname == "test_agrees_with_the_oracle" and item.callspec.params["seed"],
    "test_prove": lambda item: item.originalname.startswith(("test_random", "test_nothing_false", "test_what_is_proved_of_perturbed")),
    "test_algorithm": lambda item: (
        "random" in item.originalname
        or item.name.endswith("-no rotors]")
        or (item.originalname == "test_python_of_every_spelling" and len(item.callspec.params["name"]) % 3 > 0)
    ),
    "test_certify": lambda item: (
        (item.originalname == "test_never_smaller_than_a_tenth_of_truth" and item.callspec.params["rung"].form == "square-root")
        or (item.originalname == "test_the_error_is_the_true_one" and item.callspec.params["precision"] == "quad")
    ),
    "test_exercise": lambda item: "of_the_catalogue" in item.originalname and len(item.callspec.params["name"]) % 4 > 0,
    "test_stale_numbers": lambda item: (
        item.originalname == "test_expressions_after_an_edit" and item.callspec.params["edit"] not in ("mass", "rotor inertia", "state")
    ),
    "test_cli_processes": lambda item: (
        (item.originalname == "test_options" and any(word in item.callspec.params["arguments"] for word in ("states", "precision")))
        or (item.originalname == "test_packages_that_are_not_there" and item.callspec.params["package"] == "jupyterlab")
        or item.originalname == "test_an_ascii_terminal"
    ),
    "test_docs": lambda item: (
        item.originalname == "test_the_readme_example_runs"
        or item.name.endswith(("_page_run[statements]", "_page_run[compiled]"))
        or (item.originalname == "test_the_pages_run" and item.callspec.params["page"] == "tour_researcher")
    ),
    "test_proof_campaign": lambda item: item.originalname.startswith("test_traces_with") and item.callspec.params["seed"] != 173,
    "test_forms": lambda item: (
        (item.originalname == "test_forms_agree_in_quad" and not item.callspec.params["rotor_inertia"])
        or (item.originalname == "test_operators_of_special_models" and "rotors" not in item.callspec.params["name"] and "one" in item.name)
    ),
    "test_integration": lambda item: item.originalname == "test_tolerances_are_followed",
    "test_refinement": lambda item: item.originalname == "test_forms_with_factors_need_no_refinement",
    "test_singular_forms": lambda item: item.originalname == "test_heavy_tips" and item.callspec.params["ratio"] != 1e15,
    "test_sko_random": lambda item: item.originalname == "test_every_theorem",
    "test_statements": lambda item: item.originalname == "test_the_smallest_counterexample" and not item.callspec.params["rotor"],
    "test_sympy_bridge": lambda item: "random" in item.originalname,
    "test_properties": lambda item: item.originalname == "test_values_of_deeper_expressions",
    "test_mixed_trees": lambda item: (
        item.originalname == "test_the_catalogue"
        and "rotors" not in item.name
        and "one body" not in item.name
        or item.name.endswith(("[fork within, rotors]", "[several roots, rotors]", "[coordinates apart, rotors]", "[chain, two, rotors]"))
    ),
    "test_packs_of_expressions": lambda item: (
        item.originalname == "test_where_pivots_are_chosen_once"
        and item.name.endswith(("[every kind]", "[rotors]", "[legs]", "[chain askew]"))
    ),
    "test_parts": lambda item: item.name.endswith(("bodies_alone[1]", "bodies_alone[2]", "bodies_alone[4]")),
    "test_nested": lambda item: item.originalname in ("test_a_run_within_a_signals_handler", "test_a_run_within_an_operator_from_outside"),
    "test_compiled_calls": lambda item: item.originalname in ("test_what_cannot_be_compiled", "test_a_library_is_built_once"),
    "test_written_helpers_cpp": lambda item: item.originalname == "test_a_header_compiles_by_itself_without_a_warning",
    "test_frames": lambda item: item.originalname == "test_jacobians_and_their_rates" and "tree" not in item.name,
    "test_loops": lambda item: item.name.startswith("test_rows_of_hinges[1-"),
    "test_speed": lambda item: item.originalname == "test_a_plot_is_drawn",
    "test_judge": lambda item: item.name == "test_hard_models_are_decided[heavy_tip]",
    "test_embedded_motion": lambda item: item.originalname == "test_choices_that_degrade_are_left",
    "test_embedded": lambda item: item.originalname == "test_theorems" and "four-bar" not in item.name,
    "test_steps_on_loops": lambda item: (
        item.originalname == "test_flat_states_are_passed_with_all_digits" and item.callspec.params["windows"] == 5
    ),
    "test_kept_loops": lambda item: item.originalname == "test_forty_four_bars",
    "test_sweeps_of_columns": lambda item: item.originalname == "test_instruction_sets_agree",
    "test_deep": lambda item: item.originalname == "test_shared_parts_are_planned_once",
    "test_structure_random": lambda item: item.originalname == "test_sequences_of_edits",
    "test_left_open": lambda item: item.originalname == "test_the_server_does_not_grow",
    "test_compiled_loops": lambda item: item.originalname == "test_what_is_too_large_says_so",
    "test_loop_theorems": lambda item: item.originalname == "test_they_hold_off_the_loops_and_on_them" and "four-bar" not in item.name,
    "test_run_page": lambda item: item.originalname == "test_pages_are_small_and_alike",
    "test_penalty_loops": lambda item: item.originalname == "test_stiff_springs_keep_what_loops_keep",
    "test_divide_and_conquer": lambda item: item.originalname == "test_memory_is_what_is_held",
    "test_loops_at_rest": lambda item: item.name == "test_within_limits[True]",
    "test_variational": lambda item: item.originalname == "test_steps_are_symplectic" and item.name.endswith("variational4]"),
    "test_runs": lambda item: (
        item.originalname == "test_ctrl_c_keeps_what_was_computed" and item.callspec.params["integrator"] in ("variational2", "dopri5")
    ),
    "test_scene": lambda item: item.originalname == "test_every_form_and_precision" and "quad" in item.name,
    "test_distributions": lambda item: (
        item.originalname == "test_a_pendulum_in_its_potential" and item.callspec.params["integrator"] == "rkmk4"
    ),
    "test_plans_at_states": lambda item: item.name.endswith("would_have_had[derivative of an inverse]"),
    "test_folders": lambda item: item.originalname == "test_a_process_that_is_killed_loses_no_finished_run",
}


# How many cases of a test the everyday subset takes, spread over those that are not slow by themselves: MOST, and of what takes long fewer.
MOST = 24
FEW = {
    "test_algorithm::test_python_of_every_spelling": 12,
    "test_certify::test_never_smaller_than_a_tenth_of_truth": 8,
    "test_checker::test_every_theorem_holds_where_its_hypotheses_are_met": 1,
    "test_checker::test_one_coefficient_off": 24,
    "test_checker::test_one_letter_exchanged": 24,
    "test_cli_processes::test_options": 2,
    "test_compiled_calls::test_graphs_are_the_calls": 5,
    "test_compiled_expressions::test_graphs_are_the_plans": 20,
    "test_curves::test_rows": 1,
    "test_docs::test_the_blocks_of_a_page_run": 2,
    "test_docs::test_the_pages_run": 8,
    "test_forms::test_operators_of_special_models": 2,
    "test_frames::test_jacobians_and_their_rates": 2,
    "test_generated_pages::test_the_table_of_contents_lists_them": 0,
    "test_judge::test_derived_bounds_hold": 1,
    "test_kernels::test_instruction_sets_agree": 0,
    "test_kernels_factored::test_digits_of_the_general_recursions": 20,
    "test_layers::test_other_tools_are_imported_by_interop_and_peers_alone": 0,
    "test_loop_theorems::test_what_follows_from_the_axioms_is_derived": 2,
    "test_loops::test_rows_of_hinges": 3,
    "test_loops_at_rest::test_within_limits": 0,
    "test_mixed_trees::test_the_catalogue": 2,
    "test_packs_of_expressions::test_the_bits_of_each_state": 8,
    "test_packs_of_expressions::test_where_pivots_are_chosen_once": 1,
    "test_parts::test_every_operator_is_that_of_the_bodies_alone": 1,
    "test_prove_derivatives::test_the_books_recursion_of_the_derivative_of_upsilon": 0,
    "test_speed::test_one_command_writes_all": 0,
    "test_stick_figure::test_every_model_in_every_view": 12,
    "test_subtrees_in_threads::test_the_bits_of_one_thread": 2,
    "test_swept_tangents::test_whatever_is_asked": 5,
    "test_sweeps::test_a_process_that_dies": 1,
    "test_sweeps::test_statements_over_many_models": 0,
    "test_target_rows::test_of_poses": 10,
    "test_threads::test_edits_beside_evaluations": 1,
}


@pytest.fixture(scope="module")
def browser():
    """Headless Chromium; tests that ask for it are marked `browser`."""
    from support.browser import chromium

    with chromium() as opened:
        yield opened


def pytest_collection_modifyitems(items):
    for item in items:
        if "browser" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.browser)
        slow = SLOW.get(item.path.stem)
        if slow and slow(item):
            item.add_marker(pytest.mark.slow)
    cases = defaultdict(list)
    for item in items:
        if not item.get_closest_marker("slow"):
            cases[item.nodeid.partition("[")[0]].append(item)
    for test, several in cases.items():
        count = FEW.get(f"{several[0].path.stem}::{test.rpartition('::')[2]}", MOST)
        for i, item in enumerate(several):
            if i * count // len(several) == (i - 1) * count // len(several):
                item.add_marker(pytest.mark.slow)
