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
# A sensor under a soft film gives a voltage
#
# $$U_{zz}(x, y) = A_{zz}\,\bigl(G_{zz} \otimes \sigma_{zz}\bigr)(x, y), \tag{1}$$
#
# the normal stress $\sigma_{zz}$ at the base of the film, blurred by the *apparatus function*
# $G_{zz}$ (unit integral) and scaled by the *conversion constant* $A_{zz}$. This notebook estimates
# both step by step, in the order of the paper: Scheibert, Prevost, Frelat, Rey and
# Debrégeas, *Experimental evidence of non-Amontons behaviour at a multicontact interface*
# (EPL, 2008). At the end `memscal.calibrate` does the same in one call, with uncertainties.
#
# A rigid rod of 0.5 mm diameter is pressed with 1 N on a film of 2 mm, at 65 places along a line
# across the sensor.
#
# **The data here are synthetic.** The scan was calculated with the paper's film, rod and load and
# a Gaussian $G$ of 561 µm, the width that the paper reports; noise, an offset and a drift were
# added. Each result is compared with these true values.

# %%
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import make_smoothing_spline
from scipy.optimize import least_squares
from scipy.special import j0

import memscal

DATA = Path("../calibration_data")
MM, UM, KPA, MV = 1e-3, 1e-6, 1e3, 1e-3  # memscal computes in SI units
BLACK, BLUE, ORANGE, GREEN, GREY = "black", "#0072B2", "#D55E00", "#009E73", "0.6"

# %matplotlib inline
plt.rcParams.update({"figure.figsize": (6.4, 3.6), "figure.dpi": 80, "font.size": 9})
plt.rcParams.update({"figure.constrained_layout.use": True, "legend.frameon": False})

# %% [markdown]
# ## 1. Read the scan
#
# A scan file holds the voltages, the rod and its load, and the film with its uncertainties.

# %%
scan = memscal.read_scan(DATA / "rod_scan_65.h5")
x, u, noise = scan.x, scan.u_zz, scan.u_zz_errors
film, rod, truth = scan.film, scan.indenter, scan.synthetic

print(f"{scan.title}: {x.size} points, load {scan.load:g} N")
print(f"rod of radius {rod.radius / MM:g} mm")
print(f"film of {film.thickness / MM:g} mm, E = {film.young_modulus / 1e6:g} MPa")
print(scan.notes)

# %%
fig, ax = plt.subplots()
ax.errorbar(x / MM, u / MV, noise / MV, fmt="o", ms=3, lw=0.8, color=BLACK)
radius = rod.radius / MM
ax.axvspan(-radius, radius, color=GREY, alpha=0.5, lw=0, label="width of the rod, at x = 0")
ax.set(xlabel="position of the rod, x (mm)", ylabel="voltage, $U_{zz}$ (mV)")
ax.legend()
plt.show()

# %% [markdown]
# This is the paper's Fig. 2a; most error bars are smaller than the dots. The peak is five times
# wider than the rod: the film spreads the load over about its own thickness, and the sensor blurs
# it further.
#
# ## 2. Calculate the stress at the base of the film
#
# The paper calculates $\sigma_{zz}$ with finite elements: a linear film bonded to a rigid base,
# pushed down uniformly over a disc. memscal solves this mixed boundary-value problem with Hankel
# transforms; the pressure under the rod is its unknown. The scan states that its film is
# neo-Hookean: memscal solves this by finite elements, and a calibration takes it from a table.

# %%
linear = replace(film, law="linear")
free = memscal.indent(linear, rod, load=scan.load, friction=0.0)
stuck = memscal.indent(linear, rod, load=scan.load, friction=np.inf)
rubber = memscal.indent(film, rod, load=scan.load, friction=np.inf)
r = np.linspace(0, 16e-3, 321)

fig, (under, base) = plt.subplots(1, 2, figsize=(8, 3.4))
inside = np.linspace(0, 0.999 * rod.radius, 300)
for contact, style, label in (
    (free, "-", "linear, frictionless"),
    (stuck, "--", "linear, sticking"),
    (rubber, ":", "neo-Hookean, sticking"),
):
    under.plot(inside / MM, contact.interface_pressure(inside) / 1e6, style, label=label)
    base.plot(r / MM, contact.base_stress(r) / KPA, style, label=label)
