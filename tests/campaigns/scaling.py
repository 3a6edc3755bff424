"""How sweeps of scenes scale with workers on this machine: writes docs/scaling.md.

    python tests/campaigns/scaling.py [--page docs/scaling.md]

Three sweeps: of short runs in the core, of long ones, and of runs with an effect in Python; on threads, processes and Dask, with one
worker and as many as there are cores. Each result is compared with that of one thread, bit for bit.
"""

import argparse
import platform
from pathlib import Path
from time import perf_counter

import numpy as np

import pycraft as pc
from pycraft.ensembles.backends import cores

PAGE = """# How sweeps scale

Written by `python tests/campaigns/scaling.py`: the figures are measured, none is typed by hand. Machine: {machine}, {cores} cores,
Python {python}.

A sweep hands runs to workers a quarter of a second at a time. What it costs beside the runs: a Python call for each (`Scene.simulate`,
its checks, what is kept of it), and, for processes and Dask, the start of the interpreters, which import the package, and what comes
back. Runs are in the core and let other threads run, so threads are the default; an effect or measure in Python keeps the interpreter's
lock, and wants processes.

| sweep | on | workers | s | runs/s | over one thread |
| --- | --- | ---: | ---: | ---: | ---: |
{rows}

Starting workers is part of the time: {starts}. All give the same bits.

## On a cluster

`on="dask"` starts a cluster of this machine, a worker a core. Where there is one, its address is enough:

```python
pc.sweep(scene, samples, 10.0, on="tcp://scheduler:8786", output="runs/")
```

or a client that you have made, by any of Dask's ways of starting clusters (`dask-jobqueue` for SLURM and PBS, `dask-kubernetes`):

```python
from dask.distributed import Client
from dask_jobqueue import SLURMCluster

cluster = SLURMCluster(cores=32, processes=32, memory="64GB", walltime="02:00:00")
cluster.scale(jobs=10)
pc.sweep(scene, samples, 10.0, on=Client(cluster), output="runs/")
```

Workers need the package, and the modules that functions come from; functions of a notebook go along. Each thread of a worker has a
scene of its own, so any number of threads is right, and one is best where effects are in Python. Results come to the process that
called, which writes them: the folder is on its disk, and nobody else needs to see it. A worker that is lost is made good by Dask; what
it had is run again. A job whose time ends is called again with the same folder, and goes on.
"""


def pull(t, state):
    return [0.1 * np.sin(t)] * 2


def double_of(x):
    return 2 * x


def sweeps():
    """By name: a scene, samples and the length of a run."""
    double = pc.mechanisms.double_pendulum()
    panda = pc.Scene(pc.robots.panda()).add(pc.effects.Gravity(), pc.effects.Damping(0.5))
    by_python = pc.mechanisms.double_pendulum().add(pull)
    return {
        "double pendulum, 1 s": (double, pc.samples.states(double.model, 40000), 1.0),
        "panda with damping, 5 s": (panda, pc.samples.states(panda.model, 2000), 5.0),
        "double pendulum, an effect in Python, 1 s": (by_python, pc.samples.states(by_python.model, 4000), 1.0),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--page", type=Path, default=Path("docs/scaling.md"))
    page, count, rows, starts = parser.parse_args().page, cores(), [], []
    for name, (scene, samples, T) in sweeps().items():
        pc.sweep(scene, {key: values[:2] for key, values in samples.items()}, T, progress=False)
        first, alone = None, 0.0
        for on, workers in [("threads", 1), ("threads", count), ("processes", count), ("dask", count)]:
            start = perf_counter()
            found = pc.sweep(scene, samples, T, on=on, workers=workers, progress=False)
            seconds = perf_counter() - start
            first, alone = (found, seconds) if first is None else (first, alone)
            assert not found.failures and all(np.array_equal(first[key], found[key]) for key in first), (name, on)
            rows.append(f"| {name} | {on} | {workers} | {seconds:.3g} | {samples.count / seconds:.3g} | {alone / seconds:.2f} |")
            print(rows[-1], flush=True)
    for on in ("processes", "dask"):
        start = perf_counter()
        pc.sweep(double_of, {"x": [1.0]}, on=on, workers=count, progress=False)
        starts.append(f"{perf_counter() - start:.2g} s of {on}")
    told = {"machine": platform.processor() or platform.machine(), "cores": count, "python": platform.python_version()}
    page.write_text(PAGE.format(rows="\n".join(rows), starts=", ".join(starts), **told), encoding="utf-8")


if __name__ == "__main__":
    main()
