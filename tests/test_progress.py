"""Long work tells how much of it is done: to callbacks, to the log, and as a bar."""

import math
import types

import pytest
from helpers.scans import contact_scan, known_apparatus

import memscal
from memscal.progress import Task, reporting

FILM = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
SPHERE = memscal.Sphere(radius=128.8e-3)


def told(heard):
    return [(one.task, one.done, one.total) for one in heard]


def test_only_the_outermost_task_is_told_of():
    heard = []
    with reporting(heard.append):
        inner = (list(Task("inner", 2).counted("ab")) for _ in range(2))
        list(Task("outer", 2).counted(inner))
        Task("after", 1).tell(1)
    list(Task("unheard", 2).counted("ab"))
    assert told(heard) == [("outer", 1, 2), ("outer", 2, 2), ("after", 1, 1)]


def test_what_consumes_a_task_hears_of_its_own_work():
    heard = []
    with reporting(heard.append):
        for _ in Task("items", 2).counted("ab"):
            Task("own", 1).tell(1)
    assert told(heard) == [("items", 1, 2), ("own", 1, 1), ("items", 2, 2), ("own", 1, 1)]


def test_public_functions_tell_their_callback(tmp_path):
    heard = []
    sensor = known_apparatus(conversion_uncertainty=0.005, width_uncertainty=0.01)
    scan = contact_scan(load=(1.0, 2.0), film=sensor.film)
    stress = memscal.measure_stress(scan, sensor, progress=heard.append)
    assert told(heard) == [("loads", 1, 2), ("loads", 2, 2)]
    heard.clear()
    options = {"friction": (0.0, 0.2, math.inf), "loading": "total", "progress": heard.append}
    memscal.compare(stress, sensor, **options)
    assert set(told(heard)) == {("contacts", done, 6) for done in (2, 4, 6)}
    heard.clear()
    memscal.indent(FILM, SPHERE, load=[0.2, 0.7], friction=0.3, rings=24, progress=heard.append)
    assert ("loads", 2, 2) in told(heard)
    heard.clear()
    scans = [memscal.simulate(seed=1, points=17), "missing.h5"]
    results = memscal.calibrate_many(scans, progress=heard.append)
    assert [result.passed for result in results][1:] == [False]
    assert told(heard) == [("scans", 1, 2), ("scans", 2, 2)]
    heard.clear()
    memscal.calibrate(memscal.simulate(seed=1, points=17), progress=heard.append)
    inputs = [("uncertain inputs", done, 3) for done in (1, 2, 3)]
    assert told(heard) == [
        *(("steps", done, 5) for done in (1, 2, 3)),
        *inputs,
        ("steps", 4, 5),
        ("steps", 5, 5),
    ]
    heard.clear()
    with reporting(heard.append):
        memscal.design(noise=0.01, want={"sigma": 0.0335}, vary="repeats")
    assert {one.task for one in heard} == {"plans"}
    assert 2 <= heard[-1].done <= heard[-1].total


def test_a_bar_is_shown_in_a_notebook_and_a_line_elsewhere(capsys, monkeypatch):
    with reporting(True):
        list(Task("<draws>", 2).counted("ab"))
    assert capsys.readouterr().err.endswith(f"\r{'2 of 2 <draws>':<60}\n")
    pytest.importorskip("ipykernel")
    shell = types.SimpleNamespace(kernel=None)
    monkeypatch.setattr("IPython.get_ipython", lambda: shell)
    shown = []
    handle = types.SimpleNamespace(update=lambda page: shown.append(page.data))
    monkeypatch.setattr("IPython.display.display", lambda *_, **__: handle)
    with reporting(True):
        list(Task("<draws>", 2).counted("ab"))
    assert shown[-1] == '<progress value="2" max="2"></progress> 2 of 2 &lt;draws&gt;'
