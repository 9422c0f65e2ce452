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
# # A sliding sphere: from a log to friction by speed
#
# A sphere slides over the film, forth and back. Friction shears the film, and what the sensor reads
# is shifted and skewed. From logs of the stage (time, encoder position, reading, normal and
# tangential load) follow the friction coefficient at each speed, by the sensor alone, and beside it
# what the tangential load cell says.
#
# **All data here are synthetic.** `memscal.simulate` made the scan of the calibration, and
# `memscal.slide` the contacts; the sensor reads them through a low-pass of 10 Hz, as an amplifier
# has it.

# %%
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import Markdown
from scipy.ndimage import gaussian_filter
from scipy.signal import TransferFunction, lsim

import memscal

MM, KPA, MV = 1e-3, 1e3, 1e-3  # memscal computes in SI units

# %matplotlib inline
scratch = TemporaryDirectory()  # where the files of this notebook go
folder = Path(scratch.name)
random = np.random.default_rng(6)
plt.rcParams.update({"figure.figsize": (7.2, 3.0), "figure.dpi": 80, "font.size": 9})
plt.rcParams.update({"figure.constrained_layout.use": True, "legend.frameon": False})


def run(command, *, shown=True):
    """Run memscal as at a terminal, and show what it prints."""
    words = [sys.executable, "-m", "memscal", *shlex.split(command)]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    if shown:
        print("$ memscal", command, "\n")
        # The first line has the digest of the log.
        print(*(done.stdout + done.stderr).splitlines()[1:], sep="\n")


# %% [markdown]
# ## 1. The sensor
#
# A calibration with a rod, as in the first notebook. The film, 2 mm of an elastomer, is the one
# that the sphere slides on.

# %%
FILM = memscal.ElasticFilm(
    young_modulus=2.2e6,
    young_modulus_uncertainty=0.1e6,
    poisson_ratio=0.5,
    thickness=2e-3,
    thickness_uncertainty=20e-6,
    law="linear",
)
SPHERE = memscal.Sphere(radius=128.8e-3, radius_uncertainty=0.5e-3)
LOAD = 1.37  # N

calibration = memscal.calibrate(memscal.simulate(film=FILM, load=0.05, seed=6), method="bayesian")
sensor = calibration.apparatus
sensor.save(folder / "sensor.apparatus.h5")
print(calibration.answer())

# %% [markdown]
# ## 2. What sliding does to the stress
#
# The shear is friction times pressure in the whole contact. It moves the stress at the base ahead
# of the indenter: its centroid by friction times thickness, whatever the film's Poisson's ratio.

# %%
x = np.linspace(-6, 6, 241) * MM
fig, ax = plt.subplots()
for friction in (0.0, 0.3, 0.6):
    contact = memscal.slide(FILM, SPHERE, load=LOAD, friction=friction)
    stress = contact.base_stress(x)
    ahead = contact.base_centroid - contact.surface_centroid
    ax.plot(x / MM, stress / KPA, label=f"friction {friction}")
    print(f"friction {friction}: peak at {x[stress.argmax()] / MM:.2f} mm,", end=" ")
    print(f"centroid {ahead / MM:.2f} mm ahead of that of the pressure")
ax.set(xlabel="place ahead of the indenter's axis (mm)", ylabel="stress at the base (kPa)")
ax.legend()
plt.show()

# %% [markdown]
# ## 3. The logs
#
# For each speed the stage slides by 20 mm forth and back. Friction grows with the speed here. The
# stage has a backlash of some micrometres, and the tangential load cell scatters by 1 %.
#
# The sensor's reading is A times the stress, blurred by the sensor's size, and then it passes the
# low-pass in time.

# %%
SPEEDS = np.array([0.1, 1.0, 10.0]) * MM  # m/s
TRUE = 0.30 + 0.03 * np.log10(SPEEDS / MM)
LOW_PASS = 10.0  # Hz
BACKLASH = 5e-6
STEP = 0.05 * MM
WAY = np.linspace(-10, 10, 401) * MM
SIGMA = 0.561 * MM
A = sensor.conversion_constant


