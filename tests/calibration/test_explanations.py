"""What is said of a scan that fails a check of the Gaussian."""

import re
from dataclasses import replace

import pytest
from helpers.outside import ROUND
from helpers.outside import scan as outside_scan
from helpers.scans import LINEAR_FILM, simulated

import memscal
from memscal.calibration.explanations import DEPARTURE, explanation
from memscal.cli.output import emit_result


@pytest.fixture(scope="module")
def wrong():
    """A calibration of a film that is thicker by a tenth than it states."""
    film = replace(LINEAR_FILM, thickness=1.1 * LINEAR_FILM.thickness)
    made = simulated(film=film, load=0.05, noise=0.001, seed=2)
    return memscal.calibrate(replace(made, film=LINEAR_FILM))


def test_a_wrong_thickness_is_named_with_its_size(wrong):
    rows = {row["name"]: row for row in wrong.to_dict()["explanations"]}
    assert rows["thickness"]["named"]
    assert re.match(r"a film of \(2\.[12]\d* ± 0\.0\d+\) mm", rows["thickness"]["words"])
    factors = [row["log_bayes_factor"] for row in rows.values()]
    assert factors == sorted(factors, reverse=True)
    assert rows["thickness"]["log_bayes_factor"] > rows["baseline_curvature"]["log_bayes_factor"]


def test_a_curved_baseline_is_named_with_its_whole_size():
    world = replace(ROUND, parabola=0.03)
    rows = memscal.calibrate(outside_scan(world, 1)).to_dict()["explanations"]
    said = next(row for row in rows if row["name"] == "baseline_curvature")["words"]
    size = re.fullmatch(r"a baseline that bends by (\S+) ± (\S+) of the largest signal", said)
    assert abs(float(size[1]) - 0.03) < 2 * float(size[2])


def test_first_lines_checks_and_report_say_so(wrong):
    words = wrong.to_dict()["explanations"][0]["words"]
    first, second = wrong.answer().splitlines()
    assert "which A to use is not settled" in first
    assert words in second
    assert second.endswith("or by a cause that is not listed.")
    failed = [check for check in wrong.apparatus.checks if check.name == "gaussian_evidence"]
    assert words in failed[0].meaning
    assert not any("G is not Gaussian, so" in check.meaning for check in wrong.apparatus.checks)
    assert "ln of the Bayes factor" in wrong.report()


def test_an_artifact_keeps_what_was_weighed(wrong, tmp_path):
    wrong.apparatus.save(tmp_path / "sensor.h5")
    read = memscal.load_apparatus(tmp_path / "sensor.h5")
    assert read.to_dict()["explanations"] == wrong.to_dict()["explanations"]
    assert read.answer() == wrong.answer()


def test_nothing_is_weighed_where_the_checks_pass():
    good = memscal.calibrate(simulated(seed=3, load=0.05))
    assert "explanations" not in good.to_dict()
    assert "suffices" in good.answer()


def row(name, named=True):
    return {"name": name, "words": f"a {name}", "named": named}


@pytest.mark.parametrize(
    ("rows", "text"),
    [
        ([row(DEPARTURE), row("lag", named=False)], "by a departure, or"),
        (
            [row("lag"), row(DEPARTURE), row("film")],
            "departure; as well explained by a lag or a film,",
        ),
        ([row("lag"), row(DEPARTURE, named=False)], "by a lag, better than by a G that is not"),
        ([row("lag", named=False)], "nothing that was weighed, but by larger or slower noise, or"),
    ],
)
def test_the_sentence_says_what_is_as_good(rows, text):
    assert text in explanation(rows)
    assert explanation(rows).endswith("or by a cause that is not listed.")


def with_failed(apparatus, *names):
    checks = [replace(check, passed=check.name not in names) for check in apparatus.checks]
    return replace(apparatus, checks=tuple(checks))


def test_use_a_is_said_only_where_no_check_of_a_or_g_failed():
    good = memscal.calibrate(simulated(seed=3, load=0.05)).apparatus
    assert len(good.checks) > 15
    for check in good.checks:
        doubtful = with_failed(good, check.name)
        assert "Use A = " not in doubtful.summary(), check.name
        assert doubtful.answer().startswith("A = ")


@pytest.mark.parametrize("names", [(), ("symmetry",), ("gaussian_misfit",)])
def test_a_page_says_use_a_where_its_answer_does(names):
    doubtful = with_failed(memscal.calibrate(simulated(seed=3, load=0.05)).apparatus, *names)
    for page in (doubtful._repr_html_(), doubtful.report()):
        assert ("Use A = " in page) == (not names)


def test_a_brief_answer_has_four_lines_whatever_failed(capsys):
    good = memscal.calibrate(simulated(seed=3, load=0.05)).apparatus
    worst = with_failed(good, *(check.name for check in good.checks))
    emit_result(worst, {}, as_json=False, brief=True)
    lines = capsys.readouterr().out.splitlines()
    assert 1 < len(lines) <= 4
    assert lines[0].startswith("A = ")
    assert "checks FAILED" in " ".join(lines)