under.set(title="under the rod", xlabel="r (mm)", ylabel="pressure (MPa)", ylim=(0, 30))
base.set(title="at the base of the film", xlabel="r (mm)", ylabel=r"$\sigma_{zz}$ (kPa)")
base.set_xlim(0, 5)
under.legend()
plt.show()

for contact in (free, rubber):
    share = contact.depth / film.thickness
    print(
        f"{contact.strain} strain: depth {contact.depth / MM:.3f} mm ({share:.0%} of the thickness)"
    )
difference = np.max(np.abs(stuck.base_stress(r) - free.base_stress(r))) / free.base_stress(0.0)
print(f"force at the base {float(free.base_spectrum(0.0)):.9f} N")
print(f"friction changes the stress at the base of the linear film by {difference:.1e}")
print(f"the law changes it by {rubber.max_base_stress / free.max_base_stress - 1:.0%}")

# %% [markdown]
# As the paper says, "for contact regions of dimensions smaller than the film thickness, the
# stress calculated at the base of the film is found to be insensitive to the frictional boundary
# conditions": the curves of the linear film on the right coincide. The force at the base equals
# the load.
#
# At 1 N the rod sinks through more than a quarter of the film, beyond what linear elasticity
# describes, and the law of the film changes the stress by a third. Where a scan does not state
# the law, the difference is part of the uncertainties.
#
# ## 3. Lift the stress to a field
#
# Eq. (1) is a convolution in the plane, so the radial profile is lifted to an axisymmetric field:
# $\sigma_{zz}(x, y) = \sigma_{zz}(r)$ with $r = \sqrt{x^2 + y^2}$.

# %%
SPACING, EXTENT = 0.1e-3, 16e-3  # m
stress = memscal.lift(r, free.base_stress(r), SPACING, EXTENT)
print(stress)
print(f"its integral is {stress.integral:.4f} N; the rest of the load lies beyond 16 mm")

# %% [markdown]
# ## 4. Centre, baseline and noise
#
# The peak is not at $x = 0$, and the voltage far away is not zero. At zero wavenumber Eq. (1) is
# $A = \int U\,\mathrm{d}x\,\mathrm{d}y / P$, so an offset in the data is integrated over the whole
# plane.

# %%
offset = 0.001 * np.max(u)
share = offset * np.pi * (8e-3) ** 2 / (truth["conversion_constant"] * scan.load)
print(f"An offset of 0.1 % of the maximum over a radius of 8 mm changes A by {share:.1%}.")

# %% [markdown]
# Centre $c$, baseline $b$ and drift $d$ are fitted together with a first model of the sensor, a
# Gaussian of width $s$:
#
# $$U(x) = A\,(g_s \otimes \sigma_{zz})(|x - c|) + b + d\,x / L,
# \qquad g_s(r) = \frac{e^{-r^2/2s^2}}{2\pi s^2}.$$


# %%
def gaussian(sigma):
    return memscal.lift(
        r, np.exp(-(r**2) / (2 * sigma**2)) / (2 * np.pi * sigma**2), SPACING, EXTENT
    )


def model(p):
    a, sigma, centre, baseline, drift = p * UNITS
    peak = memscal.reconvolve(a, gaussian(sigma), stress)
    return np.interp(np.abs(x - centre), peak.r, peak.radial) + baseline + drift * x / np.ptp(x)


UNITS = np.array([1e-7, MM, MM, MV, MV])
fit = least_squares(lambda p: (u - model(p)) / noise, [1.0, 0.5, 0.0, 0.0, 0.0])
a_fit, sigma_fit, centre, baseline, drift = fit.x * UNITS
errors = np.sqrt(np.diag(np.linalg.inv(fit.jac.T @ fit.jac))) * UNITS

for name, value, error, scale, unit in (
    ("centre", centre, errors[2], MM, "mm"),
    ("baseline", baseline, errors[3], MV, "mV"),
    ("drift", drift, errors[4], MV, "mV"),
):
    print(
        f"{name:9} {value / scale:.4f} ± {error / scale:.4f} {unit}",
        f"  true {truth[name] / scale:.4f}",
    )
print(f"chi-square per degree of freedom: {2 * fit.cost / (x.size - 5):.2f}")

# %% [markdown]
# With baseline and drift subtracted, the left and the right half of the scan fall on one curve, if
# sensor and film are axisymmetric. The Gaussian has served for centre, baseline and drift only: the
# profile that is divided is a smoothing spline through the voltages. Beyond the scan it goes on as
# the film's own decay, in proportion to $\sigma_{zz}(r)$, with an amplitude fitted to the points
# beyond 4 mm.

