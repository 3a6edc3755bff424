"""Sweeps on a Dask cluster of this machine: the bits of threads, a worker that is killed, an address where none answers."""

import numpy as np
import pytest

import pycraft as pc
from support import sweeps

distributed = pytest.importorskip("distributed")
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def client():
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=2, dashboard_address=":0")
    with distributed.Client(cluster) as made:
        yield made
    cluster.close()


def test_the_bits_of_threads(client):
    scene = pc.mechanisms.double_pendulum()
    samples = pc.samples.states(scene.model, 20) | {"effects.gravity.g[1]": np.linspace(-9, -10, 20)}
    here, there = (pc.sweep(scene, samples, 0.2, on=on, progress=False) for on in ("threads", client))
    assert all(np.array_equal(here[name], there[name]) for name in here)
    by_address = pc.sweep(scene, samples, 0.2, on=client.scheduler.address, progress=False)
    assert np.array_equal(here["end.q"], by_address["end.q"])


def test_functions_of_a_notebook_go_along(client):
    offset = 3.0
    found = pc.sweep(lambda x: x + offset, {"x": [1, 2]}, on=client, progress=False)
    assert found["value"].tolist() == [4, 5]


def test_a_worker_that_dies(client, tmp_path):
    found = pc.sweep(sweeps.die_once, {"x": list(range(12)), "folder": [str(tmp_path)] * 12}, on=client, progress=False)
    assert (tmp_path / "died").exists() and not found.failures and found["value"].tolist() == [i * i for i in range(12)]


def test_failures_are_told_of(client):
    found = pc.sweep(sweeps.root, {"x": [4.0, -1.0]}, on=client, progress=False)
    assert found["value"][0] == 2 and [f.reason for f in found.failures] == ["ValueError: -1 has no root"]


def test_a_cluster_of_its_own():
    found = pc.sweep(sweeps.square, {"x": [1.0, 2.0, 3.0]}, on="dask", workers=1, progress=False)
    assert found["square"].tolist() == [1, 4, 9]


def test_no_scheduler(monkeypatch):
    from pycraft.ensembles import backends

    monkeypatch.setattr(backends, "PATIENCE", 1)
    with pytest.raises(pc.EvaluationError, match="no Dask scheduler answers at this address"):
        pc.sweep(sweeps.square, {"x": [1.0]}, on="tcp://127.0.0.1:9", progress=False)
