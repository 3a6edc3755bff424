"""How sweeps of scenes scale with workers on this machine: writes docs/scaling.md.

    python tests/campaigns/scaling.py [--page docs/scaling.md]

Three sweeps: of short runs in the core, of long ones, and of runs with an effect in Python; on threads, processes and Dask, with one
worker and as many as there are cores. Each result is compared with that of one thread, bit for bit. Then sweeps on one thread, runs one by
one and side by side in packs.
"""

import argparse
import platform
from pathlib import Path
from time import perf_counter
from unittest.mock import patch

import numpy as np

import pycraft as pc
from pycraft import _core
from pycraft.ensembles.backends import cores
from pycraft.ensembles.work import SceneWork

PAGE = """# Scaling of sweeps

Written by `python tests/campaigns/scaling.py`: the figures are measured, none is typed by hand. Machine: {machine}, {cores} cores,
Python {python}.

A sweep gives each worker a quarter of a second of runs at a time. The overhead is a Python call for each run (`Scene.simulate`,
its checks, its results), and, for processes and Dask, the start of the interpreters, which import the package, and the transfer of
results. Runs in the core release the GIL, so threads are the default; an effect or measure in Python holds the GIL, and needs
processes.

| sweep | on | workers | s | runs/s | over one thread |
| --- | --- | ---: | ---: | ---: | ---: |
{rows}

Starting workers is part of the time: {starts}. All give the same bits.

## Runs in packs

A thread takes {width} runs at a time and computes their accelerations together ([ensembles.md](ensembles.md)). One thread, {runs} runs,
the best of {rounds} sweeps each, taken in turns; all give the same bits:

| sweep | runs/s, one by one | runs/s, in packs | gain |
| --- | ---: | ---: | ---: |
{packs}

Only accelerations are computed together. They are most of the time of a single run, and the smaller part in a pack: effects with the poses
and twists that they read, the integrator's sums, the change from run to run, and the Python work per run are not shared. So the gain
is far less than the number of lanes, and less for short runs and small models.

## On a cluster

`on="dask"` starts a cluster on this machine, one worker per core. For an existing cluster, pass its address:

```python
pc.sweep(scene, samples, 10.0, on="tcp://scheduler:8786", output="runs/")
```

or a client, from any of Dask's ways of starting clusters (`dask-jobqueue` for SLURM and PBS, `dask-kubernetes`):

```python
from dask.distributed import Client
from dask_jobqueue import SLURMCluster

cluster = SLURMCluster(cores=32, processes=32, memory="64GB", walltime="02:00:00")
cluster.scale(jobs=10)
pc.sweep(scene, samples, 10.0, on=Client(cluster), output="runs/")
```

Workers need the package, and the modules that define functions; functions of a notebook are sent along. Each thread of a worker has its
own scene, so any number of threads is correct, and one is best for effects in Python. The calling process receives the results and writes
them: the folder is on its disk, and workers need no access to it. Dask replaces a lost worker, and its
runs are repeated. If a job's time ends, call it again with the same folder, and it continues.
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


RUNS, ROUNDS = 1024, 5


def pack_rows():
    """Of sweeps of one thread, one by one and in packs."""
    panda, E = pc.robots.panda(), pc.effects
    damped = pc.Scene(panda).add(E.Gravity(), E.Damping(0.5))
    pushed = pc.Scene(panda).add(E.Gravity(), E.Damping(0.5), E.Wrench(list(panda.bodies)[-1], [0, 0, 0, 5.0, 0, 0]))
    double = pc.mechanisms.double_pendulum()
    controlled, fixed = {"rtol": 1e-6, "atol": 1e-9}, {"integrator": "rk4", "step": 1e-3}
    cases = [
        ("panda with damping, 1 s, dopri5 (rtol 1e-6)", damped, 1.0, controlled),
        ("panda with damping, 1 s, rk4 (1 ms)", damped, 1.0, fixed),
        ("panda with damping and a push, 1 s, dopri5", pushed, 1.0, controlled),
        ("panda with damping, 0.1 s, dopri5", damped, 0.1, controlled),
        ("double pendulum, 1 s, dopri5", double, 1.0, controlled),
    ]
    for name, scene, T, options in cases:
        samples = pc.samples.states(scene.model, RUNS)

        def seconds(scene=scene, samples=samples, T=T, options=options):
            start = perf_counter()
            found = pc.sweep(scene, samples, T, workers=1, progress=False, **options)
            return perf_counter() - start, found

        alone, packed = [], []
        for _ in range(ROUNDS):
            with patch.object(SceneWork, "one_by_one", lambda work: "for comparison"):
                alone.append(seconds())
            packed.append(seconds())
        (_, first), (_, found) = alone[0], packed[0]
        assert "in packs" in found.explain() and all(np.array_equal(first[key], found[key]) for key in first), name
        before, after = (min(each for each, _ in some) for some in (alone, packed))
        yield f"| {name} | {RUNS / before:.3g} | {RUNS / after:.3g} | {before / after:.2f} |"


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
    packs = []
    for row in pack_rows():
        print(row, flush=True)
        packs.append(row)
    told |= {"width": _core.pack_width(), "runs": RUNS, "rounds": ROUNDS, "packs": "\n".join(packs)}
    page.write_text(PAGE.format(rows="\n".join(rows), starts=", ".join(starts), **told), encoding="utf-8")


if __name__ == "__main__":
    main()
