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

# (file, change, part of the line): why no test can tell.
EQUIVALENT = {
    ("cpp/recursions/configuration_rate.h", "quaternions lose their length in a move", ""): "to rounding the same: sqrt(had / has) is 1",
    ("pycraft/identities/book.py", "a sign bound to the whole sum", ""): "every term but the first has its sign before it",
}


def reason(mutant):
    for (file, change, part), why in EQUIVALENT.items():
        if mutant.file == file and mutant.change == change and part in mutant.shown:
            return why
    return ""
