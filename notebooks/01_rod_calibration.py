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
# # Calibrating a stress sensor with a thin rod
#
# A sensor under a soft film does not report the stress at a point. It reports a voltage
#
# $$U_{zz}(x, y) = A_{zz}\,\bigl(G_{zz} \otimes \sigma_{zz}\bigr)(x, y), \tag{1}$$
#
# the normal stress $\sigma_{zz}$ at the base of the film, blurred by the *apparatus function*
# $G_{zz}$ (unit integral) and scaled by the *conversion constant* $A_{zz}$. This notebook finds
# both, in the order of the paper whose method this is: Scheibert, Prevost, Frelat, Rey and
# Debrégeas, *Experimental evidence of non-Amontons behaviour at a multicontact interface*
# (EPL, 2008).
#
# A rigid rod of 0.5 mm diameter is pressed with 1 N on a film of 2 mm, at 65 places along a line
# across the sensor. The stress that the rod makes at the base can be calculated, so the voltage
# tells how the sensor blurs it.
#
# **The data here are synthetic.** The scan was calculated with the paper's film, rod and load and
# a Gaussian $G$ of 561 µm, the width that the paper reports; noise, an offset and a drift were
# added. So the truth is known, and at the end of each step we can look at how far we are from it.
# Nothing is tuned to meet it.

# %%
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

import memscal
from memscal.calibration.fields import division_problem
from memscal.deconvolution.division import WhiteNoise, WhiteNoiseDraw
from memscal.figures.sweep import sweep_figure
from memscal.model.notation import format_measured

DATA = Path("../calibration_data")
MM, UM, KPA, MV = 1e-3, 1e-6, 1e3, 1e-3  # memscal computes in SI units; people read these
BLACK, BLUE, ORANGE, GREEN, GREY = "black", "#0072B2", "#D55E00", "#009E73", "0.6"

plt.rcParams.update({"figure.figsize": (6.4, 3.6), "figure.dpi": 110, "font.size": 9})
plt.rcParams.update({"figure.constrained_layout.use": True, "legend.frameon": False})

# %% [markdown]
# ## 1. The scan
#
# A scan file carries everything that a calibration needs beside the voltages: the rod and its
# load, and the film with its uncertainties.

# %%
scan = memscal.read_scan(DATA / "rod_scan_65.h5")

print(f"{scan.title}: {scan.x.size} points, load {scan.load:g} N")
print(f"rod of radius {scan.indenter.radius / MM:g} mm")
print(f"film of {scan.film.thickness / MM:g} mm, E = {scan.film.young_modulus / 1e6:g} MPa")
print(scan.notes)

# %%
fig, ax = plt.subplots()
errors = scan.u_zz_errors / MV
ax.errorbar(scan.x / MM, scan.u_zz / MV, errors, fmt="o", ms=3, lw=0.8, color=BLACK)
radius = scan.indenter.radius / MM
ax.axvspan(-radius, radius, color=GREY, alpha=0.5, lw=0, label="width of the rod, at x = 0")
ax.set(xlabel="position of the rod, x (mm)", ylabel="voltage, $U_{zz}$ (mV)")
ax.legend()
plt.show()

# %% [markdown]
# This is the paper's Fig. 2a; the error bars are mostly smaller than the dots. The peak is five
# times wider than the rod: the film spreads the load over about its own thickness, and the sensor
# blurs it further. How much is the film's and how much the sensor's is the question.
#
# ## 2. Centre, baseline and noise
#
# The peak is not at $x = 0$, and the voltage far away is not zero. Both matter more than they
# seem to. At zero wavenumber Eq. (1) says $A = \int U\,\mathrm{d}A / P$: an offset left in
# the data is integrated over the whole plane.

# %%
offset = 0.001 * np.max(scan.u_zz)
area = np.pi * (8e-3) ** 2
share = offset * area / (scan.synthetic["conversion_constant"] * scan.load)
print(f"An offset of 0.1 % of the maximum over a radius of 8 mm changes A by {share:.1%}.")

# %% [markdown]
# So centre, baseline and drift are not assumed but estimated, together with the profile, from a
# model of the scan: a Gaussian convolved with the calculated stress, and smooth departures from
# it as far as the data ask for them. Every number comes with its standard uncertainty.

