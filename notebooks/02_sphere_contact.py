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
# A glass sphere is pressed on a soft film that is bonded to a rigid base. How deep does it sink,
# how wide is the contact, and what stress arrives at the base, where the sensor is? Friction
# between glass and film changes all of it, and friction remembers the way. This notebook
# calculates the paper's sphere (Scheibert, Prevost, Frelat, Rey and Debrégeas, EPL 2008) and puts
# the numbers beside the paper's.
#
# Everything here is calculated; nothing is measured, and nothing is tuned to meet the paper.

# %%
import math
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import Markdown

import memscal

MM, UM, KPA = 1e-3, 1e-6, 1e3  # memscal computes in SI units; people read these
LOADS = (0.34, 0.69, 1.37, 2.75)  # N
FRICTIONS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 1.0, 1.6, math.inf)
LOADINGS = ("incremental", "total")
BLACK, BLUE, ORANGE, GREEN, GREY = "black", "#0072B2", "#D55E00", "#009E73", "0.6"

plt.rcParams.update({"figure.figsize": (7.2, 3.4), "figure.dpi": 110, "font.size": 9})
plt.rcParams.update({"figure.constrained_layout.use": True, "legend.frameon": False})

film = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
sphere = memscal.Sphere(radius=128.8e-3)


def name(friction):
    return "∞" if math.isinf(friction) else f"{friction:g}"


# %% [markdown]
# ## 1. Three contacts
#
# Under a load of 1.37 N, a film that slides freely, one with a friction coefficient of 0.3, and
# one that sticks wherever it has touched.

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
left.set(xlabel="radius, r (mm)", ylabel="at the interface (kPa)")
right.set(xlabel="radius, r (mm)", ylabel="at the base (kPa)")
left.legend(title="friction coefficient")
fig.suptitle("Pressure (solid) and shear (dashed, positive outward)")
plt.show()

# %% [markdown]
# The film is squeezed outward under the sphere. Friction holds it back (the shear on the film is
# negative): more of the load arrives at the centre of the base, and less around the edge of the
# contact. That is what the sensor can see of friction.
#
# ## 2. How far to trust it
#
# Two methods share nothing but the contact conditions: Hankel transforms on an infinite film, and
# finite elements on a film of 25 mm radius with a free edge. Each also says what changes when it
# is refined.

# %%
rows = [
    "| backend | depth (µm) | contact radius (mm) | base (kPa) | its own estimate |",
    "|-|-|-|-|-|",
]
for backend, edge in (("hankel", None), ("fem", 25 * MM)):
    contact = memscal.indent(
        film, sphere, load=1.37, friction=0.3, backend=backend, film_radius=edge
    )
    rows.append(
        f"| {backend} | {contact.depth / UM:.3f} | {contact.contact_radius / MM:.4f} "
        f"| {contact.max_base_stress / KPA:.3f} | {contact.convergence:.0e} |"
    )
Markdown("\n".join(rows))

# %% [markdown]
# ## 3. The table
#
# Four loads, nine friction coefficients, and two meanings of a loading: *incremental*, as in a
# slow experiment, where a point of the film sticks where it first touched; and *total*, where
# every load is reached in one step, so that with $\mu = \infty$ nothing in the contact has moved
# sideways at all. In every cell the first number is incremental, the second total.


