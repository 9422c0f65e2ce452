"""Misspelt words, as a user types them: mypy (``nox --session typecheck``) finds each.

An error that mypy no longer finds leaves an ignore that it reports as unused.
"""

import memscal


def calls(
    scan: memscal.Scan,
    apparatus: memscal.ApparatusFunction,
    calibration: memscal.Calibration,
    field: memscal.Field,
    film: memscal.ElasticFilm,
    rod: memscal.Rod,
) -> None:
    """Call what takes words, rightly and wrongly; it is never run."""
    memscal.calibrate(scan, method="bayesian", film_law="linear", options={"monotone": True})
    memscal.calibrate(scan, methd="bayesian")  # type: ignore[call-arg]
    memscal.calibrate(scan, method="baysian")  # type: ignore[arg-type]
    memscal.calibrate(scan, amplitude=2.0)  # type: ignore[call-arg]
    memscal.calibrate(scan, film_law="neo-hooke")  # type: ignore[arg-type]
    memscal.calibrate(scan, channel="xx")  # type: ignore[arg-type]
    memscal.calibrate(scan, centre="per-line")  # type: ignore[arg-type]
    memscal.calibrate(scan, free="thicknes")  # type: ignore[arg-type]
    memscal.calibrate_many([scan], method="tikhonov", options={"amplitude": 2.0}, seed=1)
    memscal.calibrate_many([scan], methd="bayesian")  # type: ignore[call-arg]
    memscal.calibrate_many([scan], method="baysian")  # type: ignore[arg-type]
    memscal.compare(scan, apparatus, loading="total", friction=(0.0, 0.1))
    memscal.compare(scan, apparatus, loading="totl")  # type: ignore[arg-type]
    memscal.compare(scan, apparatus, frictions=(0.0, 0.1))  # type: ignore[call-arg]
    memscal.restore(scan, apparatus, lod=1.0)  # type: ignore[call-arg]
    memscal.monte_carlo(calibration, draw=10)  # type: ignore[call-arg]
    memscal.indent(film, rod, load=1.0, backend="fem").plot(figsize=(3.15, 2.4))
    memscal.indent(film, rod, load=1.0).plot(figsiz=(3.15, 2.4))  # type: ignore[call-arg]
    memscal.indent(film, rod, load=1.0, backend="fme")  # type: ignore[call-overload]
    memscal.import_table({}, x="x", u="u", layout=memscal.TableLayout(x_unit="mm"))
    memscal.import_table({}, x="x", u="u", x_unit="mm")  # type: ignore[call-arg]
    memscal.Scan.from_arrays([0.0], [1.0], x_unit="mm", load=1.0, y=[0.0])
    memscal.Scan.from_arrays([0.0], [1.0], x_units="mm")  # type: ignore[call-arg]
    memscal.simulate(seed=1, load=[0.5, 1.0])
    memscal.simulate(sed=1)  # type: ignore[call-arg]
    memscal.simulate_experiment(loading="totl")  # type: ignore[arg-type]
    memscal.design(method="baysian")  # type: ignore[arg-type]
    memscal.divide(field, field, weakest=1.0, method="winer")  # type: ignore[arg-type]
