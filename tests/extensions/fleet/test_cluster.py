"""Calibrations on a real Dask cluster of processes, of which one is killed half-way."""

import os
import signal
from threading import Thread
from time import sleep

import pandas as pd
import pytest
from distributed import Client, LocalCluster
from helpers.scans import simulate

import memscal
from memscal.cli import main

SCANS = 24


@pytest.fixture(scope="module")
def workers():
    """Two processes with one thread each; one that dies is started anew."""
    options = {"processes": True, "dashboard_address": None, "worker_dashboard_address": None}
    with LocalCluster(n_workers=2, threads_per_worker=1, **options) as local:
        yield local


@pytest.fixture(scope="module")
def scans(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scans")
    for seed in range(SCANS):
        scan = simulate(points=33, noise=0.004, seed=seed)
        memscal.write_scan(scan, folder / f"{seed:02}.h5")
    return folder


def pids(client):
    return client.run(os.getpid)


def test_scans_come_in_their_order_from_a_cluster_of_which_a_worker_is_killed(workers, scans):
    paths = sorted(scans.iterdir())
    with Client(workers) as client:
        executor = client.get_executor()
        results = memscal.calibrate_many(paths, executor, method="bayesian")
        first = next(results)
        os.kill(next(iter(pids(client).values())), signal.SIGKILL)
        rest = list(results)
    assert [result.index for result in (first, *rest)] == list(range(SCANS))
    last = memscal.calibrate(paths[-1], method="bayesian").apparatus
    assert rest[-1].apparatus.conversion_constant == pytest.approx(last.conversion_constant)


def test_a_batch_outlives_a_worker_that_is_killed(workers, scans, tmp_path, capsys):
    results = tmp_path / "results"
    address = workers.scheduler_address
    killed = []

    def kill():
        with Client(address) as client:
            victim = max(pids(client).values())
            while not list(results.glob("shards/*.parquet")):
                sleep(0.01)
            os.kill(victim, signal.SIGKILL)
            killed.append(victim)

    thread = Thread(target=kill)
    thread.start()
    line = [str(scans), "-o", str(results), "--scheduler", address, "--shard-size", "3"]
    code = main(["batch", *line])
    thread.join()
    assert killed
    rows = pd.read_parquet(results / "shards")
    assert code == int(not rows["passed"].all()), capsys.readouterr().err
    assert list(rows["place"]) == list(range(SCANS))
    assert rows["error"].isna().all()
