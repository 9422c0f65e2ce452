"""Calibrations made of Gaussians, whose convolutions and transforms have closed forms."""

import functools
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.builders import make_artifact, scan_points
from matplotlib.figure import Figure

from memscal import ApparatusRadial, Reconvolution, TransferFunction
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.figures.calibration import calibration_figure
from memscal.model.apparatus import ApparatusData, ApparatusField, ParameterSet
from memscal.model.checks import Message, QualityCheck
from memscal.model.scan import StressSensor
from memscal.model.stress import StressProfile

MakeApparatus = Callable[..., ApparatusData]

_LOAD = 1.0
_WIDTH = 0.9e-3  # of the reference stress
_PARTS = ((0.85, 0.50e-3), (0.15, 0.85e-3))  # G: two Gaussians, so that no single one is right
_SIGMA = 0.561e-3
_CONSTANT = 3.0e-8  # V/Pa
_CENTRE = 0.14e-3
_BASELINE = 4.0e-5


def voltage(r: Any, parts: tuple[tuple[float, float], ...]) -> Any:
    """Return baseline + A (G * sigma_zz): the convolution of Gaussians is a Gaussian."""
    stress = _LOAD * sum(w * unit_gaussian(r, float(np.hypot(_WIDTH, s))) for w, s in parts)
    return _BASELINE + _CONSTANT * stress


def reconvolution(kind: str, points: int, noise: float, seed: int) -> Reconvolution:
    """Return a line scan, or a raster by distance from the centre."""
    rng = np.random.default_rng(seed)
    x = np.linspace(-8e-3, 8e-3, points)
    r = np.abs(x - _CENTRE)
    if kind == "radii":
        xx, yy = np.meshgrid(x, x)
        r = np.hypot(xx - _CENTRE, yy).ravel()
        x = r
    clean = voltage(r, _PARTS)
    single = voltage(r, ((1.0, _SIGMA),))
    spread = noise * float(np.max(clean))
    u = clean + rng.normal(0.0, spread, r.size)
    plane: dict[str, Any] = {}
    if kind == "radii":
        plane = {"offset_x": xx.ravel() - _CENTRE, "offset_y": yy.ravel()}
        plane |= {"load": np.full(r.size, _LOAD), "background": np.full(r.size, _BASELINE)}
    return Reconvolution(
        x=x,
        u_zz=u,
        u_zz_errors=np.full(r.size, spread),
        u_zz_predicted=clean,
        u_zz_gaussian=single,
        residual=u - clean,
        **plane,
    )


def at_loads(scan: Reconvolution, loads: Sequence[float]) -> Reconvolution:
    """Return the points at each of several loads (N), with voltages in proportion."""
    if not len(loads):
        return scan
    n = scan.x.size
    load = np.repeat(loads, n) * (1 + 5e-3 * np.tile(np.linspace(-1, 1, n), len(loads)))
    scan = scan_points(scan, np.tile(np.arange(n), len(loads)))
    named = {n: getattr(scan, n) * load for n in ("u_zz", "u_zz_predicted", "u_zz_gaussian")}
    return replace(scan, **named, load=load, background=np.zeros(load.size))


def radial_profile(error: float, ripple: float) -> ApparatusRadial:
    """Return G(r) with a standard uncertainty of a share of its maximum, and a ripple."""
    r = np.linspace(0.0, 8e-3, 321)
    g = sum(w * unit_gaussian(r, s) for w, s in _PARTS)
    g = g + ripple * g[0] * np.cos(3500.0 * r) * np.exp(-r / 4e-3)
    errors = error * g[0] * (0.4 + 0.6 * np.exp(-r / 1e-3))
    return ApparatusRadial(r, g, errors, unit_gaussian(r, _SIGMA), np.diag(errors**2))


def transfer_function(resolved: float) -> TransferFunction:
    """Return the closed-form transform of the two Gaussians behind a smooth window."""
    k = np.linspace(0.0, 12e3, 241)
    window = 1.0 / (1.0 + (k / resolved) ** 12)
    modulus = sum(w * np.exp(-0.5 * (s * k) ** 2) for w, s in _PARTS) * window
    return TransferFunction(k, modulus, 0.004 * np.exp(k / 2.2e3) * window, window, resolved)


def build(
    kind: str = "line",
    points: int = 65,
    *,
    noise: float = 0.005,
    seed: int = 1,
    error: float = 0.03,
    ripple: float = 0.0,
    failed: int = 0,
    sensor: StressSensor | None = None,
    meaning: str = "The scan is not explained to within its noise.",
    message: str = "1 outlier was down-weighted at x = 2.25 mm.",
    loads: Sequence[float] = (),
) -> ApparatusData:
    """Return the data of a calibration that never ran."""
    grid = np.linspace(-3e-3, 3e-3, 61)
    g = sum(w * unit_gaussian(np.hypot(grid, grid[:, None]), s) for w, s in _PARTS)
    names = ("reconvolution", "symmetry", "tail_share", "resolved_band", "gaussian_misfit")
    values = {
        "conversion_constant": (_CONSTANT, 1.3e-10),
        "gaussian_sigma": (_SIGMA, 3.4e-6),
        "gaussian_sigma_deconvolved": (0.544e-3, 5.1e-6),
        "centre": (_CENTRE, 4.2e-6),
        "baseline": (_BASELINE, 1.1e-6),
    }
    if kind != "line":
        values["centre_y"] = (0.0, 4.4e-6)
    numbers, spreads = np.array(list(values.values())).T
    r = np.linspace(0.0, 10e-3, 201)
    data = make_artifact()
    contact = {"film": data.film, "indenter": data.indenter}
    stress = _LOAD * unit_gaussian(r, _WIDTH)
    reference = StressProfile(r=r, sigma_zz=stress, load=_LOAD, **contact)
    return replace(
        data,
        plane=ApparatusField(x=grid, y=grid, g=g, g_errors=np.full(g.shape, error * g.max())),
        radial_profile=radial_profile(error, ripple),
        transfer=transfer_function(3.7e3),
        reconvolution=at_loads(reconvolution(kind, points, noise, seed), loads),
        parameters=ParameterSet(tuple(values), numbers, np.diag(spreads**2)),
        checks=tuple(
            QualityCheck(name, 1.7 if i < failed else 0.41, 1.0, i >= failed, meaning)
            for i, name in enumerate(names)
        ),
        sensor=sensor or StressSensor(name="array 3", model="MEMS membrane", channel="zz"),
        reference=reference,
        process=replace(data.process, messages=(Message("outlier", message),)),
        budget={
            "conversion_constant": {"noise": 9e-11, "load": 6e-11, "film thickness": 7e-11},
            "gaussian_sigma": {"noise": 2.4e-6, "load": 0.0, "film thickness": 2.4e-6},
        },
    )


@pytest.fixture(name="make_apparatus", scope="session")
def make_apparatus_fixture() -> MakeApparatus:
    """Return the builder of calibrations."""
    return build


@pytest.fixture(name="drawn", scope="session")
def drawn_fixture() -> Callable[..., Figure]:
    """Return the figure of a calibration, drawn once for all tests that only look at it."""

    @functools.cache
    def drawn(*args: Any, **kwargs: Any) -> Figure:
        return calibration_figure(build(*args, **kwargs))

    return drawn