# %%
def solved(poisson_ratio):
    this = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=poisson_ratio, thickness=2e-3)
    return {
        (friction, loading): memscal.indent(
            this, sphere, load=LOADS, friction=friction, loading=loading
        )
        for friction in FRICTIONS
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


incompressible, nearly = solved(0.5), solved(0.495)
table(incompressible)

# %% [markdown]
# With Poisson's ratio 0.495 in place of 0.5:

# %%
table(nearly)

# %% [markdown]
# ## 4. Beside the paper
#
# The paper gives three numbers for each of three loads: the depth without friction, the depth with
# $\mu = \infty$, and the "contact diameter" without friction.

# %%
paper = {0.34: (18, 16, 2.00), 1.37: (33, 28, 2.90), 2.75: (45, 37, 3.45)}
rows = [
    "| P (N) | | paper | ν = 0.5 | ν = 0.495 |",
    "|-|-|-|-|-|",
]
for load, (smooth, sticking, width) in paper.items():
    i = LOADS.index(load)

    def both(friction, loading, attribute, unit, form, i=i):
        values = (
            getattr(contacts[friction, loading][i], attribute) / unit
            for contacts in (incompressible, nearly)
        )
        return " | ".join(format(value, form) for value in values)

    found = (
        ("depth, μ = 0 (µm)", smooth, both(0.0, "total", "depth", UM, ".1f")),
        (
            "depth, μ = ∞, incremental (µm)",
            sticking,
            both(math.inf, "incremental", "depth", UM, ".1f"),
        ),
        ("depth, μ = ∞, total (µm)", sticking, both(math.inf, "total", "depth", UM, ".1f")),
        (
            "contact radius, μ = 0 (mm)",
            f"“{width:.2f}”",
            both(0.0, "total", "contact_radius", MM, ".2f"),
        ),
    )
    rows += [f"| {load} | {what} | {value} | {ours} |" for what, value, ours in found]
Markdown("\n".join(rows))

# %% [markdown]
# - **Without friction** the paper's depths are met to its rounding with $\nu = 0.495$, and lie half
#   a micrometre to a micrometre above those of an incompressible film.
# - **The "contact diameters" are radii.** Taken as diameters they are half of what any film of this
#   thickness and modulus gives; taken as radii they agree to 0.02 mm.
# - **With $\mu = \infty$** the paper's film is stiffer than ours. The meaning of the loading
#   explains a part: from incremental to total the depth falls by 0.3, 1.1 and 1.9 µm, toward the
#   paper's.
#   What is left is 0.6, 1.4 and 1.5 µm of an incompressible film (4 to 5 %), and more with
#   $\nu = 0.495$. Its mesh of 50 µm and its finite load steps may account for it; from the text it
#   cannot be said.
#
# ## 5. What the sensor would report
#
# The sensor blurs the stress with its apparatus function $G$. Here $G$ comes from calibrating the
# shipped rod scan (synthetic, with the paper's width of 561 µm). The paper's Fig. 3 compares
# measured profiles with these curves.

# %%
scan = memscal.read_scan(Path("../calibration_data") / "rod_scan_65.h5")
apparatus = memscal.calibrate(scan).apparatus


radii = incompressible[0.0, "total"][-1].profile().r  # fine and far enough for all


def blurred(contact):
    return apparatus.convolve(radii, contact.base_stress(radii))


fig, axes = plt.subplots(1, 2)
for load, colour in ((0.34, GREEN), (1.37, BLUE), (2.75, ORANGE)):
    for friction, style in ((0.0, "-"), (math.inf, "--")):
        s = blurred(incompressible[friction, "incremental"][LOADS.index(load)])
        label = f"{load} N, μ = {name(friction)}"
        for ax in axes:
            ax.plot(radii / MM, s / KPA, style, color=colour, label=label)
axes[0].set(xlim=(0, 8), ylim=(0, None), xlabel="r (mm)", ylabel="$G \\otimes \\sigma_{zz}$ (kPa)")
axes[1].set(xlim=(0, 8), ylim=(0.05, 200), yscale="log", xlabel="r (mm)")
axes[0].legend()
plt.show()

# %% [markdown]
# The paper's Fig. 4 sets the largest load beside four friction coefficients:

# %%
fig, ax = plt.subplots(figsize=(4.6, 3.4))
for friction, colour in ((0.0, BLUE), (0.2, GREY), (0.3, GREEN), (math.inf, ORANGE)):
    s = blurred(incompressible[friction, "incremental"][-1])
    ax.plot(radii / MM, s / KPA, color=colour, label=f"μ = {name(friction)}")
ax.set(xlim=(0, 6), ylim=(0, None), xlabel="r (mm)", ylabel="$G \\otimes \\sigma_{zz}$ (kPa)")
ax.legend()
plt.show()

# %% [markdown]
# And its Fig. 5 reads a friction coefficient off the largest stress, relative to the frictionless
# one, at each load. Solid: incremental; dashed: total.

# %%
fig, ax = plt.subplots(figsize=(4.6, 3.4))
colours = plt.get_cmap("viridis")(np.linspace(0, 0.9, len(FRICTIONS)))
largest = {
    key: np.array([np.max(blurred(contact)) for contact in contacts])
    for key, contacts in incompressible.items()
}
for friction, colour in zip(FRICTIONS, colours, strict=True):
    for loading, style in (("incremental", "-"), ("total", "--")):
        ratio = largest[friction, loading] / largest[0.0, loading]
        label = f"μ = {name(friction)}" if loading == "incremental" else None
        ax.plot(LOADS, ratio, style, color=colour, label=label)
ax.set(xlabel="load, P (N)", ylabel="$p^\\mu_{max} / p^0_{max}$")
ax.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
plt.show()

# %% [markdown]
# **Friction saturates.** In this geometry a slow loading never drives the film far sideways before
# it is caught. Beyond a modest coefficient the whole contact sticks, and a larger one changes
# nothing. From which coefficient on is the profile within 1 % of the sticking one?

# %%
rows = ["| P (N) | incremental | total |", "|-|-|-|"]
fine = (0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2)
within = {}
for loading in LOADINGS:
    sticking = [blurred(c) for c in incompressible[math.inf, loading]]
    found = dict.fromkeys(LOADS)
    for friction in fine:
        contacts = memscal.indent(film, sphere, load=LOADS, friction=friction, loading=loading)
        for load, contact, limit in zip(LOADS, contacts, sticking, strict=True):
            difference = np.max(np.abs(blurred(contact) - limit))
            if found[load] is None and difference < 0.01 * limit.max():
                found[load] = friction
        if None not in found.values():
            break
    within[loading] = found
for load in LOADS:
    rows.append(f"| {load} | μ ≥ {within['incremental'][load]} | μ ≥ {within['total'][load]} |")
Markdown("\n".join(rows))

# %% [markdown]
# So a measured profile can tell an effective coefficient of 0.1 from 0.2, but not 0.4 from 1.6: in
# a slow loading nothing more is to be read beyond the numbers above. A coefficient near one is a
# lower bound, not a value.
#
# ## 6. An interface that yields
#
# The paper ascribes its low effective friction to the interface itself: rough, and elastic up to a
# displacement of about its roughness (1.82 µm) before it slips. With a slip length the contact of a
# film with $\mu = 1.6$ looks like one with less friction, most of all under light loads.

# %%
fig, ax = plt.subplots(figsize=(4.6, 3.4))
for length, colour in ((0.0, BLACK), (1.82, BLUE), (5.0, GREEN), (20.0, ORANGE)):
    interface = memscal.Interface(slip_length=length * UM)
    contacts = memscal.indent(film, sphere, load=LOADS, friction=1.6, interface=interface)
    peaks = np.array([np.max(blurred(contact)) for contact in contacts])
    ax.plot(LOADS, peaks / largest[0.0, "total"], "o-", color=colour, label=f"{length:g} µm")
ax.set(xlabel="load, P (N)", ylabel="largest stress, relative to no friction")
ax.legend(title="slip length, μ = 1.6")
plt.show()
