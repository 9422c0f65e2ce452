"""Small self-consistent objects that many tests need."""

from dataclasses import replace

import numpy as np

import memscal
from memscal import (
    ElasticFilm,
    Message,
    Process,
    QualityCheck,
    Rod,
    Scan,
    SourceFile,
    StressProfile,
    StressSensor,
    Sweep,
)
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.model.apparatus import (
    ApparatusData,
    ApparatusField,
    ApparatusRadial,
    ParameterSet,
    Reconvolution,
)

SIGMA = 561e-6
CONVERSION = 3.0e-8


BARE = {
    **dict.fromkeys(("u_zz_errors", "normal_load", "load_uncertainty", "reference", "synthetic")),
    **dict.fromkeys(("title", "start_time", "end_time", "notes"), ""),
    "channels": {},
    "load_cell": memscal.LoadCell(),
    "stage": memscal.Equipment(),
    "user": memscal.User(),
}
"""Changes that leave a scan without all that is optional."""


def make_film(**changes) -> ElasticFilm:
    """The paper's film."""
    film = ElasticFilm(
        young_modulus=2.2e6,
        poisson_ratio=0.5,
        thickness=2e-3,
        roughness_rms=1.82e-6,
        young_modulus_uncertainty=0.1e6,
        thickness_uncertainty=20e-6,
        law="mooney-rivlin",
        mooney_rivlin_ratio=0.2,
    )
    return replace(film, **changes)


def make_profile(**changes) -> StressProfile:
    """A Gaussian stress that carries 1 N."""
    r = np.linspace(0.0, 10e-3, 101)
    width = 1.0e-3
    sigma = unit_gaussian(r, width)
    profile = StressProfile(
        r=r,
        sigma_zz=sigma,
        sigma_rz=sigma * r / width * 0.1,
        load=1.0,
        depth=0.587e-3,
        contact_radius=0.25e-3,
        stick_radius=0.0,
        friction_coefficient=0.0,
        loading="incremental",
        film=make_film(),
        indenter=Rod(radius=0.25e-3),
        solver="closed form",
        discretisation="none",
        convergence=1e-9,
    )
    return replace(profile, **changes)


def make_scan(kind="line", **changes) -> Scan:
    """A Gaussian response: a line, repeats, a raster or points; with a missing point."""
    x = np.linspace(-8e-3, 8e-3, 33)
    y = np.linspace(-4e-3, 4e-3, 9)
    u = 3e-3 * np.exp(-(x**2) / (2 * 1.2e-3**2))
    if kind == "repeats":
        u = np.stack([u, 1.01 * u, 0.99 * u])
    elif kind == "raster":
        u = u * np.exp(-(y[:, None] ** 2) / (2 * 1.2e-3**2))
    elif kind == "points":
        y = np.linspace(-4e-3, 4e-3, 33)[np.arange(33) * 7 % 33]
        u = u * np.exp(-(y**2) / (2 * 1.2e-3**2))
    u = u.copy()
    u[..., 5] = np.nan
    scan = Scan(
        x=x,
        y=y if kind in ("raster", "points") else None,
        repeat=np.arange(33) % 3 + 1 if kind == "points" else None,
        u_zz=u,
        u_zz_errors=np.full(u.shape, 1e-5),
        normal_load=np.full(u.shape, 1.01),
        channels={"u_xz": 0.1 * u},
        load=1.0,
        load_uncertainty=0.01,
        indenter=Rod(radius=0.25e-3, radius_uncertainty=1e-6),
        rod_friction=np.inf,
        film=make_film(),
        sensor=StressSensor(
            name="S1",
            model="MEMS",
            channel="zz",
            serial_number="17",
            manufacturer="a foundry",
            temperature=296.2,
            temperature_uncertainty=0.3,
        ),
        title="A scan",
        stage=memscal.Equipment(name="stage", serial_number="8", certificate_date="2024-01-31"),
        user=memscal.User(name="who measured", affiliation="a laboratory"),
        load_cell=memscal.LoadCell(name="balance", serial_number="7", certificate="2024-11"),
        start_time="2024-01-02T03:04:05+00:00",
        end_time="2024-01-02T04:04:05+00:00",
        notes="Two lines\nof notes, with an é.",
        reference=make_profile(),
        synthetic={"conversion_constant": CONVERSION, "gaussian_sigma": SIGMA, "shape": "gaussian"},
    )
    return replace(scan, **changes)