# %%
calibration = memscal.calibrate(scan)
apparatus, solution = calibration.apparatus, calibration.solution
estimate = solution.estimate

truth, found = scan.synthetic, apparatus.parameters
for name, unit, scale in (("centre", "mm", MM), ("baseline", "mV", MV), ("drift", "mV", MV)):
    measured = format_measured(found[name] / scale, found.uncertainty(name) / scale, unit)
    print(f"{name:9} {measured:28} true {truth[name] / scale:.4f} {unit}")
print(f"noise     {np.mean(estimate.noise) / MV:.4f} mV                   "
      f"true {truth['noise'] / MV:.4f} mV")  # fmt: skip

# %% [markdown]
# With the baseline gone and the centre found, the left and the right half of the scan must fall
# on one curve, because sensor and film are taken to be axisymmetric. The logarithmic axis shows
# where the voltage sinks into its noise.

# %%
points = estimate.points
distance = points.x - estimate.centre[0]
signal = (points.u - estimate.background) / MV
left = distance < 0
r = np.linspace(0, 8.5e-3, 200)

fig, ax = plt.subplots()
ax.plot(-distance[left] / MM, signal[left], "o", ms=4, mfc="none", color=BLACK, label="left half")
ax.plot(distance[~left] / MM, signal[~left], "o", ms=3, color=BLACK, label="right half")
ax.plot(r / MM, estimate.spectrum.at(r) * scan.load / MV, color=BLUE, label="estimated profile")
ax.axhline(np.mean(estimate.noise) / MV, color=GREY, ls="--", label="noise of one point")
ax.set_yscale("log")
ax.set(xlabel="distance from the centre, r (mm)", ylabel="voltage above the baseline (mV)")
ax.set(ylim=(3e-3, 30))
ax.legend()
plt.show()

# %% [markdown]
# Beyond 3.5 mm single points are lost in noise (those below zero cannot be drawn here). What the
# profile shows there comes from the model: the convolution of the calculated stress with a smooth
# $G$. The faint hump near 5.5 mm is real mechanics. An incompressible film cannot be squeezed
# without flowing outward, and its base feels that. It is 0.4 % of the peak, but it lies on a wide
# ring, and $A$ is an integral over rings. So the calibration also says which share of the
# integral lies beyond the last point, where nothing was measured.

# %%
print(f"Share of the integral beyond the scan: {solution.tail_share:.1%}")

# %% [markdown]
# ## 3. The reference: the stress at the base of the film
#
# The paper calculates $\sigma_{zz}$ with finite elements: a film bonded to a rigid base, pushed
# down uniformly over a disc. For a linear film this is a mixed boundary-value problem that
# Hankel transforms solve to rounding errors. The pressure under the rod is an unknown of it.

# %%
film, rod = scan.film, scan.indenter
free = memscal.indent(film, rod, load=1.0, friction=0.0)
stuck = memscal.indent(film, rod, load=1.0, friction=np.inf)
r = np.linspace(0, 5e-3, 501)

fig, (under, base) = plt.subplots(1, 2, figsize=(8, 3.4))
inside = np.linspace(0, 0.999 * rod.radius, 300)
for contact, style, label in ((free, "-", "frictionless"), (stuck, "--", "sticking")):
    under.plot(inside / MM, contact.interface_pressure(inside) / 1e6, style, label=label)
    base.plot(r / MM, contact.base_stress(r) / KPA, style, label=label)
under.set(title="under the rod", xlabel="r (mm)", ylabel="pressure (MPa)", ylim=(0, 30))
base.set(title="at the base of the film", xlabel="r (mm)", ylabel=r"$\sigma_{zz}$ (kPa)")
under.legend()
plt.show()

difference = np.max(np.abs(stuck.base_stress(r) - free.base_stress(r))) / free.base_stress(0.0)
print(f"depth {free.depth / MM:.3f} mm ({free.depth / film.thickness:.0%} of the thickness)")
print(f"force at the base {float(free.base_spectrum(0.0)):.9f} N")
print(f"friction changes the stress at the base by {difference:.1e} of its maximum")

