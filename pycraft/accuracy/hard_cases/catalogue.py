"""The catalogue of hard cases, from all files of cases."""

from __future__ import annotations

from collections.abc import Iterable

from .case import Case

SIZES = (2, 4, 8, 16, 32, 64, 128, 256, 512, 1024)


def catalogue(sizes: Iterable[int] = SIZES) -> list[Case]:
    """Return all cases, with chains of these numbers of links; other cases larger than the largest are omitted."""
    from . import (
        cases_chains,
        cases_closures,
        cases_configurations,
        cases_elimination,
        cases_groups,
        cases_loops,
        cases_massless,
        cases_motion,
        cases_ratios,
        cases_refinement,
        cases_task_space,
        cases_trajectories,
        cases_units,
    )

    sizes = sorted(sizes)
    cases: list[Case] = cases_chains.cases(sizes)
    modules = (
        cases_ratios,
        cases_refinement,
        cases_massless,
        cases_configurations,
        cases_units,
        cases_elimination,
        cases_groups,
        cases_task_space,
        cases_loops,
        cases_closures,
        cases_motion,
        cases_trajectories,
    )
    for module in modules:
        cases += [case for case in module.cases() if case.parameters.get("N", 0) <= max(sizes[-1], 10)]
    return cases
