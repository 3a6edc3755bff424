"""What the everyday subset leaves out besides the tests that mark themselves: what takes seconds and stands close to a quick test."""

import pytest

SLOW = {
    "test_symbolic": lambda item: "pendulum" not in item.nodeid,
    "test_notebooks": lambda item: "00_tour" not in item.nodeid and "02_" not in item.nodeid,
    "test_checker": lambda item: item.originalname in ("test_one_letter_exchanged", "test_one_coefficient_off")
    and any(sign in item.callspec.params["name"] for sign in "∂#"),
    "test_calculus": lambda item: item.originalname in ("test_second_derivatives", "test_along_time", "test_along_parameters"),
    "test_cli": lambda item: item.originalname == "test_tour" and "panda" not in item.nodeid,
    "test_prove": lambda item: item.originalname.startswith(("test_random", "test_nothing_false", "test_what_is_proved_of_perturbed")),
    "test_algorithm": lambda item: "random" in item.originalname,
    "test_sympy_bridge": lambda item: "random" in item.originalname,
    "test_properties": lambda item: item.originalname == "test_values_of_deeper_expressions",
}


def pytest_collection_modifyitems(items):
    for item in items:
        slow = SLOW.get(item.path.stem)
        if slow and slow(item):
            item.add_marker(pytest.mark.slow)