# %% [markdown]
# As the paper says, "for contact regions of dimensions smaller than the film thickness, the
# stress calculated at the base of the film is found to be insensitive to the frictional boundary
# conditions": the two curves on the right cannot be told apart. The force at the base equals the
# load.
#
# The depth deserves a warning. At 1 N the rod sinks through more than a quarter of the film, and
# linear elasticity is formal there. The paper finds the output linear in the load, and a scan at
# several loads is tested for it; the error of the linear model itself is not part of the
# uncertainties below.
#
# ## 4. From profiles to fields
#
# Eq. (1) is a convolution in the plane, so both profiles are lifted to axisymmetric fields.

# %%
fields, grid = solution.fields, solution.fields.grid
half = grid.axis[-1] / MM
extent = (-half, half, -half, half)

fig, axes = plt.subplots(1, 2, figsize=(8, 3.5), sharey=True)
for ax, field, scale, label in (
    (axes[0], fields.voltage * scan.load, MV, "$U_{zz}$ (mV)"),
    (axes[1], fields.reference * scan.load, KPA, r"$\sigma_{zz}$ (kPa)"),
):
    image = ax.imshow(grid.to_image(field) / scale, extent=extent, origin="lower", cmap="viridis")
    fig.colorbar(image, ax=ax, label=label)
    ax.set(xlim=(-5, 5), ylim=(-5, 5), xlabel="x (mm)")
axes[0].set_ylabel("y (mm)")
plt.show()

for choice, reason in apparatus.process.configuration["grid"].items():
    print(f"{choice}: {reason}")

# %% [markdown]
# ## 5. Their Fourier spectra
#
# In Fourier space the convolution is a product, and $A G$ the quotient of two spectra,
#
# $$A_{zz} G_{zz} = \mathcal F^{-1}\left(\frac{\mathcal F\{U_{zz}\}}
# {\mathcal F\{\sigma_{zz}\}}\right). \tag{2}$$

# %%
band = solution.band
k, sigma_hat = fields.along_axis(np.abs(grid.forward(fields.reference)))
shown = k < 6e3

fig, ax = plt.subplots()
ax.semilogy(k[shown] / 1e3, sigma_hat[shown], color=GREEN, label=r"$|\mathcal{F}\{\sigma_{zz}\}|$")
shown = band.k < 6e3
per_a = apparatus.conversion_constant  # so that both spectra begin at one
ax.semilogy(band.k[shown] / 1e3, band.signal[shown] / per_a, color=BLACK,
            label=r"$|\mathcal{F}\{U_{zz}\}| / A$")  # fmt: skip
ax.semilogy(band.k[shown] / 1e3, band.noise[shown] / per_a, color=GREY, label="its noise")
for wavenumber, style, label in (
    (band.relevant, "--", "relevant"),
    (band.resolved, ":", "resolved"),
):
    ax.axvline(
        wavenumber / 1e3, color=BLUE, ls=style, label=f"{label}: {wavenumber / 1e3:.2f} rad/mm"
    )
ax.set(xlabel="wavenumber, k (rad/mm)", ylabel="spectrum (N per N of load)", ylim=(1e-6, 2))
ax.legend()
plt.show()

# %% [markdown]
# $\mathcal F\{\sigma_{zz}\}$ decays almost like $e^{-kh}$: two millimetres of film remove fine
# detail before the sensor can see it. The voltage decays faster still and meets its noise. To the
# right of the crossing the black curve is not data: it is the smooth continuation of the profile.
#
# Two wavenumbers are read from this picture, and stored with the result:
#
# - the **relevant** one, where the voltage stands ten times above its noise. The paper chooses
#   its regularisation by the "weakest relevant spectral component", and this is our rule for it;
# - the **resolved** one, up to which the estimate below knows the transfer function of $G$ to a
#   third of a Gaussian's. Beyond it the scan says little about $G$, whatever the method.
#
# ## 6. Dividing: the white noise as a window
#
# The quotient diverges where $\mathcal F\{\sigma_{zz}\}$ has decayed. The paper adds "a white
# noise of amplitude ten times weaker than the weakest relevant spectral component" to both fields.
# What does that do? For circular complex noise $n$ with $\mathrm E|n|^2 = s^2$,
#
# $$\mathrm E\left[\frac{1}{z + n}\right] = \frac{1 - e^{-|z|^2/s^2}}{z}.$$
#
# On average the noise is a smooth window on the spectrum: open where
# $|\mathcal F\{\sigma_{zz}\}| \gg s$, closed where it is lost. memscal divides with this
# expectation, which is the same every time. The published recipe, one seeded draw, is there too.
# Below, forty draws are made, and each quotient is compared with the exact one: what is left of
# every spectral component, as a mean over the ring of components with nearly the same $k$.

