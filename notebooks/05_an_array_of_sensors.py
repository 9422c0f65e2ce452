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
# # An array of sensors: from a scan to contacts in a stream
#
# Sensors under one film are calibrated together, by one scan with a thin rod: conversion constants,
# crosstalk and centres. Then the array finds where contacts press, and how strongly, in single
# frames, and in a stream of frames while its baselines drift.
#
# **All data here are synthetic.** `memscal.simulate` made the scan, and the frames are what the
# calibrated array itself predicts, with noise and drift.

# %%
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

import memscal

MM, MV = 1e-3, 1e-3  # memscal computes in SI units

# %matplotlib inline
scratch = TemporaryDirectory()  # where the files of this notebook go
folder = Path(scratch.name)
random = np.random.default_rng(5)
plt.rcParams.update({"figure.figsize": (7.2, 3.0), "figure.dpi": 80, "font.size": 9})
plt.rcParams.update({"figure.constrained_layout.use": True, "legend.frameon": False})

# %% [markdown]
# ## 1. A scan of all sensors
#
# A grid of 3 x 3 sensors, 2 mm apart, as the film is thick. The rod presses on a raster of points,
# and at each of them all sensors are read: one press is one press for all. 1 % of each sensor's
# signal leaks into its neighbours.
#
# Your own table has a column for each sensor: `memscal import table.csv -o scan.h5 --x x --y y --u
# 'u_*' --layout layout.csv` makes such a scan of it.

# %%
scan = memscal.simulate(array=(3, 3), pitch=2e-3, crosstalk=0.01, seed=5)
memscal.write_scan(scan, folder / "array_scan.h5")
print(scan.sensors, scan.u_zz.shape)

# %% [markdown]
# ## 2. Calibration
#
# All sensors are fitted at once. Each alone would take its neighbours' signal for its own: with 1 %
# of crosstalk A would be 3 % too large, and most checks would pass.

# %%
calibration = memscal.calibrate_array(folder / "array_scan.h5")
array = calibration.array
array.save(folder / "array.h5")
print(calibration)

# %%
calibration.plot()

# %% [markdown]
# Arrows (a) are the centres' offsets from the layout, enlarged. No estimate of a contact is better
# than the bounds (e, f): they are small between the sensors, and grow outside.
#
# Check, in this order:
#
# - **`crosstalk_identified`**: is the crosstalk known at all? On a line of sensors closer than the
#   film is thick it is not, unless all have the same G. Where this fails, A has the uncertainty
#   that this costs, and the crosstalk is not printed;
# - **`dead_taxels`**: which sensors are left out;
# - **`layout`**: are the centres where the sensors were built?
#
# By convention a sensor's crosstalk with itself is 1: only the products of crosstalk and conversion
# constants are observed. A uniform pressure p therefore reads more than A p:

# %%
gain = array.crosstalk @ array.conversion_constants
for name, constant, uniform in zip(array.sensors, array.conversion_constants, gain, strict=True):
    print(f"{name}: A {constant / MV:.3e} mV/Pa, under uniform pressure {uniform / MV:.3e} mV/Pa")

# %% [markdown]
# The errors of the conversion constants are correlated: by the load, the film, and the common shape
# of G. Their ratios are known better than they are:

# %%
share = array.covariance / np.outer(array.conversion_constants, array.conversion_constants)
ratio = share[0, 0] + share[1, 1] - 2 * share[0, 1]
print(f"u(A) of {array.sensors[0]}: {share[0, 0] ** 0.5:.2%}")
print(f"u(A/A) of {array.sensors[0]} over {array.sensors[1]}: {ratio**0.5:.2%}")

# %% [markdown]
# ## 3. Contacts in single frames
#
# A frame is one reading of each sensor, zero without contact. Shear moves the readings as another
# place does, by up to 0.2 mm here, so `locate` counts an unknown shear of 0.3 of the force unless
# you say otherwise; here there is none, and `shear=0` says so.

# %%
places = random.uniform(-2e-3, 2e-3, size=(40, 2))
forces = random.uniform(0.3, 2.0, size=40)
frames = array.predict(places, forces)
frames += random.multivariate_normal(np.zeros(len(array.sensors)), array.noise, size=40)

contacts = array.locate(frames, shear=0.0)
print(contacts.answer())
x, y, force = contacts.uncertainties.T
for what, error, stated, unit in (
    ("x (um)", contacts.x - places[:, 0], x, 1e-6),
    ("y (um)", contacts.y - places[:, 1], y, 1e-6),
    ("force (mN)", contacts.force - forces, force, 1e-3),
):
    rms, u = np.sqrt(np.mean(error**2)) / unit, np.sqrt(np.mean(stated**2)) / unit
    print(f"{what}: error {rms:.1f} rms, stated {u:.1f}")

# %%
fig, ax = plt.subplots(figsize=(4.6, 3.6))
ax.plot(*array.centres.T / MM, "s", mfc="none", color="0.6", label="sensors")
ax.plot(*places.T / MM, "+", color="k", label="truth")
ax.errorbar(contacts.x / MM, contacts.y / MM, 2 * y / MM, 2 * x / MM, fmt="none", color="0.6")
drawn = ax.scatter(contacts.x / MM, contacts.y / MM, s=12, c=contacts.force, zorder=3)
fig.colorbar(drawn, label="force (N)")
ax.set(aspect="equal", xlabel="x (mm)", ylabel="y (mm)")
fig.legend(loc="outside upper center", ncols=2)
plt.show()

