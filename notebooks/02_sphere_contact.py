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
# # A sphere on a film, with friction
#
# A glass sphere is pressed on a soft film that is bonded to a rigid base. Depth, contact radius and
# the stress at the base, where the sensor is, depend on the friction between glass and film and on
# the path of loading. This notebook calculates them for the paper's sphere (Scheibert, Prevost,
# Frelat, Rey and Debrégeas, EPL 2008) and compares them with the paper. Nothing is measured, and
# nothing is adjusted to agree with the paper.

# %%
import math
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import Markdown

import memscal

MM, UM, KPA = 1e-3, 1e-6, 1e3  # memscal computes in SI units
LOADS = (0.34, 0.69, 1.37, 2.75)  # N
FRICTIONS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 1.6, math.inf)
LOADINGS = ("incremental", "total")
BLACK, BLUE, ORANGE, GREEN, GREY = "black", "#0072B2", "#D55E00", "#009E73", "0.6"

# %matplotlib inline
plt.rcParams.update({"figure.figsize": (7.2, 3.4), "figure.dpi": 80, "font.size": 9})
plt.rcParams.update({"figure.constrained_layout.use": True, "legend.frameon": False})

film = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
sphere = memscal.Sphere(radius=128.8e-3)


def name(friction):
    return "∞" if math.isinf(friction) else f"{friction:g}"


# %% [markdown]
# ## 1. Three contacts
#
# A load of 1.37 N, without friction, with a friction coefficient of 0.3, and with full stick: first
# the contact with 0.3 as memscal draws it, then all three.

# %%
middling = memscal.indent(film, sphere, load=1.37, friction=0.3)
middling.plot()

# %%
fig, (left, right) = plt.subplots(1, 2)
for friction, colour in ((0.0, BLUE), (0.3, GREEN), (math.inf, ORANGE)):
    contact = memscal.indent(film, sphere, load=1.37, friction=friction)
    r = np.linspace(0, 1.3 * contact.contact_radius, 400)
    left.plot(r / MM, contact.interface_pressure(r) / KPA, color=colour, label=name(friction))
    left.plot(r / MM, contact.interface_shear(r) / KPA, color=colour, ls="--")
    r = np.linspace(0, 8e-3, 400)
    right.plot(r / MM, contact.base_stress(r) / KPA, color=colour)
    right.plot(r / MM, contact.base_shear(r) / KPA, color=colour, ls="--")
left.set(xlabel="r (mm)", ylabel="stress at the interface (kPa)")
right.set(xlabel="r (mm)", ylabel="stress at the base (kPa)")
left.legend(title="friction coefficient")
fig.suptitle("Pressure (solid) and shear (dashed, positive outward)")
plt.show()

# %% [markdown]
# The film is squeezed outward under the sphere. Friction opposes this (the shear on the film is
# negative): the stress at the base is larger at the centre, and smaller around the edge of the
# contact. The sensor measures this effect.
#
# ## 2. Accuracy
#
# Two methods share only the contact conditions: Hankel transforms on an infinite film, and finite
# elements on a film of 25 mm radius with a free edge. The last column is the change when the
# discretisation is refined.

# %%
rows = [
    "| backend | depth (µm) | contact radius (mm) | base (kPa) | change on refinement |",
    "|-|-|-|-|-|",
]
elements = memscal.indent(film, sphere, load=1.37, friction=0.3, backend="fem", film_radius=25 * MM)
for backend, contact in (("hankel", middling), ("fem", elements)):
    rows.append(
        f"| {backend} | {contact.depth / UM:.3f} | {contact.contact_radius / MM:.4f} "
        f"| {contact.max_base_stress / KPA:.3f} | {contact.convergence:.0e} |"
    )
Markdown("\n".join(rows))

# %% [markdown]
# ## 3. The table
#
# Four loads, eight friction coefficients, and two definitions of the loading: *incremental*, as in
# a slow experiment, where a point of the film sticks where it first touched; and *total*, where
# every load is reached in one step, so that with $\mu = \infty$ no point of the contact has moved
# sideways. In every cell the first number is incremental, the second total.


# %%
def contacts_on(film, frictions):
    return {
        (friction, loading): memscal.indent(
            film, sphere, load=LOADS, friction=friction, loading=loading
        )
        for friction in frictions
        for loading in LOADINGS
    }


