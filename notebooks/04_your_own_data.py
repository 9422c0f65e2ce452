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

# %%

# %% [markdown]
# # Your own data: from tables to a friction coefficient
#
# You have three tables: a scan with a thin rod, and scans of contacts with a sphere, dry and
# lubricated. This notebook goes from there to the friction coefficient of the contact with its
# interval, and stops where you should look before you go on. Replace the tables and the numbers
# in the commands by yours.
#
# **The tables here are synthetic.** They were calculated for a film, a sensor and a sphere that
# exist nowhere, with a friction coefficient of 0.12; `calibration_data/make_tables.py` made them.
# So the last section can say what is wrong when something is, because we put it in.

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
from memscal.figures.calibration import calibration_figure
from memscal.figures.friction import maxima_figure
from memscal.figures.friction_profiles import friction_set_figure, profile_figure
from memscal.figures.friction_readings import effective_friction_figure, likelihood_figure
from memscal.figures.stress import measured_stress_figure

TABLES = Path("../calibration_data/tables")
MM, MV = 1e-3, 1e-3  # memscal computes in SI units; people read these

# %matplotlib inline
scratch = TemporaryDirectory()  # where the files of this notebook go
folder = Path(scratch.name)
plt.rcParams.update({"figure.figsize": (7.2, 3.0), "figure.dpi": 110, "font.size": 9})
plt.rcParams.update({"figure.constrained_layout.use": True, "legend.frameon": False})

# %% [markdown]
# ## 1. What a table must hold
#
# One row for each reading: the position of the indenter, the voltage, and what tells the lines of
# a scan apart, which is here the load that was set and the number of the pass. Order, separator
# and decimal mark do not matter. A reading that was lost may be empty, and a row may be missing.

# %%
print("".join((TABLES / "sphere_dry.csv").read_text().splitlines(keepends=True)[:9]))


# %% [markdown]
# ## 2. Import
#
# A table says neither its units nor what was pressed on what. The options do, and they ask for
# more than you may expect: each *standard uncertainty* that you state here is carried to the
# friction coefficient, and one that you leave out counts as zero. At the terminal you would type
# what follows `memscal`.


