# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#       format_version: '1.3'
#       jupytext_version: 1.19.6
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Your own data: from tables to a friction coefficient
#
# From tables (scans with a thin rod, and scans of contacts with a sphere, dry and lubricated) this
# notebook estimates the friction coefficient of the contact with its interval, and states what to
# check at each step. Replace the tables and the numbers in the commands by yours.
#
# **The tables here are synthetic.** They were calculated for an invented film, sensor and sphere,
# with a friction coefficient of 0.12; `calibration_data/make_tables.py` made them.

# %%
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
from IPython.display import Markdown

import memscal

TABLES = Path("../calibration_data/tables").resolve()
MM, MV = 1e-3, 1e-3  # memscal computes in SI units
KNOWN = ("young_modulus", "poisson_ratio", "thickness", "law")  # of the film

# %matplotlib inline
scratch = TemporaryDirectory()  # where the files of this notebook go
folder = Path(scratch.name)
plt.rcParams.update({"figure.figsize": (7.2, 3.0), "figure.dpi": 80, "font.size": 9})
plt.rcParams.update({"figure.constrained_layout.use": True, "legend.frameon": False})

# %% [markdown]
# ## 1. What a table must hold
#
# One row for each reading: the position of the indenter, the voltage, and columns that number the
# lines of a scan, here the load that was set and the pass. Order, separator and decimal mark do not
# matter. A lost reading may be empty, and a row may be missing.

# %%
print("".join((TABLES / "sphere_dry.csv").read_text().splitlines(keepends=True)[:9]))


# %% [markdown]
# ## 2. Import, by a recipe
#
# The heads of this table state the units; the options state the indenter and the film. Each
# *standard uncertainty* that you state here is propagated to the friction coefficient, and one that
# you leave out counts as zero. At the terminal you would type what follows `memscal`.
#
# The options are found with one table, and `--save-recipe` keeps them for all others.


