"""Tests that say what is wanted and not there yet, each with the reason: they run and may fail, and are taken off this list when mended.

A key is the beginning of a test's name, file first. `CRASHES` are not run.
"""

UNITS = "Λ and ln det of a shifted mass matrix in five systems of units keep 1e-11, not yet the 1e-12 of the bound"
OVERLAP = "mass_matrix_inverse compared on inputs whose arrays overlap the result"
TERMINAL = "tables in 80 columns wrap the words that the test looks for"
PICKLES = "derivatives of operators on derived trees do not pickle"
STATES = "one call each that does not follow the one rule of states and values yet"
PLANS = "traces of products with Ω, and shifted chains of thousands of bodies, still go by elimination"
INTERRUPT = "sweeps in 100 digits look at signals once a state, not once a body"

OPEN = {
    "tests/stability/test_hard_cases.py::test_every_bound_holds[arm-of-pins-and-sliders": UNITS,
    "tests/test_overlaps.py::test_a_part_of_the_campaign": OVERLAP,
    "tests/test_overlaps.py::test_the_campaign": OVERLAP,
    "tests/test_accuracy_table.py::test_rows_that_show_their_rounding_say_so": TERMINAL,
    "tests/test_accuracy_table.py::test_display": TERMINAL,
    "tests/test_work_precision.py::test_ways_out": TERMINAL,
    "tests/test_pickling.py::test_every_protocol": PICKLES,
    "tests/test_pickling.py::test_copies": PICKLES,
    "tests/test_state_rules.py::test_every_direct_call_takes_a_state_or_the_models_own[hamiltonian_dynamics": STATES,
    "tests/test_state_rules.py::test_jacobians_of_batches_and_into_arrays": STATES,
    "tests/test_state_rules.py::test_a_scalar_shows_its_value": STATES,
    "tests/test_plans.py::test_a_stretched_chain_of_thousands_is_solved": PLANS,
    "tests/test_whole_inverse.py::test_no_elimination_is_planned": PLANS,
    "tests/test_deep.py::test_limits_are_named": "two limits on powers, of which the other is named",
    "tests/test_interrupts.py::test_ctrl_c_within_a_second[sweeps in 100 digits": INTERRUPT,
    "tests/test_interrupts.py::test_ctrl_c_within_a_second[a Riccati sweep in 100 digits": INTERRUPT,
    "tests/test_interrupts.py::test_ctrl_c_within_a_second[one large state in 100 digits": INTERRUPT,
    "tests/test_cli_options.py::test_every_figure_of_what_accuracy_costs_has_its_bound": "figures over all kinds have another column",
}
CRASHES = {
    "tests/test_checker.py::test_one_letter_exchanged[#64": "a letter of the grouped tree beside one of the robot's own ends the process",
}
