"""Functions of the sweeps in tests, which other processes import."""

import os
import signal
import time
from pathlib import Path


def square(x):
    return {"square": x * x, "powers": [x, x**2, x**3]}


def root(x):
    if x < 0:
        raise ValueError(f"{x:g} has no root")
    return x**0.5


def root_of(x):
    return float(x) ** 0.5


def slow_square(x, folder):
    """Writes down that it ran."""
    time.sleep(0.02)
    with (Path(folder) / "ran.txt").open("a") as file:
        file.write(f"{x:g}\n")
    return x * x


def die_once(x, folder):
    """The sample 3 takes its process with it, the first time."""
    there = Path(folder) / "died"
    if x == 3 and not there.exists():
        there.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return x * x


def die_always(x):
    if x == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return x * x


def ends(run):
    """A measure."""
    return {"last": run.q[-1], "count": len(run.t)}


def check_statement(model, statement):
    import pycraft as pc

    report = pc.check(statement, model)
    return {"true": bool(report), "bodies": len(model.bodies)}


if __name__ == "__main__":  # a sweep to be killed: folder, samples, workers
    import sys

    import pycraft as pc
    from support import sweeps

    folder, count, on = sys.argv[1], int(sys.argv[2]), sys.argv[3]
    pc.sweep(
        sweeps.slow_square, {"x": list(range(count)), "folder": [folder] * count}, output=f"{folder}/out", on=on, workers=2, progress=False
    )
