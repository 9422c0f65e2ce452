"""Make the tables of this folder, which no memscal command makes: run by make.sh."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path

import numpy as np

import memscal

HERE = Path(__file__).parent

READ_ME = "See README.md in this folder for how it was made."


def write_table(
    path: Path, comments: Iterable[str], header: tuple[str, ...], rows: Iterable[tuple[str, ...]]
) -> None:
    """Write comments, a header and rows as comma-separated text."""
    with path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(f"# {line}\n" for line in comments)
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)


def messy_scan(path: Path) -> None:
    """Write a rod scan as it leaves an experiment: three repeats, and nothing quite in place."""
    conversion_constant, centre = 1e-7, -0.23  # V/Pa, mm
    rng = np.random.default_rng(2008)
    quiet = memscal.simulate(
        conversion_constant=conversion_constant,
        half_range=10e-3,
        points=4001,
        disturbances=memscal.Disturbances(noise=0.0, baseline=0.0, drift=0.0, centre=(0.0, 0.0)),
    )
    largest = quiet.u_zz.max() * 1e3

    repeat = np.repeat([1, 2, 3], 33)
    places = np.linspace(-8.0, 8.0, 33)
    # The second repeat runs back; the stage reports where it came to rest, to 2 um.
    x = np.concatenate([places, places[::-1], places]) + rng.normal(0.0, 2e-3, repeat.size)
    load = 1.0 + 0.005 * rng.standard_normal(repeat.size)
    u = load * np.interp(np.abs(x - centre), quiet.x * 1e3, quiet.u_zz * 1e3)
    u += largest * (-0.02 + 0.004 * x / 8.0) + rng.normal(0.0, 0.005 * largest, u.size)

    u[70] += 0.4 * largest  # an outlier, as when the table is knocked
    readings = [f"{value:.5f}" for value in u]
    for lost in (5, 40, 41):
        readings[lost] = ""
    readings[90] = "NaN"
    never_taken = {12, 13, 60}
    rows = [
        (str(repeat[i]), repr(float(x[i])), f"{load[i]:.4f}", readings[i])
        for i in range(repeat.size)
        if i not in never_taken
    ]
    comments = (
        "SYNTHETIC: calculated from a known truth, not measured. " + READ_ME,
        f"Truth: A = {conversion_constant * 1e3:g} mV/Pa, centre {centre:g} mm.",
        "G is a Gaussian of 0.561 mm; the noise is 0.5 % of the largest signal.",
        "Film: neo-Hookean, E = 2.2 MPa, nu = 0.5, h = 2 mm. Rod: radius 0.25 mm; the film sticks.",
    )
    write_table(path, comments, ("repeat", "x (mm)", "load (N)", "U (mV)"), rows)


def finite_element_reference(path: Path) -> None:
    """Write the stress at the base of the film under 1 N, as a FEM program lists it."""
    film = memscal.ElasticFilm(
        young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3, law="neo-hookean"
    )
    rod = memscal.indent(film, memscal.Rod(radius=0.25e-3), load=1.0, friction=np.inf)
    points = rod.mesh().points
    r = np.sort(points[points[:, 1] == 0, 0])
    stress, shear = rod.base_stress(r) * 1e-6, rod.base_shear(r) * 1e-6
    rows = [
        (f"{radius * 1e3:.6f}", f"{-normal:.8e}", f"{-along:.8e}")
        for radius, normal, along in zip(r, stress, shear, strict=True)
    ]
    comments = (
        "SYNTHETIC: a calculation, not a measurement. " + READ_ME,
        "Base of an incompressible film (E = 2.2 MPa, h = 2 mm) bonded to a rigid support, under",
        "a rigid rod of radius 0.25 mm pressed with 1 N, to which it sticks; neo-Hookean. Stresses",
        "at the nodes of the base; tension is positive, as in most FEM programs.",
    )
    write_table(path, comments, ("r (mm)", "S33 (MPa)", "S13 (MPa)"), rows)


def own_experiment(folder: Path) -> None:
    """Write an experiment on another film, with another sensor and another sphere, as tables.

    They are those of the notebook on a user's own data.
    """
    sphere = memscal.Sphere(radius=60e-3)
    made = memscal.simulate_experiment(
        film=memscal.ElasticFilm(
            young_modulus=1.9e6, poisson_ratio=0.5, thickness=1.5e-3, law="neo-hookean"
        ),
        rod=memscal.Rod(radius=0.3e-3),
        sphere=sphere,
        kernel=memscal.GaussianMixture(sigmas=(0.48e-3,)),
        conversion_constant=3.5e-8,
        rod_load=0.5,
        rod_repeats=2,
        loads=(0.4, 0.8, 1.6),
        lubricated_loads=(0.4, 1.6),
        friction=0.12,
        spacing=0.4e-3,
        repeats=2,
        disturbances=memscal.Disturbances(load_scatter=0.01, centre=(-0.31e-3, 0.0)),
        seed=60,
    )
    about = (
        "SYNTHETIC: calculated from a known truth, not measured. " + READ_ME,
        "Truth: A = 3.5e-5 mV/Pa, centre -0.31 mm; G is a Gaussian of 0.48 mm; noise 0.5 % of the",
        "largest signal. Film: neo-Hookean, E = 1.9 MPa, nu = 0.5, h = 1.5 mm.",
    )
    folder.mkdir(exist_ok=True)
    rod = [
        (str(line + 1), f"{x * 1e3:.3f}", f"{u * 1e3:.5f}")
        for line, readings in enumerate(made.rod.u_zz)
        for x, u in zip(made.rod.x, readings, strict=True)
    ]
    truth = "Rod: radius 0.3 mm, load 0.5 N."
    write_table(folder / "rod.csv", (*about, truth), ("pass", "x (mm)", "U (mV)"), rod)
    for name, scan, friction in (("dry", made.dry, 0.12), ("lubricated", made.lubricated, 0.0)):
        assert scan.normal_load is not None
        rows = [
            (f"{load:g}", str(line % 2 + 1), f"{x * 1e3:.3f}", f"{u * 1e3:.5f}")
            for line, (loads, readings) in enumerate(zip(scan.normal_load, scan.u_zz, strict=True))
            for x, load, u in zip(scan.x, loads, readings, strict=True)
        ]
        if name == "dry":
            rows[40] = (*rows[40][:-1], "")  # a reading that was lost
            del rows[100]  # a contact that was never made
        truth = (
            f"Sphere: radius 60 mm; loads scatter by 1 %, positions by 10 um; mu = {friction:g}."
        )
        header = ("set load (N)", "pass", "x (mm)", "U (mV)")
        write_table(folder / f"sphere_{name}.csv", (*about, truth), header, rows)


if __name__ == "__main__":
    messy_scan(HERE / "rod_scan_messy.csv")
    finite_element_reference(HERE / "rod_reference_fem.csv")
    own_experiment(HERE / "tables")