# %%
problem = division_problem(estimate, band, fields)
exact = grid.forward(fields.voltage) / grid.forward(fields.reference)
k, expected = fields.along_axis(WhiteNoise().divide(problem).window)
edges = np.arange(0.1e3, 6e3, 0.25e3)
ring = np.digitize(grid.wavenumber, edges)
in_ring = np.bincount(ring.ravel())


def window_of_draw(seed):
    """Share of the exact quotient that one draw leaves, ring by ring."""
    quotient = grid.transfer(WhiteNoiseDraw(seed=seed).divide(problem).field)
    return (np.bincount(ring.ravel(), (quotient / exact).ravel()) / in_ring)[1:-1]


draws = np.array([window_of_draw(seed) for seed in range(40)])
middle = (edges[1:] + edges[:-1]) / 2

# %%
fig, ax = plt.subplots()
ax.plot(middle / 1e3, draws[:3].T, color=GREY, lw=0.7)
ax.plot([], [], color=GREY, lw=0.7, label="three single draws")
ax.plot(middle / 1e3, draws.mean(axis=0), ".", ms=5, color=ORANGE, label="mean of 40 draws")
shown = k < 6e3
ax.plot(k[shown] / 1e3, expected[shown], color=BLUE, label=r"expectation, $1 - e^{-|z|^2/s^2}$")
ax.axvline(band.resolved / 1e3, color=BLUE, ls=":", label="resolved wavenumber")
ax.set(xlabel="wavenumber, k (rad/mm)", ylabel="share of the exact quotient", ylim=(-0.7, 1.7))
ax.legend(loc="lower left")
plt.show()

# %% [markdown]
# Where the window is open, draws and expectation agree. Where it closes, single draws leave the
# picture: the quotient of two components that are both lost in noise has no finite variance, and
# even the mean of many settles slowly. That is why the expectation is the default.
#
# ## 7. The apparatus function
#
# The quotient, transformed back, is $A\,G$. Its integral is $A$, and what is left has integral
# one. This is the paper's Fig. 2b.

# %%
radial = apparatus.radial_profile
r, g, u = radial.r / MM, radial.g * MM**2, radial.g_errors * MM**2
true_g = memscal.GaussianMixture().radial(radial.r) * MM**2

fig, axes = plt.subplots(1, 2, figsize=(8, 3.6))
for ax in axes:
    ax.fill_between(r, g - 2 * u, g + 2 * u, color=BLUE, alpha=0.25, lw=0, label="band, k = 2")
    ax.plot(r, g, color=BLUE, label="deconvolved G")
    ax.plot(r, radial.g_gaussian * MM**2, "--", color=ORANGE, label="Gaussian, fitted to the scan")
    ax.plot(r, true_g, ":", color=BLACK, label="truth: 561 µm")
    ax.set(xlabel="r (mm)", ylabel="G (1/mm²)", xlim=(0, 3))
axes[1].set_yscale("log")
axes[1].set_ylim(1e-4, 1)
axes[0].legend()
plt.show()

# %% [markdown]
# Two Gaussians can be meant by "the Gaussian fit", and both are kept, each under its own name:
#
# - `gaussian_sigma`: its convolution with $\sigma_{zz}$ is fitted to the scan (*data space*);
# - `gaussian_sigma_deconvolved`: it is fitted to the deconvolved $G$, as in the paper. The window
#   has removed fine detail, so that this one tends to be a little wider.

# %%
for name, unit, scale in (
    ("conversion_constant", "mV/Pa", MV),
    ("gaussian_sigma", "µm", UM),
    ("gaussian_sigma_deconvolved", "µm", UM),
):
    measured = format_measured(found[name] / scale, found.uncertainty(name) / scale, unit)
    true_value = truth[name.removesuffix("_deconvolved")] / scale
    print(f"{name:27} {measured:32} true {true_value:g} {unit}")

# %% [markdown]
# The paper's sensor has a width of 561 µm; ours was given that width, so this only shows that the
# method returns what was put in. The conversion constant is invented: the paper does not print
# its own.
#
# ## 8. Convolving back
#
# The paper's own test: the apparatus function, convolved with the calculated stress, must give
# back the scan, and so must the Gaussian. The residuals are judged by the noise.

