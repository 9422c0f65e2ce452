"""Comparisons that never ran: contacts of closed form, so that every number is known."""

import math
from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np
from helpers.paper import FILM, LOADS, SPHERE

import memscal
from memscal.extensions.interface_laws.results import ImpliedFriction, InterfaceLaw, LawComparison

FRICTION = np.array([0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, math.inf])
#: Maxima without friction, and what full stick adds to them, at those loads (the paper's sphere).
_MAXIMA = (27.73e3, 44.14e3, 67.93e3, 104.13e3)
_GAINS = {"incremental": (0.114, 0.159, 0.210, 0.266), "total": (0.158, 0.205, 0.254, 0.306)}
_GAINS[""] = _GAINS["incremental"]  # of profiles calculated elsewhere
_LIMIT = 3.84
_ONE_SIGMA = 1.0
_COMMON = 0.008  # relative uncertainty of all stresses together


def stress(r, load: float, friction: float, loading: str):
    """Return a Gaussian of the load's force, which narrows as friction grows; in Pa."""
    p0 = np.interp(load, LOADS, _MAXIMA)
    top = p0 * (1 + np.interp(load, LOADS, _GAINS[loading]) * (1.0 - math.exp(-friction / 0.12)))
    return top * np.exp(-np.pi * top * np.asarray(r) ** 2 / load)


def reading(
    values: np.ndarray, chi_square: np.ndarray, *, degrees=29, **fields
) -> memscal.BoundedEstimate:
    """Return what a profile likelihood says, by the rule of the package."""
    least = float(chi_square.min())
    inside = values[chi_square - least <= _LIMIT]
    close = values[chi_square - least <= _ONE_SIGMA]
    high = None if math.isinf(inside[-1]) else float(inside[-1])
    value = None if high is None else float(values[np.argmin(chi_square)])
    spread = None if value is None else float(np.ptp(close)) / 2 or 0.01
    return memscal.BoundedEstimate(
        value=value,
        standard_uncertainty=spread,
        interval=memscal.Interval(float(inside[0]), high),
        reason="" if value is not None else "A large coefficient is not excluded: a lower bound.",
        budget={} if spread is None else {"noise": 0.8 * spread, "thickness": 0.6 * spread},
        values=values,
        deviance=chi_square,
        degrees=degrees,
        least=least,
        p_value=0.31,
        **fields,
    )


def measured_profile(load: float, lubrication: str, friction: float, rng):
    """Return a stand-in of a measured profile: what tables and figures read of one."""
    x = np.linspace(-8e-3, 8e-3, 33) - 0.14e-3
    x = x[np.argsort(np.abs(x))]
    r = np.abs(x)
    clean = stress(r, load, friction, "incremental")
    errors = np.hypot(0.004 * clean.max(), 0.01 * clean) * np.ones(r.size)
    errors = np.maximum(errors * np.exp(-r / 2e-3), 2e-4 * clean.max())
    top = float(clean.max())
    return SimpleNamespace(
        scan=_scan(lubrication),
        lubrication=lubrication,
        state=lubrication,
        x=x,
        r=r,
        s_zz=clean + rng.normal(0.0, errors),
        s_zz_errors=errors,
        load=load,
        force=load * 1.003,
        force_uncertainty=0.01 * load,
        maximum=top,
        maximum_uncertainty=0.01 * top,
    )


def _scan(lubrication):
    source = memscal.SourceFile(f"{lubrication or 'sphere'}.h5", "ef" * 32)
    return SimpleNamespace(
        source=source,
        lubrication=lubrication,
        indenter=SPHERE,
        film=FILM,
        sensor=memscal.StressSensor(name="array 3"),
    )


def load_comparison(profile, loading: str) -> memscal.LoadComparison:
    """Compare one profile with the closed form."""
    fine = np.concatenate([np.linspace(0.0, 0.6, 301), np.geomspace(0.62, 30, 40), [math.inf]])
    load = profile.load
    r = profile.r
    common = _COMMON * profile.s_zz.max()

    def misfit(mu):
        z = (profile.s_zz - stress(r, load, mu, loading)) / np.hypot(profile.s_zz_errors, common)
        return float(z @ z)

    curve = np.array([misfit(mu) for mu in fine])
    chi_square = np.array([misfit(mu) for mu in FRICTION])
    maxima = np.array([float(stress(0.0, load, mu, loading)) for mu in fine])
    datum = ((profile.maximum - maxima) / math.hypot(profile.maximum_uncertainty, common)) ** 2
    calculated = np.array([stress(r, load, mu, loading) for mu in FRICTION])
    p0 = float(stress(0.0, load, 0.0, loading))
    between = np.clip(profile.s_zz, *np.sort(calculated[[0, -1]], axis=0))
    return memscal.LoadComparison(
        profile=profile,
        loading=loading,
        s_max=profile.maximum,
        s_max_uncertainty=profile.maximum_uncertainty,
        p0_max=p0,
        p0_max_uncertainty=_COMMON * p0,
        ratio=profile.maximum / p0,
        ratio_uncertainty=0.012,
        calculated=calculated,
        calculated_errors=_COMMON * calculated,
        p_max=np.array([float(stress(0.0, load, mu, loading)) for mu in FRICTION]),
        chi_square=chi_square,
        deviance=chi_square - curve.min(),
        p_values=np.full(FRICTION.size, 0.2),
        degrees=29,
        bracketed=float((np.abs(profile.s_zz - between) <= 1.96 * profile.s_zz_errors).mean()),
        by_maximum=reading(fine, datum, degrees=0),
        by_profile=reading(fine, curve),
    )


