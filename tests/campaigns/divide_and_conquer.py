"""Cost of divide and conquer and of the articulated method on this machine: writes docs/divide_and_conquer.md.

    python tests/campaigns/divide_and_conquer.py [--page docs/divide_and_conquer.md] [--largest 1000000] [--rounds 5]

Forward dynamics of one state of a chain, a balanced tree and a comb of pins, 10² to 10⁶ links, on one thread and on two; the best of so
many rounds. The bits of both numbers of threads are compared, and the values with the articulated method's.
"""

import argparse
import os
import platform
from collections.abc import Callable
from math import log2
from pathlib import Path
from time import perf_counter

import numpy as np

import pycraft as pc
from pycraft.ensembles.backends import cores

THREADS = 2

PAGE = """# Divide and conquer

`forward_dynamics(..., method="divide-and-conquer")` computes the accelerations of the articulated-body algorithm along a critical path of
O(log N): segments of the tree are joined two by two, independent segments in different threads (`threads=`), with the same bits in any
number of threads. It is meant for many cores; on the measured machine the articulated method is faster.

```python
>>> import numpy as np
>>> import pycraft as pc
>>> arm = pc.tree([-1, 0, 1, 1, 3, 0], "pin", seed=1)
>>> q, v, tau = arm.random_state(seed=0).q, np.ones(6), np.ones(6)
>>> divided = arm.forward_dynamics(q, v, tau, method="divide-and-conquer", threads=2)
>>> np.allclose(divided, arm.forward_dynamics(q, v, tau), rtol=1e-12)
True

```

## Method

A segment is a chain of bodies with all branches. Whatever is inside, it has two handles, the body p that carries it
and its own last body j, and behaves like a single body (`cpp/recursions/divide_and_conquer.h` has every equation):

```
f = P α(p) + ψ F + z        α(j) = ψ* α(p) - Υ F + y
```

P, ψ and Υ are the book's P⁺, ψ and Υ within the segment. Two segments are joined by eliminating the rows of Υ₁ from P₂ like the rows of
a hinge, with 1/u of Υ₁ = Σ u h*h in place of a rotor inertia. Featherstone's algorithm [Int. J. Robotics Research 18(9), 1999]
has forces at both handles and inverts inertias; here only D is inverted, and massless links and welds are ordinary links: an
inertia of the size of the outboard bodies is lent to a segment's last body, and subtracted again from the segment that is joined there.

The order is an assembly tree (`cpp/dynamics/assembly_tree.h`): every body is on a chain with its largest subtree; chains and the branches
of a body are halved by the number of bodies. Its depth is at most 6 log₂ N + 4 over any tree, log₂ N + 1 for a chain, below 3 log₂ N + 4
for the stars, combs, balanced and random trees of up to 10⁶ bodies that `cpp/tests/test_assembly_tree.cpp` tries. Rotations, angular
velocities, inertias and accelerations are all computed along it: four passes, none of which visits the tree from end to end.

## Accuracy

No pivot and no spread of inertias shows how many digits of a solution are correct; its residual does. After every solution θ̈

```
r = T - (ℳ + J) θ̈ - 𝒞        δ = (ℳ + J)⁻¹ r
```

are formed, r by the two sweeps of Newton–Euler with forces gathered in a wider precision, δ with the existing segments. If |δ| is at most
100 eps √nv |θ̈|, the loss without cancellation, the solution is accepted. Otherwise δ is added, as long as it shrinks and exceeds the
possible rounding of r, and the remaining error is bounded: by the last δ, or by the largest correction in any direction that this
rounding can produce (`cpp/algebra/trees/sweeps/residual_rounding.h`). A solution that may be wrong beyond six digits (64 √eps) is refused
with an error that names the hinge where the digits were lost. So a tip of 10⁹ times the mass is solved to rounding, one of 10¹² on ten
links to six digits or refused, and with heavier tips rounding hides the loss from the residual; `form="ud"` of the articulated method
keeps all digits. `tests/dynamics/test_divide_and_conquer.py` asserts this, and on well-proportioned trees ten times the errors of the
fast form, or 100 eps √N where the fast form happens to be more accurate.

Accelerations that are zero up to rounding, of bodies at rest under forces that cancel, have no digits of their own: the accepted error is
100 eps √nv of gravity, ω² and forces over inertias.

Where a pivot is so small that it may be noise, the articulated-body algorithm also runs, one thread, O(N): it names the hinge that
feels no inertia. There is no form and no option of refinement.

## Cost

Written by `python tests/campaigns/divide_and_conquer.py`: the figures are measured, none is typed by hand. Machine: {machine}, {cores}
cores, Python {python}; double precision, one state, links on pins, microseconds per link of the fastest of several calls. Over: divide and
conquer over the articulated method, one thread each. Apart: the relative difference of the accelerations.

| tree | links | articulated | on {threads} threads | divide and conquer | on {threads} threads | over | apart |
| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
{rows}

Load average of the last five minutes at the end: {load}. Above 1 other work used part of the cores, and the columns on two threads,
their gain and the estimate by Amdahl's law are not properties of the method; run the script on a quiet machine.

The method does not pay on this machine. A join takes 1,400 to 4,000 operations and its segment a kilobyte; a link of the articulated
method takes some 400, in kernels of the machine's instruction set. On a chain of {links} links that is {ratio} times the time on one
thread; two threads gain {gain}. With no other loss it takes {ideal} cores to draw level; by Amdahl's law, with the share of {serial} that
two threads leave serial here, {least}. The critical path is {depth} joins a pass instead of {links} links, but threads are started six
times a state, some 50 µs each time, and the residual is one thread's sweep: below 10⁴ links threads gain nothing.

Batches do not need this method: `threads=` shares their states out with the articulated method, in packs, and it also shares out trees with
several large subtrees. The remaining use is one state of one very long chain on a machine with many cores.
"""