# %%
back = apparatus.reconvolution
x = back.x / MM
fig, (top, bottom) = plt.subplots(2, 1, figsize=(6.4, 4.6), sharex=True, height_ratios=(2, 1))
top.errorbar(
    x, back.u_zz / MV, back.u_zz_errors / MV, fmt="o", ms=3, lw=0.8, color=BLACK, label="scan"
)
top.plot(x, back.u_zz_predicted / MV, color=BLUE, label=r"$A\,G \otimes \sigma_{zz}$")
top.plot(x, back.u_zz_gaussian / MV, "--", color=ORANGE, label="with the Gaussian")
top.set(ylabel="$U_{zz}$ (mV)")
top.legend()
bottom.axhspan(-2, 2, color=GREY, alpha=0.2, lw=0)
bottom.plot(x, back.residual / back.u_zz_errors, "o", ms=3, color=BLUE)
gaussian_residual = (back.u_zz - back.u_zz_gaussian) / back.u_zz_errors
bottom.plot(x, gaussian_residual, "x", ms=4, color=ORANGE)
bottom.set(xlabel="position of the rod, x (mm)", ylabel="residual / noise")
plt.show()

# %% [markdown]
# Each check has a value, a limit and a meaning, and goes with the result. A failed check does not
# hide the result; it marks it.

# %%
for check in apparatus.checks:
    verdict = "passed" if check.passed else "FAILED"
    print(f"{check.name:18} {check.value:10.3g}   limit {check.limit:8.3g}   {verdict}")

# %% [markdown]
# This test is necessary, not sufficient: what the rod does not excite cannot be seen in it. A $G$
# with a wrong fine structure beyond the resolved band would pass just as well.
#
# ## 9. Where the uncertainty comes from
#
# Each source is propagated on its own: the scan's noise, what the window may have hidden, the
# load, and the film and rod on which the reference rests. Young's modulus contributes nothing: at
# a given load the stress in a linear film does not depend on it.

# %%
names = ("conversion_constant", "gaussian_sigma", "gaussian_sigma_deconvolved")
sources = list(apparatus.budget["conversion_constant"])
fig, ax = plt.subplots(figsize=(6.4, 3.4))
for i, (name, colour) in enumerate(zip(names, (BLACK, ORANGE, BLUE), strict=True)):
    shares = [100 * apparatus.budget[name].get(source, 0.0) / found[name] for source in sources]
    ax.barh(np.arange(len(sources)) + 0.27 * (i - 1), shares, height=0.25, color=colour, label=name)
ax.set_yticks(range(len(sources)), [source.replace("_", " ") for source in sources])
ax.invert_yaxis()
ax.set(xlabel="standard uncertainty (% of the value)")
ax.legend()
plt.show()

# %% [markdown]
# The conversion constant is limited by the load and the noise; the width by the film's thickness.
# A better sensor would not help there, a better measurement of the film would.
#
# ## 10. Is the amplitude of the white noise important?
#
# "The result is found to be insensitive to the particular amplitude of this white noise." Here it
# is varied over two decades, with the expectation and with single draws.

# %%
sweep = calibration.sweep(amplitudes=9, draws=6)
sweep_figure(sweep)

# %% [markdown]
# With the expectation the claim holds. Below the rule's amplitude hardly anything changes; far
# above it the window cuts into the resolved band, $G$ gets wider, and the reconvolution worse.
#
# Single draws tell more. Their $A$ is safe near the rule's choice, because $A$ is the quotient at
# zero wavenumber, where both spectra are strongest. Their width is not: at any amplitude some
# components are divided by almost nothing, and the ripples that this leaves in $G$ move a Gaussian
# fitted to it by ten percent, now and then by far more. The paper's recipe, read literally, is a
# single draw.
#
# ## 11. Using it: saving, loading, and another load
#
# The result is one file: the apparatus function with its uncertainty, the checks, and where all
# of it came from.

# %%
with TemporaryDirectory() as folder:
    path = Path(folder, "sensor.apparatus.h5")
    apparatus.save(path)
    loaded = memscal.load_apparatus(path)

