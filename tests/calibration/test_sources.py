"""References without a film: disc, slit, Gaussian, point, and fields in two dimensions.

The scans are closed forms of their own: a Gaussian sensor sees of a disc a non-central
chi-square probability, of a slit a difference of normal ones, of a Gaussian a wider Gaussian.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.bounds import FULL, RARE, deviates, root_mean_square, root_mean_square_limit
from helpers.rasters import TailedEllipse
from helpers.scans import EXACT_FILM, EXACT_ROD, simulate
from PIL import Image
from scipy.special import chndtr, ndtr
from scipy.stats import norm

import memscal
from memscal.errors import FitError, InputError, MemscalError

pytestmark = pytest.mark.usefixtures("folder")

A = 2.0
SIGMA = 0.3e-3
CENTRE = (0.05e-3, -0.03e-3)
SIZE = 0.4e-3
LONG = 0.5e-3
SHORT = 0.25e-3
TURNED = 0.4
LOBE = np.array([0.3e-3, 0.5e-3])
SHARE = 0.3
PIXEL = 50e-6
NAMES = {"disc": "disc:0.4mm", "slit": "slit:400um", "gaussian": "gaussian:0.4mm", "point": "point"}


def lobed(long, short, blur=0.0):
    """Elliptic Gaussian of unit integral, blurred; one that is not round has a lobe beside it."""
    wide = np.hypot(SHORT, blur)
    share = SHARE * (long != short)
    ellipse = (1.0, 0.0, 0.0, np.hypot(long, blur), np.hypot(short, blur), TURNED)
    return TailedEllipse((ellipse, (share, *LOBE, wide, wide, 0.0)))


def reading(kind, x, y):
    """What a Gaussian sensor reads per A, at positions from its centre."""
    r = np.hypot(x, y)
    if kind == "disc":
        return chndtr((SIZE / SIGMA) ** 2, 2, (r / SIGMA) ** 2)
    if kind == "slit":
        return ndtr((x + SIZE / 2) / SIGMA) - ndtr((x - SIZE / 2) / SIGMA)
    long, short = {"point": (0, 0), "gaussian": (SIZE, SIZE), "ellipse": (LONG, SHORT)}[kind]
    # The centroid of the ellipse and its lobe is at the scan's position.
    dx, dy = LOBE * (kind == "ellipse") * SHARE / (1 + SHARE)
    seen = lobed(long, short, SIGMA).at(x + dx, y + dy)
    return seen * (2 * np.pi * long * short if long else 1.0)


def scanned(kind, *, raster=False, noise=0.005, seed=0, n=49):
    x = np.linspace(-2.5e-3, 2.5e-3, n)
    plane = np.meshgrid(x, x) if raster else (x, np.full(n, CENTRE[1]))
    u = A * reading(kind, plane[0] - CENTRE[0], plane[1] - CENTRE[1])
    deviation = noise * u.max()
    u = 0.99 * u + 0.01 * (u + u.max()) + np.random.default_rng(seed).normal(0, deviation, u.shape)
    return memscal.Scan(
        x=x,
        y=x if raster else None,
        u_zz=u,
        load=1.3,
        film=EXACT_FILM,
        indenter=EXACT_ROD,
        u_zz_errors=np.full(u.shape, deviation) if noise else None,
    )


def field(long=LONG, short=SHORT):
    x = np.arange(-40, 41) * PIXEL
    values = lobed(long, short).at(*np.meshgrid(x, x)) * 2 * np.pi * long * short
    return memscal.StressField(x=x, y=x + 1e-3, values=values, unit="uT")


@pytest.mark.parametrize("kind", NAMES)
def test_a_and_width_are_found_by_both_routes(kind):
    exact = memscal.calibrate(scanned(kind, noise=0.0), reference=NAMES[kind]).apparatus
    assert exact.other.parameters["conversion_constant"] == pytest.approx(A, rel=2e-4)
    assert exact.conversion_constant == pytest.approx(A, rel=5e-3)
    assert exact.gaussian_sigma == pytest.approx(SIGMA, rel=2e-4)
    seeds = 60 if FULL else 3
    z = []
    for seed in range(seeds):
        a = memscal.calibrate(scanned(kind, seed=seed), reference=NAMES[kind]).apparatus
        truths = {"conversion_constant": A, "gaussian_sigma": SIGMA}
        found = deviates(a.parameters, truths)
        z.append(found + deviates(a.other.parameters, {"conversion_constant": A}))
    assert (np.abs(np.mean(z, axis=0)) < norm.isf(RARE) / np.sqrt(seeds)).all()
    assert (root_mean_square(z) < root_mean_square_limit(1.0, seeds, RARE)).all()


def test_film_rod_and_load_change_nothing():
    scan = scanned("disc", seed=1)
    other = replace(scan, film=replace(EXACT_FILM, thickness=5e-6, law=""), load=7.0)
    first, second = (memscal.calibrate(s, reference="disc:0.4mm").apparatus for s in (scan, other))
    np.testing.assert_allclose(second.parameters.values, first.parameters.values, rtol=1e-9)
    np.testing.assert_allclose(second.parameters.covariance, first.parameters.covariance, 1e-6)


def test_loads_are_strengths_relative_to_the_nominal_one():
    scan = scanned("disc", noise=0.0)
    strength = np.linspace(0.8, 1.2, scan.x.size)
    weaker = replace(
        scan, u_zz=strength * (scan.u_zz - 0.01 * scan.u_zz.max()), normal_load=1.3 * strength
    )
    a = memscal.calibrate(weaker, reference="disc:0.4mm", method="bayesian").apparatus
    assert a.conversion_constant == pytest.approx(A, rel=2e-3)


def test_a_round_field_is_its_radial_profile():
    scan = scanned("gaussian", raster=True, n=11)
    round_field = field(SIZE, SIZE)
    of_field = memscal.calibrate(scan, reference=round_field).apparatus
    ideal = memscal.calibrate(scan, reference="gaussian:0.4mm").apparatus
    for name in ("conversion_constant", "gaussian_sigma"):
        difference = abs(of_field.parameters[name] - ideal.parameters[name])
        assert difference < 0.1 * ideal.parameters.uncertainty(name)


@pytest.mark.parametrize(("raster", "method"), [(True, "white-noise"), (False, "bayesian")])
def test_a_field_that_is_not_round_is_seen_by_a_round_sensor(raster, method):
    scan = scanned("ellipse", raster=raster, seed=3, n=15 if raster else 33)
    a = memscal.calibrate(scan, reference=field(), method=method).apparatus
    assert a.passed
    for p in (a.parameters, a.other.parameters if raster else a.parameters):
        assert abs(p["conversion_constant"] - A) < 4 * p.uncertainty("conversion_constant")
        assert p.uncertainty("conversion_constant") < 0.03 * A
    assert abs(a.gaussian_sigma - SIGMA) < 4 * a.parameters.uncertainty("gaussian_sigma")
    if raster:
        assert abs(a.parameters["ellipticity"]) < 4 * a.parameters.uncertainty("ellipticity")


@pytest.mark.parametrize("form", [memscal.IdealReference("slit", SIZE), field()])
def test_the_artifact_keeps_the_reference(form):
    kind = "ellipse" if isinstance(form, memscal.StressField) else "slit"
    a = memscal.calibrate(scanned(kind, seed=2), reference=form, method="bayesian").apparatus
    a.save("a.h5")
    kept = memscal.load_apparatus("a.h5").reference
    if kind == "slit":
        assert kept.ideal == form
    else:
        np.testing.assert_allclose(kept.field.values, form.values)
        np.testing.assert_allclose(kept.field.x, form.x, atol=1e-15)
        assert kept.field.unit == "uT"


def test_fields_are_read_from_arrays_and_images():
    values = field().values / field().values.max()
    np.save("f.npy", values)
    grey = (255 * values).astype(np.uint8)
    Image.fromarray((65535 * values).astype(np.uint16)).save("f.png")
    Image.fromarray(values.astype(np.float32)).save("f.tif")
    Image.fromarray(np.stack([grey, grey, grey, 255 + 0 * grey], axis=-1)).save("c.png")
    for name, scale in (("f.npy", 1), ("f.png", 65535), ("f.tif", 1), ("c.png", 255)):
        kept = memscal.read_reference(name, pixel_size=PIXEL).field
        np.testing.assert_allclose(kept.values / scale, values, atol=1 / 255)
        assert np.ptp(kept.x) == pytest.approx(80 * PIXEL)
        assert ("luminance" in kept.notes) == (name == "c.png")


BAD = {
    "nan.npy": np.full((9, 9), np.nan),
    "pull.npy": -field().values,
    "flat.npy": np.ones((20, 20)),
    "line.npy": np.ones(9),
    "empty.npy": np.ones((0, 9)),
    "text.npy": np.full((9, 9), "a"),
    "huge.npy": np.ones((3000, 9)),
    "objects.npy": np.array([[None]]),
}


@pytest.mark.parametrize("name", [*BAD, "cut.npy", "cut.png", "no.npy"])
def test_what_is_no_field_is_refused(name):
    if name in BAD:
        np.save(name, BAD[name], allow_pickle=True)
    elif name != "no.npy":
        Path(name).write_bytes(b"\x93NUMPY" if name.endswith("npy") else b"\x89PNG\r\n")
    with pytest.raises(MemscalError):
        memscal.read_reference(name, pixel_size=PIXEL)


@pytest.mark.parametrize(
    ("reference", "said"),
    [
        ("disc:0.5", "no length"),
        ("disc:", "no length"),
        ("disc:-1mm", "above zero"),
        ("disc:1s", "length"),
        ("point:1mm", "no size"),
        ("disk:1mm", "cannot be read: it is no file, and no source"),
        *((f"disc{wrong}", r"\(disc:1mm\)") for wrong in ("=1mm", " 1mm", "1mm", "(1mm)")),
        ("gaussian", "no length"),
        ("slit:0mm", "above zero"),
        ("disc:0,5mm", "decimal point"),
        (["disc:1mm", None], "differ in number: 2 and 1"),
        (field(), "not round"),
    ],
)
def test_what_is_no_reference_is_refused(reference, said):
    with pytest.raises(InputError, match=said):
        memscal.calibrate(scanned("ellipse"), reference=reference)


@pytest.mark.parametrize(
    ("reach", "reference", "said"),
    [
        (0.4, "Point:", r"A = .* mV\*m\^2 \(relative\)\)"),
        (1.5, "gaussian:0.8mm", r"0\.8 mm as stated(.|\n)*--reference\) of 0\.\d"),
    ],
)
def test_a_refusal_is_in_terms_of_the_source(reach, reference, said):
    scan = scanned("point", noise=0.0)
    near = np.abs(scan.x) < reach * 1e-3
    short = replace(scan, x=scan.x[near], u_zz=scan.u_zz[near], film=None, load=None)
    with pytest.raises(FitError, match=said):
        memscal.calibrate(short, reference=reference, relative=True)


def test_a_slit_is_not_the_reference_of_a_raster_nor_beside_a_stress():
    with pytest.raises(InputError, match="slit"):
        memscal.calibrate(scanned("disc", raster=True, n=9), reference="slit:1mm")
    with pytest.raises(InputError, match="mixed"):
        memscal.calibrate([scanned("disc"), scanned("slit")], reference=["disc:1mm", "slit:1mm"])


def test_more_points_than_a_source_with_an_edge_allows_are_refused_at_once():
    scan = simulate(noise=0.005, points=401)
    with pytest.raises(InputError, match="401 points for such a reference, but at most 400"):
        memscal.calibrate(scan, reference="disc:0.5mm")
    assert memscal.calibrate(scan, reference="gaussian:0.5mm").apparatus.conversion_constant > 0