# %%
distance = np.abs(x - centre)
order = np.argsort(distance)
distance, left = distance[order], (x < centre)[order]
signal = (u - baseline - drift * x / np.ptp(x))[order]

smooth = make_smoothing_spline(  # even in r; its strength by generalised cross-validation
    np.r_[-distance[::-1], distance] / MM, np.r_[signal[::-1], signal] / MV
)
outer = distance > 4 * MM
decay = free.base_stress(distance[outer])
amplitude = decay @ signal[outer] / (decay @ decay)
r_profile, end = r, distance[-1]
within = smooth(np.minimum(r_profile, end) / MM) * MV
u_profile = np.where(r_profile <= end, within, amplitude * free.base_stress(r_profile))

fig, ax = plt.subplots()
ax.plot(distance[left] / MM, signal[left] / MV, "o", ms=4, mfc="none", color=BLACK, label="left")
ax.plot(distance[~left] / MM, signal[~left] / MV, "o", ms=3, color=BLACK, label="right")
ax.plot(r_profile / MM, u_profile / MV, color=BLUE, label="profile")
ax.axhline(np.mean(noise) / MV, color=GREY, ls="--", label="noise of one point")
ax.set(xlabel="distance from the axis r (mm)", ylabel="voltage above the baseline (mV)")
ax.set(yscale="log", xlim=(0, 8.5), ylim=(3e-3, 30))
ax.legend()
plt.show()

# %% [markdown]
# Negative values cannot be drawn on this axis. The maximum near 5.5 mm comes from the film: it is
# incompressible and moves outward when it is squeezed. It is 0.4 % of the peak, but on a wide ring,
# and $A$ is an integral over rings.
#
# ## 5. Lift the voltage

# %%
voltage = memscal.lift(r_profile, u_profile, SPACING, EXTENT)

fig, axes = plt.subplots(1, 2, figsize=(8, 3.5), sharey=True)
side = (voltage.x[0] / MM, voltage.x[-1] / MM) * 2
for ax, field, scale, label in (
    (axes[0], voltage, MV, "$U_{zz}$ (mV)"),
    (axes[1], stress, KPA, r"$\sigma_{zz}$ (kPa)"),
):
    image = ax.imshow(field.image / scale, extent=side, origin="lower", cmap="viridis")
    fig.colorbar(image, ax=ax, label=label)
    ax.set(xlim=(-5, 5), ylim=(-5, 5), xlabel="x (mm)")
axes[0].set_ylabel("y (mm)")
plt.show()

# %% [markdown]
# ## 6. Fourier spectra, and the weakest relevant component
#
# In Fourier space the convolution is a product, and $A\,G$ the quotient of two spectra,
#
# $$A_{zz} G_{zz} = \mathcal F^{-1}\left(\frac{\mathcal F\{U_{zz}\}}
# {\mathcal F\{\sigma_{zz}\}}\right). \tag{2}$$
#
# Each point stands for a ring of area $w_i = 2\pi r_i\,\Delta r_i$, so the noise of the voltage's
# spectrum is nearly $\sqrt{\sum_i [w_i n_i J_0(k r_i)]^2}$. A component is *relevant*, here,
# while the voltage stands 15 times above this noise. The paper's regularisation goes by the
# "weakest relevant spectral component".

# %%
k, u_hat = voltage.spectrum()
sigma_hat = stress.spectrum()[1]
shown = k < 6e3
ring_noise = 2 * np.pi * distance * np.gradient(distance) * np.mean(noise)
noise_hat = np.sqrt(np.sum((ring_noise * j0(np.outer(k[shown], distance))) ** 2, axis=1))
last = np.argmax(u_hat[shown] < 15 * noise_hat)
weakest = sigma_hat[last]

fig, ax = plt.subplots()
ax.semilogy(k[shown] / 1e3, sigma_hat[shown], color=GREEN, label=r"$|\mathcal{F}\{\sigma_{zz}\}|$")
ax.semilogy(
    k[shown] / 1e3, u_hat[shown] / a_fit, color=BLACK, label=r"$|\mathcal{F}\{U_{zz}\}| / A$"
)
ax.semilogy(k[shown] / 1e3, noise_hat / a_fit, color=GREY, label="its noise")
ax.axvline(k[last] / 1e3, color=BLUE, ls="--", label=f"relevant up to {k[last] / 1e3:.2f} rad/mm")
ax.set(xlabel="wavenumber, k (rad/mm)", ylabel="spectrum (N)", ylim=(1e-6, 2))
ax.legend()
plt.show()