def comb(links: int) -> list[int]:
    """A backbone with teeth, as long each as there are teeth."""
    length = max(round(links**0.5), 1)
    return [k - 1 if k % length else k - length if k else -1 for k in range(links)]


SHAPES: dict[str, Callable[[int], list[int]]] = {
    "chain": lambda links: list(range(-1, links - 1)),
    "balanced": lambda links: [(k - 1) // 2 if k else -1 for k in range(links)],
    "comb": comb,
}


def seconds(call: Callable[[], object], rounds: int) -> float:
    """Of the fastest of so many calls after the first."""
    call()
    best = float("inf")
    for _ in range(rounds):
        start = perf_counter()
        call()
        best = min(best, perf_counter() - start)
    return best


def measured(shape: str, links: int, rounds: int) -> tuple[str, dict[str, float]]:
    """A row of the table, and what it says as numbers."""
    model = pc.tree(SHAPES[shape](links), "pin", seed=1)
    model.gravity = (0, 0, -9.81)
    rng = np.random.default_rng(links)
    q, v, tau = (rng.uniform(-1, 1, links) for _ in range(3))
    ways = {
        (method, threads): lambda method=method, threads=threads: model.forward_dynamics(q, v, tau, method=method, threads=threads)
        for method in ("articulated", "divide-and-conquer")
        for threads in (1, THREADS)
    }
    values = {way: call() for way, call in ways.items()}
    one, two = values["divide-and-conquer", 1], values["divide-and-conquer", THREADS]
    assert np.array_equal(one, two), "threads change bits"
    off = np.linalg.norm(one - values["articulated", 1]) / np.linalg.norm(one)
    times = {way: seconds(call, max(rounds, 20 if links <= 10_000 else 0)) * 1e6 / links for way, call in ways.items()}
    divided, plain = times["divide-and-conquer", 1], times["articulated", 1]
    cells = [times["articulated", 1], times["articulated", THREADS], divided, times["divide-and-conquer", THREADS]]
    row = f"| {shape} | {links:,} | " + " | ".join(f"{t:.3f}" for t in cells) + f" | {divided / plain:.0f} | {off:.0e} |"
    return row, {"ratio": divided / plain, "gain": divided / times["divide-and-conquer", THREADS]}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--page", type=Path, default=Path("docs/divide_and_conquer.md"))
    parser.add_argument("--largest", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    rows, found = [], {}
    for shape in SHAPES:
        for links in (100, 1_000, 10_000, 100_000, 1_000_000):
            if links <= arguments.largest:
                row, found[shape, links] = measured(shape, links, arguments.rounds)
                rows.append(row)
                print(row, flush=True)
    largest = max(links for shape, links in found if shape == "chain")
    ratio, gain = found["chain", largest]["ratio"], found["chain", largest]["gain"]
    serial = max(0.0, min(1.0, 2 / gain - 1))  # Amdahl on two threads: gain = 1 / (s + (1 - s)/2)
    least = (1 - serial) / (1 / ratio - serial) if serial * ratio < 1 else None
    page = PAGE.format(
        load=f"{os.getloadavg()[1]:.1f}",
        machine=platform.machine(),
        cores=cores(),
        python=platform.python_version(),
        rows="\n".join(rows),
        ratio=f"{ratio:.0f}",
        links=f"{largest:,}",
        gain=f"{gain:.2f}",
        serial=f"{100 * serial:.0f} %",
        least="no number of cores" if least is None else f"{np.ceil(least):.0f} cores",
        ideal=f"{np.ceil(ratio):.0f}",
        threads=THREADS,
        depth=f"{np.ceil(log2(largest)) + 1:.0f}",
    )
    arguments.page.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