source = loaded.process.input_scan
print(f"made by {loaded.process.program} {loaded.process.version} from {source.file_name}")
print(f"sha256 of that file: {source.sha256[:16]}...")

# %% [markdown]
# A convolution that gives back its own scan proves little. Predicting a scan that was *not* used
# is the better test. `rod_scan_three_loads.h5` holds three scans, at 0.5, 1 and 1.5 N. From it
# only the sensor's position and the baseline are taken.

# %%
loads = memscal.read_scan(DATA / "rod_scan_three_loads.h5")
other = memscal.calibrate(loads).solution.estimate  # for its own centre and baseline
baseline = other.background.reshape(loads.u_zz.shape)
distance = np.abs(loads.x - other.centre[0])
r = np.linspace(0, 16e-3, 641)

fig, ax = plt.subplots()
for row, colour in enumerate((GREEN, ORANGE, BLUE)):
    load = loads.normal_load[row, 0]
    stress = memscal.indent(loaded.film, loaded.indenter, load=load).base_stress(r)
    predicted = np.interp(distance, r, loaded.predict(r, stress))
    measured = loads.u_zz[row] - baseline[row]
    score = np.mean(((measured - predicted) / loads.u_zz_errors[row]) ** 2)
    ax.plot(loads.x / MM, measured / MV, "o", ms=3, color=colour)
    ax.plot(loads.x / MM, predicted / MV, color=colour, label=f"{load:g} N: chi²/n = {score:.2f}")
ax.set(xlabel="position of the rod, x (mm)", ylabel="voltage above the baseline (mV)")
ax.legend(title="predicted (lines), not fitted")
plt.show()

# %% [markdown]
# ## 12. What is measured and what is extrapolated
#
# The transfer function of the sensor, $|\mathcal F\{G\}|$, with the limit of what the scan
# resolves. To the left is measurement. To the right the curve follows from the window and from
# the assumption that $G$ has no fine detail there.

# %%
transfer = loaded.transfer
shown = transfer.k < 7e3
k, modulus, error = transfer.k[shown] / 1e3, transfer.modulus[shown], transfer.modulus_errors[shown]
limit = loaded.resolved_wavenumber / 1e3

fig, ax = plt.subplots()
ax.fill_between(k, modulus - 2 * error, modulus + 2 * error, color=BLUE, alpha=0.25, lw=0)
ax.plot(k, modulus, color=BLUE, label="deconvolved G, band k = 2")
ax.plot(
    k, np.exp(-0.5 * (loaded.gaussian_sigma * k / MM) ** 2), "--", color=ORANGE, label="Gaussian"
)
ax.plot(k, transfer.window[shown], color=GREY, label="window")
ax.axvspan(limit, 7, facecolor="none", edgecolor=GREY, hatch="//", lw=0)
ax.text(limit + 0.15, 0.75, "not resolved:\nextrapolation", backgroundcolor="white")
ax.set(xlabel="wavenumber, k (rad/mm)", ylabel="transfer function", xlim=(0, 7), ylim=(0, 1.1))
ax.legend(loc="lower left")
plt.show()

print(f"resolved: {limit:.2f} rad/mm, a wavelength of {2 * np.pi / limit:.1f} mm")

# %% [markdown]
# A contact that is wide against this wavelength, such as the paper's sphere, has no power beyond
# the limit, and its convolution with $G$ rests on measurement alone. A prediction for a contact
# with sharper features does not.
#
# ## How this differs from the paper
#
# - The scan is synthetic, calculated by the same linear model that the reference uses. A real film
#   under a rod that sinks in by half a millimetre is not quite linear, and a real sensor disturbs
#   the stress that it measures. Neither shows here.
# - The truth is exactly Gaussian and exactly axisymmetric. The paper's $G$ is only nearly so.
# - Our scan has 65 points, spaced 0.25 mm; the paper's spheres were scanned at 33 points, 0.5 mm
#   apart (`rod_scan_33.h5` is spaced like that), and its rod scan's spacing is not printed.
# - The paper's 561 µm is a result of its measurement; here it was put in. It is compared with, and
#   never tuned to.
# - The reference comes from Hankel transforms instead of finite elements.
#   `rod_reference_fem.csv` holds one from finite elements; it changes the result by far less than
#   the uncertainty.
# - The paper adds one draw of white noise; the default here is the expectation over all draws.
