"""Draw the three pictures of the start page from shipped and simulated data: no arguments."""

from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np

import memscal

HERE = Path(__file__).parent
DATA = HERE.with_name("calibration_data")
BLUE, ORANGE, GREY = "#0072B2", "#D55E00", "0.55"
STYLE = {
    "svg.fonttype": "none",
    "svg.hashsalt": "memscal",
    "font.size": 11,
    "font.family": "sans-serif",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "figure.figsize": (4.4, 3.0),
    "figure.constrained_layout.use": True,
}


def sensor() -> plt.Figure:
    """Return the rod scan and the G that was found."""
    apparatus = memscal.calibrate(DATA / "rod_scan_65.h5").apparatus
    scan, profile = apparatus.reconvolution, apparatus.radial_profile
    figure, axes = plt.subplots()
    axes.plot(scan.x * 1e3, scan.u_zz * 1e3, "o", ms=3.5, color="black", label="scan")
    axes.plot(scan.x * 1e3, scan.u_zz_predicted * 1e3, color=BLUE, label="A G ⊗ stress")
    axes.set(xlabel="rod's position (mm)", ylabel="voltage (mV)", xlim=(-7, 7))
    axes.legend(loc="upper left", handlelength=1.2)
    inset = axes.inset_axes((0.7, 0.5, 0.3, 0.42))
    inside = profile.r < 2e-3
    r, g, u = (
        values[inside] for values in (profile.r * 1e3, profile.g / 1e6, profile.g_errors / 1e6)
    )
    inset.fill_between(r, g - 2 * u, g + 2 * u, color=ORANGE, alpha=0.25, lw=0)
    inset.plot(r, g, color=ORANGE)
    inset.set(title="G (1/mm²), k = 2", xlabel="r (mm)", xlim=(0, 2))
    inset.title.set_size(10)
    return figure


def friction() -> plt.Figure:
    """Return the stress under a sphere, dry and lubricated, with calculated ones."""
    folder = DATA / "sphere_experiment"
    apparatus = memscal.calibrate(folder / "rod_scan.h5", method="bayesian").apparatus
    scans = [folder / "sphere_dry.h5", folder / "sphere_lubricated.h5"]
    measured = memscal.measure_stress(scans, apparatus)
    figure, axes = plt.subplots()
    for state, color in (("dry", ORANGE), ("lubricated", BLUE)):
        [profile] = [
            p
            for p in measured.profiles
            if p.scan.lubrication == state and abs(p.load - 2.75) < 1e-6
        ]
        values, errors = profile.s_zz / 1e3, 2 * profile.s_zz_errors / 1e3
        axes.errorbar(
            profile.r * 1e3,
            values,
            errors,
            fmt="o",
            ms=3.5,
            lw=1,
            color=color,
            label=f"{state}, k = 2",
        )
    r = np.linspace(0, 8e-3, 161)
    wide = np.linspace(0, 20e-3, 801)
    film, sphere = measured.scans[0].film, measured.scans[0].indenter
    for mu, style in ((0.0, "-"), (0.2, "--")):
        contact = memscal.indent(film, sphere, load=2.75, friction=mu)
        blurred = np.interp(r, wide, apparatus.convolve(wide, contact.base_stress(wide)))
        axes.plot(
            r * 1e3, blurred / 1e3, style, color=GREY, zorder=0, label=f"calculated, μ = {mu:g}"
        )
    axes.set(xlabel="distance from the axis (mm)", ylabel="stress U/A (kPa)", xlim=(0, 7))
    axes.legend(handlelength=1.4)
    return figure


def pipeline() -> plt.Figure:
    """Return the conversion constants of many sensors."""
    spread = np.random.default_rng(7)
    truths = 1e-7 * (1 + 0.04 * spread.standard_normal(200))
    truths[[41, 138]] *= [0.72, 1.25]
    noisy = memscal.Disturbances(noise=0.01)
    scans = (
        memscal.simulate(conversion_constant=a, points=33, disturbances=noisy, seed=seed)
        for seed, a in enumerate(truths)
    )
    results = list(memscal.calibrate_many(scans, method="bayesian"))
    values = np.array([result.apparatus.conversion_constant for result in results]) * 1e3 / 1e-4
    errors = [
        result.apparatus.parameters.uncertainty("conversion_constant") * 1e3 / 1e-4
        for result in results
    ]
    middle = np.median(values)
    far = abs(values - middle) > 5 * 1.4826 * np.median(abs(values - middle))
    figure, axes = plt.subplots()
    number = np.arange(values.size)
    for chosen, color, label in ((~far, BLUE, "200 sensors, k = 2"), (far, ORANGE, "outliers")):
        bars = 2 * np.array(errors)[chosen]
        axes.errorbar(
            number[chosen], values[chosen], bars, fmt="o", ms=2.5, lw=0.7, color=color, label=label
        )
    axes.set(xlabel="sensor", ylabel="A (10⁻⁴ mV/Pa)", ylim=(0.6, 1.6))
    axes.legend(loc="upper left", ncols=2, handletextpad=0.3, columnspacing=1.0)
    return figure


if __name__ == "__main__":
    with mpl.rc_context(STYLE):
        for draw in (sensor, friction, pipeline):
            name = HERE / "start" / f"{draw.__name__}.svg"
            draw().savefig(name, metadata={"Date": None})
