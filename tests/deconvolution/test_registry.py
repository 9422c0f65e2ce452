"""Regularisers by name: ours, others', and the names that do not exist."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.folders import SHIPPED

import memscal
from memscal.cli import main
from memscal.deconvolution.division import create_regulariser, regulariser_names
from memscal.errors import InputError

PLUG_IN = '''
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from memscal.deconvolution.division import filtered_division


@dataclass(frozen=True, kw_only=True)
class Cutoff:
    """A sharp edge in k."""

    k_max: float = 3e3
    name: ClassVar[str] = "cutoff"
    assumes: ClassVar[str] = "G is band-limited."
    fails: ClassVar[str] = "Rings."

    def divide(self, problem):
        return filtered_division(problem, np.where(problem.grid.wavenumber < self.k_max, 1.0, 0.0))


class Impostor:
    name = "tikhonov"
'''


@pytest.fixture
def plug_in(tmp_path, monkeypatch):
    """An installed distribution with two entry points, one of a name that is taken."""
    (tmp_path / "sharp_edges.py").write_text(PLUG_IN, encoding="utf-8")
    info = tmp_path / "sharp_edges-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: sharp-edges\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[memscal.regularisers]\ncutoff = sharp_edges:Cutoff\ntikhonov = sharp_edges:Impostor\n"
    )
    monkeypatch.syspath_prepend(tmp_path)


@pytest.mark.parametrize("name", regulariser_names())
def test_a_seed_reaches_only_those_that_draw(name):
    regulariser = create_regulariser(name, seed=41)
    draws = name == "white-noise-draw"
    assert getattr(regulariser, "seed", None) == (41 if draws else None)
    assert create_regulariser(name, seed=np.int64(41)) == regulariser


def test_the_former_name_of_the_bayesian_method_is_an_alias():
    assert create_regulariser("evidence", monotone=True) == create_regulariser(
        "bayesian", monotone=True
    )
    assert "evidence" not in regulariser_names()


def test_an_unknown_name_is_refused_with_the_names_there_are():
    with pytest.raises(InputError, match="no method named landweber") as caught:
        create_regulariser("landweber")
    for name in regulariser_names():
        assert name in caught.value.cure


@pytest.mark.parametrize("name", ["unsupervised-wiener", "richardson-lucy"])
def test_a_method_that_left_is_refused_with_the_page_that_has_it(name):
    with pytest.raises(InputError, match=f"no method named {name}") as caught:
        create_regulariser(name)
    page = SHIPPED.with_name("docs") / "own_method.md"
    assert f"docs/{page.name}" in caught.value.cure
    assert f'= "{name}"' in page.read_text(encoding="utf-8")


def test_an_artifact_of_a_method_that_left_is_read_and_inspected(tmp_path, monkeypatch, capsys):
    apparatus = memscal.load_apparatus(SHIPPED / "rod_scan_65.apparatus.h5")
    configuration = {**apparatus.process.configuration, "method": "richardson-lucy"}
    configuration["options"] = {"iterations": 80}
    process = replace(apparatus.process, configuration=configuration)
    monkeypatch.chdir(tmp_path)
    replace(apparatus, process=process).save("old.h5")
    opened = memscal.load_apparatus("old.h5")
    assert opened.process.configuration == configuration
    assert "richardson-lucy" in str(opened)
    assert main(["inspect", "old.h5"]) == 0
    assert "richardson-lucy" in capsys.readouterr().out


def test_an_unknown_option_is_refused_with_the_options_there_are():
    with pytest.raises(InputError, match="tikhonov has no option alpha, beta") as caught:
        create_regulariser("tikhonov", beta=1, alpha=1, amplitude=2)
    assert "amplitude" in caught.value.cure


@pytest.mark.usefixtures("plug_in")
def test_a_plug_in_is_listed_and_created_with_its_options_and_without_the_seed():
    assert regulariser_names().index("cutoff") == len(regulariser_names()) - 1
    regulariser = create_regulariser("cutoff", k_max=2e3, seed=3)
    assert type(regulariser).__module__ == "sharp_edges"
    assert regulariser.k_max == 2e3


@pytest.mark.usefixtures("plug_in")
def test_a_plug_in_cannot_take_a_name_of_ours():
    assert type(create_regulariser("tikhonov")).__module__ == "memscal.deconvolution.division"


@pytest.mark.parametrize(("name", "options"), [
    ("white-noise", {"amplitude": 0.0}), ("white-noise-draw", {"amplitude": float("nan")}),
    ("tikhonov", {"amplitude": "x"}), ("wiener", {"amplitude": -1.0}),
    ("white-noise-draw", {"seed": -1}),
    ("tikhonov", {"name": "x"}),
])  # fmt: skip
def test_senseless_options_are_refused(name, options):
    with pytest.raises(InputError):
        create_regulariser(name, **options)