# %% [markdown]
# $\mathcal F\{\sigma_{zz}\}$ decays almost like $e^{-kh}$: the film removes fine detail. The
# voltage decays faster; to the right of its crossing with the noise the black curve is noise that
# the spline has left, not signal.
#
# ## 7. Divide
#
# The quotient diverges where $\mathcal F\{\sigma_{zz}\}$ has decayed. The paper adds "a white
# noise of amplitude ten times weaker than the weakest relevant spectral component" to both fields.
# For circular complex noise $n$ with $\mathrm E|n|^2 = s^2$,
#
# $$\mathrm E\left[\frac{1}{z + n}\right] = \frac{1 - e^{-|z|^2/s^2}}{z}.$$
#
# On average the noise is a smooth window on the spectrum: one where
# $|\mathcal F\{\sigma_{zz}\}| \gg s$, zero where it is much smaller. memscal divides with this
# expectation; the published procedure, one seeded draw, is available too. The figure compares 20
# draws with the exact quotient: the share of every component, as a mean over rings of nearly equal
# $k$.

# %%
quotient = memscal.divide(voltage, stress, weakest=weakest)


def transform(field):
    return np.fft.rfft2(np.fft.ifftshift(field.image[:-1, :-1])).real


size = voltage.x.size - 1
kx, ky = (2 * np.pi * f(size, SPACING) for f in (np.fft.rfftfreq, np.fft.fftfreq))
edges = np.arange(0.1e3, 6e3, 0.25e3)
ring = np.digitize(np.hypot(*np.meshgrid(kx, ky)), edges).ravel()
exact = (transform(voltage) / transform(stress) / SPACING**2).ravel()


def share_left(field):
    shares = transform(field).ravel() / exact
    return (np.bincount(ring, shares) / np.bincount(ring))[1:-1]


draws = np.array(
    [
        share_left(
            memscal.divide(
                voltage, stress, weakest=weakest, method="white-noise-draw", options={"seed": seed}
            )
        )
        for seed in range(20)
    ]
)
expected = 1 - np.exp(-((sigma_hat[shown] / (0.1 * weakest)) ** 2))
middle = (edges[1:] + edges[:-1]) / 2

fig, ax = plt.subplots()
ax.plot(middle / 1e3, draws[:3].T, color=GREY, lw=0.7)
ax.plot([], [], color=GREY, lw=0.7, label="three single draws")
ax.plot(middle / 1e3, draws.mean(axis=0), ".", ms=5, color=ORANGE, label="mean of 20 draws")
ax.plot(k[shown] / 1e3, expected, color=BLUE, label=r"expectation, $1 - e^{-|z|^2/s^2}$")
ax.set(xlabel="wavenumber, k (rad/mm)", ylabel="share of the exact quotient", ylim=(-0.7, 1.7))
ax.legend(loc="lower left")
plt.show()

# %% [markdown]
# Where the window is near one, draws and expectation agree. Where it falls to zero, the quotient of
# two components below the noise has no finite variance, and the mean of many draws converges
# slowly. The expectation is therefore the default.
#
# ## 8. Normalise, and fit a Gaussian
#
# $$A_{zz} = \int A_{zz} G_{zz}\,\mathrm dx\,\mathrm dy, \qquad
# \int G_{zz}\,\mathrm dx\,\mathrm dy = 1. \tag{3}$$
#
# The width is that of the Gaussian nearest to $G$ over the plane, as in the paper's Fig. 2b.

# %%
A, G = memscal.normalise(quotient)
sigma = memscal.fit_gaussian(G)

print(f"A     = {A / MV:.4e} mV/Pa, true {truth['conversion_constant'] / MV:.4e}")
print(f"sigma = {sigma / UM:.0f} µm, true {truth['gaussian_sigma'] / UM:.0f}")

# %% [markdown]
# ## 9. Convolve back
#
# The paper's test: $A\,(G \otimes \sigma_{zz})$, Eq. (1), must agree with the scan within its
# noise.

# %%
back = memscal.reconvolve(A, G, stress)
predicted = np.interp(distance, back.r, back.radial)
residual = (signal - predicted) / noise[order]