# %%
def run(line):
    """Run a command of memscal as at the terminal, and show its output."""
    process = subprocess.run(
        [sys.executable, "-m", "memscal", *shlex.split(line)],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    print(process.stdout)
    print(process.stderr)


FILM = (
    "--young-modulus 1.9 --young-modulus-uncertainty 0.05 --poisson-ratio 0.5 "
    "--poisson-ratio-uncertainty 0.003 --thickness 1.5 --thickness-uncertainty 0.015 "
    "--film-law neo-hookean "
)
COLUMNS = '--x "x (mm)" --x-unit mm --u "U (mV)" --u-unit mV '
SPHERE = (
    '--indenter sphere --radius 60 --radius-uncertainty 0.2 --load-column "set load (N)" '
    '--repeat "set load (N)" --repeat pass --load-uncertainty 0.004 --load-scatter 1 '
    "--position-error 10 --sensor-name S7 "
)

rods = folder / "rods"  # the tables of your sensors, here one, and one in which nothing stands
rods.mkdir()
(rods / "S7.csv").write_text((TABLES / "rod.csv").read_text())
(rods / "S8.csv").write_text("pass,x (mm),U (mV)\n")

run(
    f"import rods/S7.csv -o rod.h5 {COLUMNS} {FILM} --repeat pass "
    "--radius 0.3 --radius-uncertainty 0.002 --load 0.5 --load-uncertainty 0.0025 "
    "--rod-friction inf --save-recipe rod.toml"
)
print((folder / "rod.toml").read_text())

# %% [markdown]
# By the recipe the whole folder is read, hundreds of tables as well. The names of the files are
# those of the sensors. A table that cannot be read is a row with its cause; the others are written.

# %%
run("import rods -o scans --recipe rod.toml --name-pattern {sensor}")

# %% [markdown]
# The tables of the contacts have a recipe of their own. An option beats it, here what was between
# sphere and film.

# %%
run(
    f"import {TABLES}/sphere_dry.csv -o dry.h5 {COLUMNS} {FILM} {SPHERE} "
    "--lubrication dry --save-recipe sphere.toml"
)
run(
    f"import {TABLES}/sphere_lubricated.csv -o lubricated.h5 "
    "--recipe sphere.toml --lubrication lubricated --lubricant glycerol"
)

# %% [markdown]
# Errors of the load are of two kinds. `--load-uncertainty` is common to all contacts, such as that
# of the balance; it is in N at the nominal load of the scan, and in proportion at the others.
# `--load-scatter`, in percent, is independent from contact to contact: it is noise, and repeats
# average it.
#
# Read the notes: how many readings, lines and places the table holds, what is missing, and what was
# pressed on what. Without
# the load among the columns of `--repeat`, the contacts of three loads would be in one line; the
# import warns of it.
#
# ## 3. Look at the scans
#
# First the numbers, as they were read: are these the columns, the units and the passes that you
# meant?

# %%
rod, dry, lubricated = (
    memscal.read_scan(folder / f"{name}.h5") for name in ("scans/S7", "dry", "lubricated")
)
rows = ["| x (mm) | " + " | ".join(f"U (mV), pass {i + 1}" for i in range(len(rod.u_zz))) + " |"]
rows += ["|-" * (1 + len(rod.u_zz)) + "|"]
for x, readings in list(zip(rod.x, rod.u_zz.T, strict=True))[:5]:
    rows.append(f"| {x / MM:.3f} | " + " | ".join(f"{u / MV:.4f}" for u in readings) + " |")
Markdown("\n".join(rows))

# %% [markdown]
# Each scan should have a peak near the middle, flat ends, and as much length beyond the contact as
# within it. A scan that ends on a slope does not determine its baseline.

# %%
fig, axes = plt.subplots(1, 3, sharex=True)
for ax, scan, name in zip(axes, (rod, dry, lubricated), ("rod", "dry", "lubricated"), strict=True):
    ax.plot(scan.x / MM, scan.u_zz.T / MV, ".", ms=3)
    ax.set(title=name, xlabel="x (mm)")
axes[0].set_ylabel("voltage (mV)")
plt.show()

# %% [markdown]
# ## 4. Calibrate
#
# The rod's scan gives the conversion constant A and the apparatus function G. Method `bayesian` is
# the more precise of the two, for stress and friction; the paper's division stands below it, to
# compare.

# %%
calibration = memscal.calibrate(rod, method="bayesian")
apparatus = calibration.apparatus
apparatus.save(folder / "sensor.apparatus.h5")
print(calibration)

# %%
calibration.plot()

# %% [markdown]
# Check, in this order:
#
# - **the residuals** (b): they lie within their band and show no wave;
# - **the resolved band** (f): G is not measured in the hatched range. Contacts that are wide
#   against the film do not depend on it;
# - **the uncertainty of A**: it is part of every stress. `memscal design` finds the scan that
#   halves it;
# - **the checks**: all passed here. `docs/quality.md` explains each one.
#
# What is not stated is not counted. The recipe states film, rod and load, with their uncertainties,
# but neither the gain of the sensor's chain nor the scale of the stage. What half a percent of each
# would cost, and what the others do:

# %%
unstated = replace(
    rod,
    film=memscal.ElasticFilm(**{name: getattr(rod.film, name) for name in KNOWN}),
    indenter=memscal.Rod(radius=rod.indenter.radius),
    load_uncertainty=None,
)
in_full = replace(rod, gain_uncertainty=0.005, position_scale_uncertainty=0.005)
for what, scan in (("nothing stated", unstated), ("as it is", rod), ("in full", in_full)):
    found = memscal.calibrate(scan, method="bayesian").apparatus
    share = found.parameters.uncertainty("conversion_constant") / found.conversion_constant
    print(f"u(A) {what}: {share:.2%}")

# %% [markdown]
# The rest is taken for granted. The table has for each assumption the size of an error that moves A
# by its standard uncertainty: where yours may be as large, state its uncertainty in the recipe.

# %%
rows = ["| assumption | | size that moves A by u(A) | of |", "|-|-|-|-|"]
for assumption in apparatus.assumptions:
    size = assumption.size_text("conversion_constant")
    rows.append(f"| {assumption.sentence} | {assumption.state} | {size} | {assumption.measure} |")
Markdown("\n".join(rows))

# %% [markdown]
# ## 5. The measured stress
#
# Baseline and centre of every load are estimated, and $S_{zz} = U/A$ has its uncertainty by
# source. Each profile's total force is compared with the load that was applied.

# %%
measured = memscal.measure_stress([dry, lubricated], apparatus)
measured.plot()


# %%
def forces(measured):
    """Tabulate each profile's force over its load, and the checks that failed."""
    rows = ["| profile | force (N) | force / load | maximum (kPa) |", "|-|-|-|-|"]
    for profile in measured.profiles:
        ratio, spread = profile.force / profile.load, profile.force_uncertainty / profile.load
        rows.append(
            f"| {profile.label} | {profile.force:.3f} ± {profile.force_uncertainty:.3f} "
            f"| {ratio:.3f} ± {spread:.3f} "
            f"| {profile.maximum / 1e3:.2f} ± {profile.maximum_uncertainty / 1e3:.2f} |"
        )
    failed = [f"{check.name} ({check.value:.2g})" for check in measured.checks if not check.passed]
    return Markdown("\n".join(rows) + f"\n\nFailed: {', '.join(failed) or 'none'}.")


forces(measured)

# %% [markdown]
# **Check the force first.** It does not depend on the shape of G, and therefore tests A and the
# loads alone. Then check the logarithmic panel: the profile falls smoothly over two to three
# decades, down to the noise.
#
# ## 6. The friction coefficient
#
# The contact of the sphere with the film is calculated at these loads for friction coefficients
# from 0 to ∞, under both definitions of the loading: *incremental*, where a point of the film
# sticks where it first touched, as when a load grows slowly; and *total*, where the load comes in
# one step. The calculated stress, blurred by G, is compared with the measured one.

# %%
FRICTION = (0.0, 0.05, 0.1, 0.2, 0.3, 0.6, float("inf"))
comparison = memscal.compare(measured, apparatus, friction=FRICTION)
comparison.plot()

# %% [markdown]
# The points lie between the curve without friction and the one of full stick (a). Friction opposes
# the outward motion of the film and raises the stress at the centre; the maxima (b) are larger than
# without it by a few percent. Error bars include errors that all points of a profile share, such as
# that of A, so neighbouring residuals (c) may lie to one side together. Chi-square accounts for
# this.


# %%
def with_interval(reading):
    """Return a coefficient with its interval, or the interval where there is no value."""
    low, high = reading.interval.low, reading.interval.high
    interval = f"{low:.2f} to {'∞' if high is None else f'{high:.2f}'}"
    return interval if reading.value is None else f"{reading.value:.2f} ({interval})"


def coefficients(comparison):
    rows = ["| | loading | by the maximum | by the profile |", "|-|-|-|-|"]
    for loading, loads in comparison.loads.items():
        rows += [
            f"| {load.profile.label} | {loading} | {with_interval(load.by_maximum)} "
            f"| {with_interval(load.by_profile)} |"
            for load in loads
        ]
    for state, by_loading in comparison.joint.items():
        rows += [
            f"| all loads, {state} | {loading} | | **{with_interval(reading)}** |"
            for loading, reading in by_loading.items()
        ]
    return Markdown("\n".join(rows))


coefficients(comparison)

# %% [markdown]
# In brackets are intervals of 95 %. How to read them:
#
# - **An interval that ends at ∞ is a bound.** Beyond some coefficient the whole contact sticks,
#   and a larger one changes nothing; such data have no upper limit, whatever the noise. Quote the
#   lower end.
# - **An interval that begins at 0** means that no friction was detected. The lubricated contacts,
#   the control, must be of this kind.
# - **All loads together** have one coefficient, if Amontons' law holds. If the coefficients of
#   single loads rise or fall beyond their intervals, it does not (notebook 03).
# - **The definition of the loading** is not a statistical question: it follows from the
#   experiment. For small coefficients both agree.
#
# The likelihoods show both: a parabola is a value with an uncertainty; a curve that is flat to the
# right below the level of 95 % is a lower bound.

# %%
fig, axes = plt.subplots(1, 2, sharex=True, sharey=True)
for ax, (state, by_loading) in zip(axes, comparison.joint.items(), strict=True):
    curves = {
        load.profile.label: load.by_profile
        for load in comparison.loads["incremental"]
        if load.lubrication == state
    }
    curves["all loads"] = by_loading["incremental"]
    for label, reading in curves.items():
        rise = reading.deviance - reading.deviance.min()
        ax.plot(reading.values, rise, label=label, lw=2 if label == "all loads" else 1)
    ax.axhline(3.84, color="0.6", ls="--", label="95 %")
    ax.set(title=state, xlim=(0, 0.6), ylim=(0, 12), xlabel="effective friction coefficient")
    ax.legend()
axes[0].set_ylabel(r"$-2\,\ln(p/p_{max})$")
plt.show()

# %%
budget = comparison.joint["dry"]["incremental"].budget
for source, contribution in sorted(budget.items(), key=lambda item: -item[1]):
    print(f"{source.replace('_', ' '):16} {contribution:.4f}")

# %% [markdown]
# This is each source's contribution to the standard uncertainty of the coefficient; the first are
# worth a better measurement. The true coefficient of these tables is 0.12.
#
# ## 7. The checks, and what to do when one fails
#
# A failed check does not stop a comparison; find its cause before you quote a number.

# %%
with_p = [check for check in comparison.checks if check.p_value is not None]
rows = ["| check | value | limit | p | passed |", "|-|-|-|-|-|"]
rows += [
    f"| {check.name} | {check.value:.3g} | {check.limit:.3g} | {check.p_value:.2g} "
    f"| {check.passed} |"
    for check in sorted(with_p, key=lambda check: check.p_value)[:6]
]
Markdown(f"The six least likely of {len(comparison.checks)}:\n\n" + "\n".join(rows))

# %% [markdown]
# What a failure means, and what to do:
#
# - `applied_force` of one profile: its load, or its baseline. Weigh again; scan farther out.
# - `applied_force` of most profiles alike, or `applied_force_all`: A, the gain, a unit, the
#   balance. Calibrate again with the amplifier as it is.
# - `chi_square`, `reconvolution`: no pressure on this film gives this shape. The film's
#   properties, G, or contacts of different loads in one line.
# - `symmetry`: left and right differ. A tilt, a tangential force, the edge of the indenter.
# - `outliers`: single contacts stand out. Look at them; empty the reading, and keep the row.
# - `noise_as_stated`: the scatter is not what the scan states. State `--load-scatter` and
#   `--position-error` as they are.
# - `profile_chi_square`: no coefficient explains the profile. Film, sphere, or the law of friction.
# - `bracketing`: points beyond no friction or full stick. As above; or an interface that yields.
# - `lubricated_frictionless`: the control shows friction. Do not quote the dry coefficient before
#   it is understood: A, the film, the lubrication.
#
# `docs/quality.md` explains all of them.
#
# Three mistakes, made on purpose. First, an amplifier whose gain was 5 % higher in the sphere's
# scans than in the rod's:

# %%
wrong_gain = [replace(scan, u_zz=1.05 * scan.u_zz) for scan in (dry, lubricated)]
forces(memscal.measure_stress(wrong_gain, apparatus))

# %% [markdown]
# Every force is about 5 % too large. A single profile hardly shows it; all together do. Undetected,
# it would look like friction: full stick adds no more than 12 to 21 % to these maxima.
#
# Second, a film whose stated thickness is 5 % too large, in the calibration and in the measurement:

# %%
thin = replace(rod.film, thickness=1.05 * rod.film.thickness)
wrong_film = [replace(scan, film=thin) for scan in (rod, dry, lubricated)]
assumed = memscal.calibrate(wrong_film[0], method="bayesian").apparatus
forces(memscal.measure_stress(wrong_film[1:], assumed))

# %% [markdown]
# The forces agree: A is an integral over the plane, and the film's thickness hardly enters. A wrong
# thickness changes the shapes, which looks like friction:

# %%
wrong = memscal.compare(wrong_film[1:], assumed, friction=FRICTION, loading="incremental")
for state, by_loading in wrong.joint.items():
    print(f"all loads, {state}: {with_interval(by_loading['incremental'])}")
print("failed:", [check.name for check in wrong.checks if not check.passed])

# %% [markdown]
# No check failed, and the true value is not in the interval of the dry contacts. The interval of
# the lubricated ones does not begin at 0: the control shows friction where there is none.
# Lubricated contacts distinguish a wrong film from friction. The stated uncertainty of the
# thickness, 1 %, was a fifth of the error: state it in full.
#
# Third, the artifact of another sensor:

# %%
other = [replace(scan, sensor=replace(scan.sensor, name="S8")) for scan in (dry, lubricated)]
try:
    memscal.measure_stress(other, apparatus)
except memscal.MemscalError as error:
    print(error)

# %% [markdown]
# ## 8. The same at the terminal
#
# Every step has its command, with figures and JSON:

# %%
run("apply sensor.apparatus.h5 lubricated.h5 -o lubricated.stress.h5")
scratch.cleanup()

# %% [markdown]
# ```console
# memscal import rods/*.csv -o scans --recipe rod.toml --name-pattern "{sensor}"
# memscal calibrate scans/S7.h5 -o sensor.apparatus.h5 --figure calibration.pdf
# memscal apply sensor.apparatus.h5 dry.h5 lubricated.h5 -o contacts.stress.h5 --figure stress.pdf
# memscal compare sensor.apparatus.h5 dry.h5 lubricated.h5 --figures figures
# ```