def comparison(
    *,
    friction=0.15,
    lubrications=("dry", "lubricated"),
    loadings=("incremental", "total"),
    failed=False,
    loads: Sequence[float] = LOADS,
    **fields,
) -> memscal.FrictionComparison:
    """Return a comparison of every load, dry and lubricated."""
    rng = np.random.default_rng(1)
    profiles = [
        measured_profile(load, lubrication, friction if lubrication != "lubricated" else 0.0, rng)
        for lubrication in lubrications
        for load in loads
    ]
    by_loading = {
        loading: tuple(load_comparison(profile, loading) for profile in profiles)
        for loading in loadings
    }
    joint = {
        lubrication: {loading: _joint(by_loading[loading], lubrication) for loading in loadings}
        for lubrication in lubrications
    }
    checks = tuple(
        memscal.QualityCheck(name, 2.4 if bad else 0.7, 1.0, not bad, "Not the load.", 0.4)
        for name, bad in (("restored_force", False), ("bracketing", failed))
    )
    measured = SimpleNamespace(
        profiles=tuple(profiles),
        scans=tuple(_scan(lubrication) for lubrication in lubrications),
        checks=(),
        messages=(),
        overridden=(),
        noise_stated=True,
        artifact=None,
        process=memscal.Process(program="memscal", version="0", date=""),
    )
    given = {
        "measured": measured,
        "friction": FRICTION,
        "loads": by_loading,
        "joint": joint,
        "dry_against_lubricated": _differences(profiles),
        "macroscopic": (1.6, 0.2),
        "checks": checks,
        "messages": (),
    }
    return memscal.FrictionComparison(**(given | fields))


def interface_comparison(slip_length=1.8e-6) -> memscal.InterfaceComparison:
    """Return laws of a dry and of a lubricated interface, a slip length preferred."""
    pressures = np.array([27e3, 33e3, 50e3, 80e3])
    friction = np.outer([0.11, 0.14, 0.17, 0.2], [1.3, 1.0, 0.8])
    stiffnesses = np.outer(pressures, 1.6 / slip_length / np.array([0.8, 1.0, 1.3]))
    implied = ImpliedFriction(np.array(LOADS), friction, pressures, stiffnesses)
    names = ("effective Amontons", "effective Amontons, one for each load", "elasto-plastic")
    tangential = _laws("dry", names, (0.0, 2.1, 7.4), slip_length, implied)
    names = ("rigid, frictionless", "normal compliance")
    normal = _laws("lubricated", names, (0.0, -1.2), 0.3e-6, None)
    messages = (memscal.Message("prior", "The slip length is that of the prior."),)
    return memscal.InterfaceComparison((1.6, 0.2), tangential, normal, messages)


def _laws(lubrication, names, evidence, length, implied):
    lengths = np.concatenate([[0.0], np.geomspace(0.05e-6, 50e-6, 120), [math.inf]])
    bounded = np.where(np.isinf(lengths), 20.0, np.log1p(lengths / 1e-6) / 0.1)
    chi_square = (bounded - math.log1p(length / 1e-6) / 0.1) ** 2 + 120.0
    inside = lengths[chi_square - 120.0 <= _LIMIT]
    laws = tuple(
        InterfaceLaw(name, (0.21,), value, value + 2.0, 0.0, 130.0 - value, 120)
        for name, value in zip(names, evidence, strict=True)
    )
    better, worse = sorted((-1, 0), key=lambda i: -evidence[i])
    factor = memscal.BayesFactor(names[better], names[worse], abs(evidence[-1] - evidence[0]))
    interval = memscal.Interval(inside[0], inside[-1])
    estimate = memscal.BoundedEstimate(
        length, 0.1 * length, interval, "", lengths, chi_square, least=120.0, unit="m"
    )
    loads = np.array(LOADS)
    return LawComparison(lubrication, loads, laws, (factor,), estimate, implied)


def _joint(of_each, lubrication):
    chosen = [one.by_profile for one in of_each if one.lubrication == lubrication]
    return reading(chosen[0].values, np.sum([one.deviance for one in chosen], axis=0))


def _differences(profiles):
    found = []
    dry_profiles = [p for p in profiles if p.lubrication == "dry"]
    lubricated = {p.load: p for p in profiles if p.lubrication == "lubricated"}
    for dry, wet in ((p, lubricated[p.load]) for p in dry_profiles if p.load in lubricated):
        difference = dry.s_zz - wet.s_zz
        errors = np.hypot(dry.s_zz_errors, wet.s_zz_errors)
        top = dry.maximum - wet.maximum
        spread = math.hypot(dry.maximum_uncertainty, wet.maximum_uncertainty)
        misfit = (float(np.sum((difference / errors) ** 2)), dry.r.size, 0.02)
        maxima = (top, spread, top / wet.maximum, spread / wet.maximum)
        found.append(
            memscal.DryAgainstLubricated(dry.load, dry.r, difference, errors, *misfit, *maxima)
        )
    return tuple(found)