fig, (top, bottom) = plt.subplots(2, 1, figsize=(6.4, 4.6), sharex=True, height_ratios=(2, 1))
top.errorbar(distance / MM, signal / MV, noise / MV, fmt="o", ms=3, lw=0.8, color=BLACK)
top.plot(back.r / MM, back.radial / MV, color=BLUE, label=r"$A\,G \otimes \sigma_{zz}$")
top.set(ylabel="$U_{zz}$ (mV)", xlim=(-0.1, 8.5))
top.legend()
bottom.axhspan(-2, 2, color=GREY, alpha=0.2, lw=0)
bottom.plot(distance / MM, residual, "o", ms=3, color=BLUE)
bottom.set(xlabel="distance from the axis r (mm)", ylabel="residual / noise")
plt.show()

print(f"mean square of residual / noise: {np.mean(residual**2):.2f}")

# %% [markdown]
# The test is necessary, not sufficient: a $G$ with a wrong fine structure beyond the resolved band
# passes as well, because the rod does not excite it.
#
# ## 10. The same in one call
#
# `memscal.calibrate` does all of this. Beyond the steps above its spline is stiffer where the
# film's stress has decayed, and it weighs outliers, chooses the grid, propagates the uncertainties
# of noise, load, film and rod, and checks the result. It also computes the Bayesian estimate, which
# divides nothing and stands below as a second table. The first two lines say which A and which
# description of $G$ to use.

# %%
calibration = memscal.calibrate(scan)
print(calibration)

# %%
apparatus = calibration.apparatus
values, radial = apparatus.parameters, apparatus.radial_profile

print("                    by hand     calibrate          difference / u")
for name, label, by_hand, scale in (
    ("conversion_constant", "A (1e-4 mV/Pa)", A, 1e-7),
    ("gaussian_sigma", "σ, scan (mm)", sigma_fit, MM),
    ("gaussian_sigma_deconvolved", "σ, of G (mm)", sigma, MM),
):
    value, uncertainty = values[name], values.uncertainty(name)
    print(
        f"{label:18}  {by_hand / scale:.4f}      {value / scale:.4f} ± {uncertainty / scale:.4f}"
        f"    {(by_hand - value) / uncertainty:+.1f}"
    )

# %%
r_g, g, u_g = radial.r / MM, radial.g * MM**2, radial.g_errors * MM**2
true_g = np.exp(-(radial.r**2) / (2 * (561 * UM) ** 2)) / (2 * np.pi * 0.561**2)

fig, axes = plt.subplots(1, 2, figsize=(8, 3.6))
for ax in axes:
    ax.fill_between(r_g, g - 2 * u_g, g + 2 * u_g, color=BLUE, alpha=0.25, lw=0)
    ax.plot(r_g, g, color=BLUE, label="calibrate, band k = 2")
    ax.plot(G.r / MM, G.radial * MM**2, "--", color=ORANGE, label="by hand")
    ax.plot(r_g, true_g, ":", color=BLACK, label="truth: 561 µm")
    ax.set(xlabel="r (mm)", ylabel="G (1/mm²)", xlim=(0, 3))
axes[1].set(yscale="log", ylim=(1e-4, 1))
axes[0].legend()
plt.show()

# %% [markdown]
# Both ways give the same $A$ and $G$ within the stated uncertainties. Two Gaussian widths are kept:
# `gaussian_sigma` is fitted to the scan, `gaussian_sigma_deconvolved` to the deconvolved $G$, as in
# the paper. The paper's 561 µm was put into the scan, and the conversion constant is invented: the
# paper does not print its own.
#
# In the last panel the scan does not determine $G$ to the right of the resolved wavenumber: a
# division leaves these components out, the Bayesian estimate extrapolates. The spectrum of a
# contact that is wide against this wavelength, such as the paper's sphere, is negligible there.

# %%
calibration.plot()

# %%
limit = apparatus.resolved_wavenumber * MM
print(f"resolved: {limit:.2f} rad/mm, a wavelength of {2 * np.pi / limit:.1f} mm")

# %% [markdown]
# ## 11. Where the uncertainty comes from
#
# Each source is propagated on its own: noise, what the window hides, load, film and rod. Young's
# modulus contributes nothing: at a given load the stress in a linear film does not depend on it.