def table(contacts):
    head = "P (N)", "μ", "depth (µm)", "contact radius (mm)", "interface (kPa)", "base (kPa)"
    rows = ["| " + " | ".join(head) + " |", "|-" * len(head) + "|"]
    for i, load in enumerate(LOADS):
        for friction in FRICTIONS:
            pair = [contacts[friction, loading][i] for loading in LOADINGS]
            cells = [
                f"{load:g}",
                name(friction),
                " / ".join(f"{c.depth / UM:.2f}" for c in pair),
                " / ".join(f"{c.contact_radius / MM:.3f}" for c in pair),
                " / ".join(f"{c.max_interface_stress / KPA:.2f}" for c in pair),
                " / ".join(f"{c.max_base_stress / KPA:.2f}" for c in pair),
            ]
            rows.append("| " + " | ".join(cells) + " |")
    return Markdown("\n".join(rows))


incompressible = contacts_on(film, FRICTIONS)
table(incompressible)

# %% [markdown]
# ## 4. Comparison with the paper
#
# The paper gives three numbers for each of three loads: the depth without friction, the depth with
# $\mu = \infty$, and the "contact diameter" without friction. A film of Poisson's ratio 0.495 is
# calculated too; `docs/sphere.md` has its whole table.

# %%
compressible = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.495, thickness=2e-3)
nearly = contacts_on(compressible, (0.0, math.inf))
paper = {0.34: (18, 16, 2.00), 1.37: (33, 28, 2.90), 2.75: (45, 37, 3.45)}
rows = [
    "| P (N) | | paper | ν = 0.5 | ν = 0.495 |",
    "|-|-|-|-|-|",
]
for load, (smooth, sticking, width) in paper.items():
    i = LOADS.index(load)

    for quantity, printed, (friction, loading), attribute, unit, form in (
        ("depth, μ = 0 (µm)", smooth, (0.0, "total"), "depth", UM, ".1f"),
        ("depth, μ = ∞, incremental (µm)", sticking, (math.inf, "incremental"), "depth", UM, ".1f"),
        ("depth, μ = ∞, total (µm)", sticking, (math.inf, "total"), "depth", UM, ".1f"),
        (
            "contact radius, μ = 0 (mm)",
            f"“{width:.2f}”",
            (0.0, "total"),
            "contact_radius",
            MM,
            ".2f",
        ),
    ):
        ours = " | ".join(
            format(getattr(contacts[friction, loading][i], attribute) / unit, form)
            for contacts in (incompressible, nearly)
        )
        rows.append(f"| {load} | {quantity} | {printed} | {ours} |")
Markdown("\n".join(rows))

# %% [markdown]
# - **Without friction** the calculated depths agree with the paper's to its rounding for
#   $\nu = 0.495$; for an incompressible film they are half a micrometre to a micrometre smaller.
# - **The "contact diameters" are radii.** As diameters they are half of those of any film of this
#   thickness and modulus; as radii they agree to 0.02 mm.
# - **With $\mu = \infty$** the paper's film is stiffer than ours. The definition of the loading
#   explains a part: from incremental to total the depth falls by 0.3, 1.1 and 1.9 µm, toward the
#   paper's. A difference of 0.6, 1.4 and 1.5 µm (4 to 5 %) remains for an incompressible film, and
#   more for $\nu = 0.495$. The paper's mesh of 50 µm and its finite load steps may account for it;
#   its text does not say.
#
# ## 5. The sensor's signal
#
# The sensor blurs the stress with its apparatus function $G$. Here $G$ comes from calibrating the
# shipped rod scan (synthetic, with the paper's width of 561 µm). The paper's Fig. 3 compares
# measured profiles with such curves.

# %%
scan = memscal.read_scan(Path("../calibration_data") / "rod_scan_65.h5")
apparatus = memscal.calibrate(scan).apparatus

radii = np.linspace(0, 24 * MM, 241)


def blurred(contact):
    return apparatus.convolve(radii, contact.base_stress(radii))


profiles = {key: [blurred(c) for c in contacts] for key, contacts in incompressible.items()}

fig, axes = plt.subplots(1, 2)
for load, colour in ((0.34, GREEN), (1.37, BLUE), (2.75, ORANGE)):
    for friction, style in ((0.0, "-"), (math.inf, "--")):
        s = profiles[friction, "incremental"][LOADS.index(load)]
        label = f"{load} N, μ = {name(friction)}"
        for ax in axes:
            ax.plot(radii / MM, s / KPA, style, color=colour, label=label)