# %% [markdown]
# ## 4. A recorded stream
#
# Four minutes at 50 frames a second. A finger presses slowly, slides a little, and holds for almost
# two minutes; all the while the baselines drift, by 10 % of the largest reading. Sensor 5 is stuck
# for a while.

# %%
RATE = 50
t = np.arange(240 * RATE) / RATE
force = np.interp(t, [0, 40, 60, 170, 171, 240], [0, 0, 0.5, 0.5, 0, 0])
path = np.stack([np.interp(t, [60, 90], [-0.6e-3, 0.7e-3]), np.full(t.size, 0.3e-3)], axis=1)
signal = array.predict(path, force)
peak = array.predict(array.centres).max()
wander = random.normal(size=(t.size, 10)).cumsum(axis=0) / np.sqrt(t.size)
drift = 0.1 * peak * (wander[:, :1] + 0.05 * wander[:, 1:])
noise = random.multivariate_normal(np.zeros(9), array.noise, size=t.size)
recorded = signal + drift + noise + 20 * MV
recorded[190 * RATE : 210 * RATE, 4] = recorded[190 * RATE, 4]
np.savez(folder / "recorded.npz", t=t, u=recorded)

fig, ax = plt.subplots()
ax.plot(t, (recorded - recorded[:RATE].mean(axis=0)) / MV, lw=0.6)
ax.set(xlabel="time (s)", ylabel="reading (mV)", title="what the nine sensors read")
plt.show()

# %% [markdown]
# To play it, frames are pushed as they come, here half a second at a time. Each frame has a record:
# is there a contact, where, how strongly, with which covariance.
#
# A stream can be stopped and continued: `state()` holds what it remembers.

# %%
played = np.load(folder / "recorded.npz")["u"]
blocks = np.split(played, 480)

stream = array.stream(rate=RATE)
records = [stream.push(block) for block in blocks[:240]]
np.savez(folder / "state.npz", **stream.state())

continued = array.stream(rate=RATE)
continued.restore(np.load(folder / "state.npz"))
for number, block in enumerate(blocks[240:], 240):
    records.append(continued.push(block))
    if number in (400, 479):
        print(f"left out after {(number + 1) / 2:.0f} s:", continued.left_out)
frames = np.concatenate(records)
print(frames.dtype.names)

# %% [markdown]
# What a moving average of 10 s would make of the same frames stands beside it: it follows the
# drift, and takes a contact that stays for drift as well.

# %%
width = 10 * RATE
sums = np.cumsum(np.vstack([np.zeros(9), played]), axis=0)
average = (sums[width:-1] - sums[: -width - 1]) / width
naive = array.locate((played[width:] - average)[::5], shear=0.0)

held = (t > 100) & (t < 170)
stated = np.sqrt(frames["covariance"][:, 2, 2])
fig, axes = plt.subplots(1, 2)
averaged = np.nan_to_num(naive.force)
axes[0].plot(t[width::5], averaged, ".", ms=2, color="0.7", label="moving average")
axes[0].plot(t, frames["force"], ".", ms=1, label="stream")
axes[0].plot(t, force, "k", lw=1, label="truth")
axes[0].set(xlabel="time (s)", ylabel="force (N)", ylim=(-0.1, 0.7))
axes[0].legend(loc="upper left", markerscale=5)
axes[1].plot(t, frames["x"] / MM, ".", ms=1)
axes[1].plot(t, np.where(force > 0, path[:, 0], np.nan) / MM, "k", lw=1)
axes[1].set(xlabel="time (s)", ylabel="x (mm)")
plt.show()

error = frames["force"] - force
print(f"force while it is held: error {np.sqrt(np.mean(error[held] ** 2)):.4f} N rms, of 0.5 N")
print(f"stated: {np.sqrt(np.mean(stated[held] ** 2)):.4f} N")
touched = frames["contact"]
print(f"false contacts: {touched[t < 40].sum()} before, {touched[t > 171.2].sum()} after")

# %% [markdown]
# What tells a contact from drift is not how long it lasts: drift is common to all sensors, and a
# contact is local. Whatever presses in the first 0.2 s is taken for the baseline, so start a stream
# without a contact. Creep of the film is not drift of the baselines: it follows the force, and the
# stream cannot tell it from force.
#
# The flags say what else is to be known of a frame: readings that are missing or saturated,
# contacts outside the sensors, sensors that are left out, and frames that one contact does not
# explain.

# %%
for flag in stream.Flag:
    print(f"{flag.name}: {np.sum(frames['flags'] & flag != 0)} frames")

# %% [markdown]
# ## 5. The same at the terminal
#
# ```console
# memscal import table.csv -o array_scan.h5 --x x --y y --u 'u_*' --layout layout.csv
# memscal calibrate array_scan.h5 -o array.h5
# memscal locate array.h5 frames.csv -o contacts.csv --shear 0.3
# ```

# %%
scratch.cleanup()