# %%
names = ("conversion_constant", "gaussian_sigma", "gaussian_sigma_deconvolved")
sources = list(apparatus.budget["conversion_constant"])
fig, ax = plt.subplots(figsize=(6.4, 3.4))
for i, (name, colour) in enumerate(zip(names, (BLACK, ORANGE, BLUE), strict=True)):
    shares = [200 * apparatus.budget[name].get(source, 0.0) / values[name] for source in sources]
    ax.barh(np.arange(len(sources)) + 0.27 * (i - 1), shares, height=0.25, color=colour, label=name)
ax.set_yticks(range(len(sources)), [source.replace("_", " ") for source in sources])
ax.invert_yaxis()
ax.set(xlabel="uncertainty, k = 2 (% of the value)")
ax.legend()
plt.show()

# %% [markdown]
# The load and the noise limit the conversion constant; the film's thickness limits the width fitted
# to the scan, and the window that of the deconvolved $G$.
#
# ## 12. The amplitude of the white noise
#
# "The result is found to be insensitive to the particular amplitude of this white noise." Here it
# is varied over two decades, with the expectation and with single draws.

# %%
sweep = calibration.sweep(amplitudes=9, draws=4)
sweep.plot()

# %% [markdown]
# With the expectation this is so. Below the rule's amplitude $A$ changes by less than 0.1 % and the
# width by less than 3 %; far above it the window reduces the resolved band, $G$ gets wider, and the
# reconvolution worse.
#
# Of single draws, $A$ is stable near the rule's amplitude, because $A$ is the quotient at zero
# wavenumber, where both spectra are strongest. Their width is not: at any amplitude some components
# are divided by values near zero, and the ripples in $G$ change the width of a Gaussian fitted to
# it by ten percent, sometimes by far more. The paper describes a single draw.
#
# ## 13. Save, load, and predict another load
#
# The artifact holds the apparatus function with its uncertainty, the checks, and the provenance.

# %%
with TemporaryDirectory() as folder:
    path = Path(folder, "sensor.apparatus.h5")
    apparatus.save(path)
    loaded = memscal.load_apparatus(path)

source = loaded.process.input_scan
print(f"made by {loaded.process.program} {loaded.process.version} from {source.file_name}")
print(f"sha256 of that file: {source.sha256[:16]}...")

# %% [markdown]
# A better test is a scan that was *not* used. `rod_scan_three_loads.h5` holds three lines, at 0.1,
# 0.3 and 1 N. Only position, baseline and drift are fitted to them.

# %%
loads = memscal.read_scan(DATA / "rod_scan_three_loads.h5")
path = memscal.indent(loaded.film, loaded.indenter, load=loads.normal_load[:, 0], friction=np.inf)

fig, ax = plt.subplots()
for row, (contact, colour) in enumerate(zip(path, (GREEN, ORANGE, BLUE), strict=True)):
    load, measured = contact.load, loads.u_zz[row]
    peak = loaded.predict(r, contact.base_stress(r))

    def line(p, peak=peak):
        return np.interp(np.abs(loads.x - p[0] * MM), r, peak) + MV * (p[1] + p[2] * loads.x / 8e-3)

    def misfit(p, line=line, measured=measured, row=row):
        return (measured - line(p)) / loads.u_zz_errors[row]

    fitted = least_squares(misfit, [0.0, 0.0, 0.0])
    score = 2 * fitted.cost / (loads.x.size - 3)
    ax.plot(loads.x / MM, measured / MV, "o", ms=3, color=colour)
    ax.plot(
        loads.x / MM, line(fitted.x) / MV, color=colour, label=f"{load:g} N: χ²/ν = {score:.2f}"
    )
ax.set(xlabel="position of the rod, x (mm)", ylabel="voltage (mV)")
ax.legend(title="predicted (lines)")
plt.show()

# %% [markdown]
# ## How this differs from the paper
#
# - The scan is synthetic, calculated by the neo-Hookean film of the reference, which the paper's
#   linear film is not. A real film has a law of its own, and a real sensor disturbs the stress that
#   it measures. Neither is included here.
# - The truth is exactly Gaussian and axisymmetric. The paper's $G$ is only nearly so.
# - Our scan has 65 points, spaced 0.25 mm; the paper's spheres were scanned at 33 points, 0.5 mm
#   apart (`rod_scan_33.h5` is spaced like that), and its rod scan's spacing is not printed.
# - The paper's 561 µm is a result of its measurement; here it was put in.
# - The reference is interpolated in a table. `rod_reference_fem.csv` holds one that is solved for
#   this rod; it changes the result by far less than
#   the uncertainty.
# - The paper adds one draw of white noise; the default here is the expectation over all draws.