axes[0].set(xlim=(0, 8), ylim=(0, None), xlabel="r (mm)", ylabel="blurred stress S (kPa)")
axes[1].set(xlim=(0, 8), ylim=(0.05, 200), yscale="log", xlabel="r (mm)")
axes[0].legend()
plt.show()

# %% [markdown]
# The paper's Fig. 4 compares four friction coefficients at the largest load:

# %%
fig, ax = plt.subplots(figsize=(4.6, 3.4))
for friction, colour in ((0.0, BLUE), (0.2, GREY), (0.3, GREEN), (math.inf, ORANGE)):
    s = profiles[friction, "incremental"][-1]
    ax.plot(radii / MM, s / KPA, color=colour, label=f"μ = {name(friction)}")
ax.set(xlim=(0, 6), ylim=(0, None), xlabel="r (mm)", ylabel="blurred stress S (kPa)")
ax.legend()
plt.show()

# %% [markdown]
# Its Fig. 5 gives a friction coefficient at each load from the largest stress, relative to the
# frictionless one. Solid: incremental; dashed: total.

# %%
fig, ax = plt.subplots(figsize=(4.6, 3.4))
colours = plt.get_cmap("viridis")(np.linspace(0, 0.9, len(FRICTIONS)))
largest = {key: np.max(blurred_stress, axis=1) for key, blurred_stress in profiles.items()}
for friction, colour in zip(FRICTIONS, colours, strict=True):
    for loading, style in (("incremental", "-"), ("total", "--")):
        ratio = largest[friction, loading] / largest[0.0, loading]
        label = f"μ = {name(friction)}" if loading == "incremental" else None
        ax.plot(LOADS, ratio, style, color=colour, label=label)
ax.set(xlabel="load, P (N)", ylabel="$p^\\mu_{max} / p^0_{max}$")
ax.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
plt.show()

# %% [markdown]
# **The effect of friction saturates.** In a slow loading the film moves little before it sticks.
# Beyond some coefficient the whole contact sticks, and a larger one changes nothing. The largest
# distance of each profile from that of full stick:

# %%
fig, axes = plt.subplots(1, 2, sharey=True)
finite = FRICTIONS[1:-1]
for ax, loading in zip(axes, LOADINGS, strict=True):
    for i, load in enumerate(LOADS):
        limit = profiles[math.inf, loading][i]
        distances = [
            100 * np.max(np.abs(profiles[friction, loading][i] - limit)) / limit.max()
            for friction in finite
        ]
        ax.semilogy(finite, np.maximum(distances, 1e-3), "o-", ms=3, label=f"{load} N")
    ax.axhline(1, color=GREY, ls="--")
    ax.set(title=loading, xlabel="friction coefficient", ylim=(5e-3, 20))
axes[0].set_ylabel("distance (% of the maximum)")
axes[1].legend()
plt.show()

# %% [markdown]
# A measured profile distinguishes an effective coefficient of 0.1 from 0.2. In a slow loading it
# does not distinguish 0.4 from 1.6: a coefficient above about 0.3 is a lower bound.
#
# ## 6. An interface that yields
#
# The paper ascribes its low effective friction to the interface: rough, and elastic up to a
# displacement of about its roughness (1.82 µm) before it slips. With a slip length, the contact of
# a film with $\mu = 1.6$ resembles one with less friction, most of all under light loads.

# %%
fig, ax = plt.subplots(figsize=(4.6, 3.4))
for length, colour in ((0.0, BLACK), (1.82, BLUE), (5.0, GREEN), (20.0, ORANGE)):
    contacts = incompressible[1.6, "incremental"]
    if length:
        interface = memscal.Interface(slip_length=length * UM)
        contacts = memscal.indent(film, sphere, load=LOADS, friction=1.6, interface=interface)
    peaks = np.array([np.max(blurred(contact)) for contact in contacts])
    ax.plot(LOADS, peaks / largest[0.0, "total"], "o-", color=colour, label=f"{length:g} µm")
ax.set(xlabel="load, P (N)", ylabel="largest stress, relative to no friction")
ax.legend(title="slip length, μ = 1.6")
plt.show()