def make_artifact(**changes) -> ApparatusData:
    """A Gaussian apparatus function of 561 um in all its views."""
    x = np.linspace(-4e-3, 4e-3, 33)
    y = np.linspace(-3e-3, 3e-3, 25)
    step = (x[1] - x[0]) * (y[1] - y[0])
    g = np.exp(-(x[None, :] ** 2 + y[:, None] ** 2) / (2 * SIGMA**2))
    g /= g.sum() * step
    r = np.linspace(0.0, 4e-3, 41)
    radial = unit_gaussian(r, SIGMA)
    errors = 0.01 * radial.max() * np.ones_like(r)
    k = np.linspace(0.0, 6e3, 31)
    modulus = np.exp(-(k**2) * SIGMA**2 / 2)
    window = np.where(k < 3.7e3, 1.0, 0.1)
    values = {
        "conversion_constant": CONVERSION,
        "gaussian_sigma": SIGMA,
        "gaussian_sigma_deconvolved": 1.01 * SIGMA,
        "centre": 1e-5,
        "baseline": 2e-6,
    }
    covariance = np.diag([1e-20, 1e-12, 4e-12, 1e-12, 1e-14])
    stamp = {"program": "memscal", "version": "0.1.0", "date": "2024-01-02T03:04:05+00:00"}
    of_a = {"noise": 1e-10, "load": 3e-10}
    budget = {"conversion_constant": of_a, "gaussian_sigma": {"noise": 1e-6}}
    scan = make_scan()
    voltage = np.nan_to_num(scan.u_zz)
    data = ApparatusData(
        plane=ApparatusField(x=x, y=y, g=g, g_errors=0.01 * g, g_scatter=0.005 * g),
        radial_profile=ApparatusRadial(r, radial, errors, radial, np.diag(errors**2)),
        transfer=memscal.TransferFunction(k, modulus, 0.01 * modulus, window, 3.7e3),
        reconvolution=memscal.Reconvolution(
            *(scan.x, scan.u_zz, np.full(33, 1e-5), voltage, 1.001 * voltage),
            *(scan.u_zz - voltage, scan.x - 1e-5, 0.1 * scan.x, np.ones(33), 0.01 * voltage),
        ),
        parameters=ParameterSet(tuple(values), np.array(list(values.values())), covariance),
        checks=(
            QualityCheck("reconvolution", 0.004, 0.02, True, "The scan is met."),
            QualityCheck("symmetry", 0.05, 0.03, False, "Left and right differ."),
        ),
        film=make_film(),
        indenter=Rod(radius=0.25e-3),
        sensor=StressSensor(name="S1", model="MEMS"),
        load_cell=memscal.LoadCell(serial_number="7"),
        stage=scan.stage,
        user=scan.user,
        start_time=scan.start_time,
        load=1.0,
        reference=make_profile(),
        process=Process(
            **stamp,
            configuration={"method": "white-noise", "seed": None, "noise": 0.1},
            environment={"python": "3.11"},
            messages=(Message("outlier", "Two points were down-weighted.", "warning"),),
            input_scan=SourceFile("scan.h5", "0" * 64),
        ),
        budget=budget,
    )
    return replace(data, **changes)


def scan_points(scan: Reconvolution, chosen) -> Reconvolution:
    """Return the points with these numbers."""
    return replace(scan, **{n: v[chosen] for n, v in vars(scan).items() if v is not None})


def make_sweep() -> Sweep:
    """A sweep of known numbers."""
    rng = np.random.default_rng(5)
    amplitude = np.logspace(-1, 1, 9)
    constant = 3e-8 * (1 - 0.002 * amplitude)
    sigma = 0.55e-3 * (1 + 0.01 * np.log(amplitude))
    misfit = 0.005 * (1 + 0.05 * amplitude)

    def draws(values):
        return values[:, None] * (1 + 0.01 * rng.normal(size=(9, 12)))

    return Sweep(
        amplitude=amplitude,
        conversion_constant=constant,
        gaussian_sigma_deconvolved=sigma,
        relative_rms=misfit,
        seed_conversion_constant=draws(constant),
        seed_gaussian_sigma=draws(sigma),
        seed_relative_rms=draws(misfit),
    )