def read(contact, speed):
    """Return what the sensor reads along the way, in the order of time, in V."""
    y = np.arange(-3, 3.01, 0.05) * MM
    plane = contact.base_stress(WAY[:, None], y)
    # Whichever way the indenter goes, what is ahead of it passes the sensor first.
    still = A * gaussian_filter(plane, SIGMA / STEP)[::-1, y.size // 2]
    time = STEP / speed * np.arange(WAY.size)
    pole = 2 * np.pi * LOW_PASS
    return lsim(TransferFunction([pole], [1.0, pole]), still, time)[1]


for number, (speed, friction) in enumerate(zip(SPEEDS, TRUE, strict=True), 1):
    contact = memscal.slide(FILM, SPHERE, load=LOAD, friction=friction)
    rows = []
    for direction in (1, -1):
        u = read(contact, speed)
        position = WAY * direction + direction * random.normal(0, BACKLASH) / 2
        start = (1 - direction) / 2 * (WAY.size * STEP / speed + 3.0)
        noise = 0.002 * u.max() * random.normal(size=u.size)
        normal = LOAD * (1 + 0.002 * random.normal(size=u.size))
        tangential = direction * friction * LOAD * (1 + 0.01 * random.normal(size=u.size))
        time = start + STEP / speed * np.arange(u.size)
        ways = np.full(u.size, direction)
        rows.append(
            np.column_stack([time, position / MM, (u + noise) / MV, normal, tangential, ways])
        )
    np.savetxt(
        folder / f"log_{number}.csv",
        np.concatenate(rows),
        fmt="%.6g",
        delimiter=",",
        header="t (s),x (mm),U (mV),P (N),Q (N),way",
        comments="",
    )

print(*(folder / "log_2.csv").read_text().splitlines()[:4], sep="\n")

# %%
fig, axes = plt.subplots(1, 3, sharey=True)
for number, (ax, speed) in enumerate(zip(axes, SPEEDS, strict=True), 1):
    log = np.loadtxt(folder / f"log_{number}.csv", delimiter=",", skiprows=1)
    for way, label in ((1, "forth"), (-1, "back")):
        rows = log[:, 5] == way
        ax.plot(log[rows, 1], log[rows, 2], label=label)
    ax.set(xlabel="position (mm)", title=f"{speed / MM:g} mm/s")
axes[0].set(ylabel="reading (mV)")
axes[0].legend()
plt.show()

# %% [markdown]
# Forth, the sensor reads the peak before the axis of the sphere is above it, and back likewise. At
# 10 mm/s the lag of the amplifier takes off some of that.

# %% [markdown]
# ## 4. Import
#
# Each log becomes a scan that says how the indenter slid (`--sliding` and the column), when each
# reading was made, and what the amplifier does to the readings. `memscal import --help`
# has every option.

# %%
STATED = (
    "--young-modulus 2.2 --young-modulus-uncertainty 0.1 --poisson-ratio 0.5 --thickness 2 "
    "--thickness-uncertainty 0.02 --film-law linear "
    "--indenter sphere --radius 128.8 --radius-uncertainty 0.5"
)
for number in (1, 2, 3):
    run(
        f"import log_{number}.csv -o slide_{number}.h5 --x x --u U --time t --sliding way "
        f"--load {LOAD} --load-uncertainty 0.014 --tangential-load Q "
        f"--low-pass {LOW_PASS:g} --low-pass-uncertainty 0.5 {STATED}",
        shown=number == 2,
    )

# %% [markdown]
# ## 5. Friction by speed
#
# `compare` with `sliding=True` (`--sliding`) holds all passes against sliding contacts. Shift and
# skew turn round with the direction, and the centre does not, but for the backlash, whose standard
# uncertainty is stated. Without one (`backlash=None`) each pass has a centre of its own, the skew
# alone tells, and the uncertainty is some times larger.

# %%
scans = [folder / f"slide_{number}.h5" for number in (1, 2, 3)]
comparison = memscal.compare(scans, sensor, sliding=True, backlash=BACKLASH)
print(comparison.answer())

# %%
comparison.plot()

# %% [markdown]
# (a) has the points of each pass, forth and back, and the contacts that explain them; (b) the
# friction coefficient by speed. Each row of the table has beside it what the tangential load cell
# says, and what the logs were made with.

# %%
lines = ["| speed (mm/s) | by the sensor | 95 % interval | Q/P | true |", "|---|---|---|---|---|"]
for ((_, speed), found), scan, true in zip(comparison.speeds.items(), scans, TRUE, strict=True):
    stated = memscal.read_scan(scan)
    ratio = np.mean(np.abs(stated.tangential_load)) / LOAD
    ends = f"{found.interval.low:.3f} to {found.interval.upper:.3f}"
    lines.append(f"| {speed / MM:g} | {found.value:.3f} | {ends} | {ratio:.3f} | {true:.3f} |")
Markdown("\n".join(lines))

# %% [markdown]
# The checks `tangential_load` compare the two. They are independent: the load cell measures the
# whole tangential force, the sensor the shift of the normal stress below.
#
# ## 6. What the low-pass does if it is not stated
#
# At 10 mm/s it lags by 0.16 mm, forth and back, and so does the peak of the stress: the opposite of
# what friction does. `tangential_load` and `skew_and_shift` then fail.

# %%
fast = memscal.read_scan(scans[2])
unstated = replace(fast, sensor=replace(fast.sensor, dynamics=None))
wrong = memscal.compare(unstated, sensor, sliding=True, backlash=BACKLASH)
print(wrong.answer())
(found_wrong,) = wrong.joint.values()

# %%
fig, ax = plt.subplots()
speeds = SPEEDS / MM
found = list(comparison.speeds.values())
low = [each.value - each.interval.low for each in found]
high = [each.interval.upper - each.value for each in found]
values = [each.value for each in found]
ax.errorbar(speeds, values, yerr=[low, high], fmt="o", label="by the sensor, 95 %")
ax.plot(speeds, TRUE, "k_", ms=14, label="what the logs were made with")
ax.plot(speeds[2], found_wrong["sliding"].value, "x", color="C3", label="low-pass not stated")
ax.set(xscale="log", xlabel="speed (mm/s)", ylabel="friction coefficient")
ax.legend()
plt.show()

# %% [markdown]
# A delay t between encoder and reading does the same: it looks like a friction that is less by
# about V t over 1.5 mm. Measure at two speeds, or state it with the backlash.
#
# ## 7. The same at the terminal
#
# ```console
# memscal import log_1.csv -o slide_1.h5 --x x --u U --time t --sliding way --low-pass 10 ...
# memscal compare sensor.apparatus.h5 slide_*.h5 --sliding --backlash 5 --figure friction.png
# ```

# %%
scratch.cleanup()