# %%
def run(line):
    """Run a command of memscal as at the terminal, and show what it says."""
    told = subprocess.run(
        [sys.executable, "-m", "memscal", *shlex.split(line)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    print(told.stdout.replace(str(folder), "."))
    print(told.stderr.replace(str(folder), "."))


FILM = (
    "--young-modulus 1.9 --young-modulus-uncertainty 0.05 --poisson-ratio 0.5 "
    "--poisson-ratio-uncertainty 0.003 --thickness 1.5 --thickness-uncertainty 0.015 "
)
COLUMNS = '--x "x (mm)" --x-unit mm --u "U (mV)" --u-unit mV --sensor-name S7 '
SPHERE = (
    '--indenter sphere --radius 60 --radius-uncertainty 0.2 --load-column "set load (N)" '
    '--repeat "set load (N)" --repeat pass --load-uncertainty 0.004 --load-scatter 1 '
    "--position-error 10 "
)

run(
    f"import {TABLES}/rod.csv -o {folder}/rod.h5 {COLUMNS} {FILM} --repeat pass "
    "--radius 0.3 --radius-uncertainty 0.002 --load 0.5 --load-uncertainty 0.0025"
)

# %%
run(
    f"import {TABLES}/sphere_dry.csv -o {folder}/dry.h5 {COLUMNS} {FILM} {SPHERE} --lubrication dry"
)
run(
    f"import {TABLES}/sphere_lubricated.csv -o {folder}/lubricated.h5 {COLUMNS} {FILM} {SPHERE} "
    "--lubrication lubricated --lubricant glycerol"
)

# %% [markdown]
# Two kinds of error of the load are told apart. `--load-uncertainty` is common to all contacts, as
# that of the balance: it moves every stress alike. It is in N at the nominal load of the scan, and
# in proportion at the others. `--load-scatter`, in percent, is each contact's own, as of a lens
# that is set down by hand: it is noise, and repeats average it.
#
# Read the notes. They say how many readings, lines and places the table holds, and what is
# missing. Had the load that was set not been named among the columns of
# `--repeat`, the contacts of three loads would stand in one line, and the import would warn of it.
#
# ## 3. Look at the scans
#
# Before anything is calculated: a peak somewhere near the middle, both ends flat, and as much scan
# beyond the contact as there is within it. A scan that ends on a slope cannot tell its baseline.

# %%
rod, dry, lubricated = (
    memscal.read_scan(folder / f"{name}.h5") for name in ("rod", "dry", "lubricated")
)

fig, axes = plt.subplots(1, 3, sharex=True)
for ax, scan, name in zip(axes, (rod, dry, lubricated), ("rod", "dry", "lubricated"), strict=True):
    ax.plot(scan.x / MM, scan.u_zz.T / MV, ".", ms=3)
    ax.set(title=name, xlabel="x (mm)")
axes[0].set_ylabel("voltage (mV)")
plt.show()

# %% [markdown]
# ## 4. Calibrate
#
# The rod's scan gives the conversion constant A and the apparatus function G.

# %%
calibration = memscal.calibrate(rod)
apparatus = calibration.apparatus
apparatus.save(folder / "sensor.apparatus.h5")
print(apparatus)
calibration_figure(apparatus)

# %% [markdown]
# What to look at, in this order:
#
# - **the residuals** (b) lie within their band and show no wave;
# - **the resolved band** (f): what is hatched was not measured. Contacts that are wide against
#   the film do not need it;
# - **the uncertainty of A**: every stress inherits it. To halve it, `memscal design` says what to
#   change;
# - **the checks**: all passed here. `docs/quality.md` has an entry for each one that may fail.
#
# ## 5. The measured stress
#
# Baseline and centre of every load are found, and $S_{zz} = U/A$ comes with its uncertainty by
# source. Each profile's total force is held against the load that was applied.

# %%
measured = memscal.measure_stress([dry, lubricated], apparatus)
measured_stress_figure(measured)


# %%
def forces(measured):
    """Tabulate what a profile should have in common with its load, and which checks failed."""
    rows = ["| profile | force (N) | force / load | maximum (kPa) |", "|-|-|-|-|"]
    for one in measured.profiles:
        ratio, spread = one.force / one.load, one.force_uncertainty / one.load
        rows.append(
            f"| {one.label} | {one.force:.3f} ± {one.force_uncertainty:.3f} "
            f"| {ratio:.3f} ± {spread:.3f} "
            f"| {one.maximum / 1e3:.2f} ± {one.maximum_uncertainty / 1e3:.2f} |"
        )
    failed = [f"{check.name} ({check.value:.2g})" for check in measured.checks if not check.passed]
    return Markdown("\n".join(rows) + f"\n\nFailed: {', '.join(failed) or 'none'}.")


forces(measured)

# %% [markdown]
# **The force is the first thing to look at.** It does not depend on the shape of G, so that it
# tests A and the loads alone. Then the logarithmic panel: the profile falls smoothly over two to
# three decades, until the points are lost in noise.
#
# ## 6. The friction coefficient
#
# The sphere is pressed on the film by calculation, at these loads and for friction coefficients
# from 0 to ∞, under both definitions of the loading: *incremental*, where a point of the film
# sticks where it first touched, as when a load grows slowly; and *total*, where the load comes in
# one step. What reaches the sensor is compared with what it measured.

# %%
found = memscal.compare([dry, lubricated], apparatus)
profile_figure(found)

# %% [markdown]
# The points lie between the solid curve (no friction) and the dashed one (full stick). In the
# lower panels they leave the band for both: there is friction, and not enough to hold the film
# everywhere. Friction keeps the film from being squeezed outward and sends more of the load to the
# centre. What it does is a few percent, so look at it with a glass:

# %%
friction_set_figure(found)

# %% [markdown]
# The bars hold what all points of a profile have in common, too: an error of A moves all of them
# alike. So neighbouring residuals may lean to one side together; chi-square knows.


# %%
def in_words(reading):
    """A coefficient with its interval; or the bound, where there is no more to be had."""
    low, high = reading.interval.low, reading.interval.high
    within = f"{low:.2f} to {'∞' if high is None else f'{high:.2f}'}"
    return within if reading.value is None else f"{reading.value:.2f} ({within})"


def coefficients(found):
    rows = ["| | loading | by the maximum | by the profile |", "|-|-|-|-|"]
    for loading, loads in found.loads.items():
        rows += [
            f"| {one.profile.label} | {loading} | {in_words(one.by_maximum)} "
            f"| {in_words(one.by_profile)} |"
            for one in loads
        ]
    for lubrication, by_loading in found.joint.items():
        rows += [
            f"| all loads, {lubrication} | {loading} | | **{in_words(reading)}** |"
            for loading, reading in by_loading.items()
        ]
    return Markdown("\n".join(rows))


coefficients(found)

# %%
effective_friction_figure(found)

# %% [markdown]
# In brackets are intervals of 95 %. How to read them:
#
# - **An interval that ends at ∞ is a bound.** Beyond some coefficient the whole contact sticks,
#   and a larger one changes nothing; there is no upper limit to be found in such data, whatever
#   the noise. Quote the lower end.
# - **An interval that begins at 0** says that no friction was seen. The lubricated contacts must
#   be of this kind; they are your control.
# - **All loads together** have one coefficient, if Amontons' law holds. If the coefficients of
#   single loads rise or fall beyond their intervals, it does not (notebook 03).
# - **The other definition of the loading** is no statistics: which one holds is for you to know.
#   For small coefficients they agree.

# %%
budget = found.joint["dry"]["incremental"].budget
for source, part in sorted(budget.items(), key=lambda item: -item[1]):
    print(f"{source.replace('_', ' '):16} {part:.4f}")

# %% [markdown]
# This is what each source contributes to the standard uncertainty of the coefficient: the first
# lines say what to measure better next time. The truth of these tables is 0.12.

# %%
likelihood_figure(found)

# %% [markdown]
# The likelihoods are the full answer. A parabola is a measurement; a curve that is flat to the
# right before it reaches the level of 95 % is a lower bound. And the paper's own reading, maxima
# over those of a frictionless contact:

# %%
maxima_figure(found)

# %% [markdown]
# ## 7. The checks, and what to do when one fails
#
# Nothing is refused because a check failed, but look before you quote a number.

# %%
told = [check for check in found.checks if check.p_value is not None]
rows = ["| check | value | limit | p | passed |", "|-|-|-|-|-|"]
rows += [
    f"| {one.name} | {one.value:.3g} | {one.limit:.3g} | {one.p_value:.2g} | {one.passed} |"
    for one in sorted(told, key=lambda check: check.p_value)[:6]
]
Markdown(f"The six least likely of {len(found.checks)}:\n\n" + "\n".join(rows))

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
# `docs/quality.md` has all of them.
#
# Three mistakes, put in on purpose. First, an amplifier whose gain was 5 % higher in the sphere's
# scans than in the rod's:

# %%
wrong_gain = [replace(scan, u_zz=1.05 * scan.u_zz) for scan in (dry, lubricated)]
forces(memscal.measure_stress(wrong_gain, apparatus))

# %% [markdown]
# Every force is about 5 % too large. A single profile can hardly tell; all together can, and the
# ratio says by how much. Unseen it would have passed for friction: full stick adds no more than 12
# to 21 % to these maxima.
#
# Second, a film that is not as thick as was thought, in the calibration and in the measurement:

# %%
thin = replace(rod.film, thickness=1.05 * rod.film.thickness)
wrong_film = [replace(scan, film=thin) for scan in (rod, dry, lubricated)]
assumed = memscal.calibrate(wrong_film[0]).apparatus
forces(memscal.measure_stress(wrong_film[1:], assumed))

# %% [markdown]
# The forces agree: A is an integral over the plane, and the film's thickness hardly enters. A wrong
# thickness is seen in the shapes or not at all, and then as friction:

# %%
astray = memscal.compare(wrong_film[1:], assumed, loading="total")
print(astray)

# %% [markdown]
# No check failed, and the truth is no longer in the interval of the dry contacts. But the interval
# of the lubricated ones does not begin at 0 any more: the control shows friction where there is
# none. It is what tells a wrong film from friction, and why lubricated contacts are worth their
# time. And the stated uncertainty of the thickness was a fifth of the error: state what you know,
# and not less.
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
# Every step has its command, with figures and JSON for other programs:

# %%
run(f"apply {folder}/sensor.apparatus.h5 {folder}/lubricated.h5 -o {folder}/lubricated.stress.h5")
scratch.cleanup()

# %% [markdown]
# ```console
# memscal calibrate rod.h5 -o sensor.apparatus.h5 --figure calibration.pdf
# memscal apply sensor.apparatus.h5 dry.h5 lubricated.h5 -o contacts.stress.h5 --figure stress.pdf
# memscal compare sensor.apparatus.h5 dry.h5 lubricated.h5 --figures figures
# ```
