"""memscal: calibration of stress sensors under an elastic film, and what they measure.

The public names are loaded when they are first used, so that importing memscal costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from memscal.version import __version__

if TYPE_CHECKING:
    from memscal.apparatus import ApparatusFunction, load_apparatus
    from memscal.axisymmetry.kernels import GaussianMixture, SmoothedDisc
    from memscal.calibration.calibrate import Calibration, calibrate
    from memscal.calibration.many import FleetCalibration, calibrate_many
    from memscal.calibration.monte_carlo import MonteCarlo, monte_carlo
    from memscal.deconvolution.fourier_ratio import (
        Field,
        Quotient,
        divide,
        fit_gaussian,
        lift,
        normalise,
        reconvolve,
    )
    from memscal.errors import MemscalError
    from memscal.formats.reference import read_reference, write_reference
    from memscal.formats.scan import read_scan, write_scan
    from memscal.formats.stress import read_stress
    from memscal.friction.compare import ShearComparison, compare, compare_shear
    from memscal.friction.results import FrictionComparison
    from memscal.measurement.measure_stress import measure_stress
    from memscal.measurement.restoration import Restoration
    from memscal.measurement.restore import restore
    from memscal.mechanics.contact import Contact
    from memscal.mechanics.indent import indent
    from memscal.mechanics.interface import ExponentialCompliance, GreenwoodTripp, Interface
    from memscal.model.checks import Message
    from memscal.model.film import ElasticFilm
    from memscal.model.indenter import Cone, Profile, Rod, Sphere
    from memscal.model.measured_stress import MeasuredProfile, MeasuredStress
    from memscal.model.scan import Scan, StressSensor
    from memscal.model.stress import StressProfile
    from memscal.planning.design import design
    from memscal.planning.expected import Design
    from memscal.simulation.experiment import Experiment, simulate_experiment
    from memscal.simulation.rod_scan import simulate

_HOMES = {
    "reconvolve": "memscal.deconvolution.fourier_ratio",
    "normalise": "memscal.deconvolution.fourier_ratio",
    "lift": "memscal.deconvolution.fourier_ratio",
    "fit_gaussian": "memscal.deconvolution.fourier_ratio",
    "divide": "memscal.deconvolution.fourier_ratio",
    "Quotient": "memscal.deconvolution.fourier_ratio",
    "Field": "memscal.deconvolution.fourier_ratio",
    "ApparatusFunction": "memscal.apparatus",
    "Calibration": "memscal.calibration.calibrate",
    "Cone": "memscal.model.indenter",
    "Contact": "memscal.mechanics.contact",
    "Design": "memscal.planning.expected",
    "ElasticFilm": "memscal.model.film",
    "Experiment": "memscal.simulation.experiment",
    "ExponentialCompliance": "memscal.mechanics.interface",
    "FleetCalibration": "memscal.calibration.many",
    "FrictionComparison": "memscal.friction.results",
    "GaussianMixture": "memscal.axisymmetry.kernels",
    "GreenwoodTripp": "memscal.mechanics.interface",
    "Interface": "memscal.mechanics.interface",
    "MeasuredProfile": "memscal.model.measured_stress",
    "MeasuredStress": "memscal.model.measured_stress",
    "MemscalError": "memscal.errors",
    "Message": "memscal.model.checks",
    "MonteCarlo": "memscal.calibration.monte_carlo",
    "Profile": "memscal.model.indenter",
    "Restoration": "memscal.measurement.restoration",
    "Rod": "memscal.model.indenter",
    "Scan": "memscal.model.scan",
    "ShearComparison": "memscal.friction.compare",
    "SmoothedDisc": "memscal.axisymmetry.kernels",
    "Sphere": "memscal.model.indenter",
    "StressProfile": "memscal.model.stress",
    "StressSensor": "memscal.model.scan",
    "calibrate": "memscal.calibration.calibrate",
    "calibrate_many": "memscal.calibration.many",
    "compare": "memscal.friction.compare",
    "compare_shear": "memscal.friction.compare",
    "design": "memscal.planning.design",
    "indent": "memscal.mechanics.indent",
    "load_apparatus": "memscal.apparatus",
    "measure_stress": "memscal.measurement.measure_stress",
    "monte_carlo": "memscal.calibration.monte_carlo",
    "read_reference": "memscal.formats.reference",
    "read_scan": "memscal.formats.scan",
    "read_stress": "memscal.formats.stress",
    "restore": "memscal.measurement.restore",
    "simulate": "memscal.simulation.rod_scan",
    "simulate_experiment": "memscal.simulation.experiment",
    "write_reference": "memscal.formats.reference",
    "write_scan": "memscal.formats.scan",
}

__all__ = [
    "ApparatusFunction",
    "Calibration",
    "Cone",
    "Contact",
    "Design",
    "ElasticFilm",
    "Experiment",
    "ExponentialCompliance",
    "Field",
    "FleetCalibration",
    "FrictionComparison",
    "GaussianMixture",
    "GreenwoodTripp",
    "Interface",
    "MeasuredProfile",
    "MeasuredStress",
    "MemscalError",
    "Message",
    "MonteCarlo",
    "Profile",
    "Quotient",
    "Restoration",
    "Rod",
    "Scan",
    "ShearComparison",
    "SmoothedDisc",
    "Sphere",
    "StressProfile",
    "StressSensor",
    "__version__",
    "calibrate",
    "calibrate_many",
    "compare",
    "compare_shear",
    "design",
    "divide",
    "fit_gaussian",
    "indent",
    "lift",
    "load_apparatus",
    "measure_stress",
    "monte_carlo",
    "normalise",
    "read_reference",
    "read_scan",
    "read_stress",
    "reconvolve",
    "restore",
    "simulate",
    "simulate_experiment",
    "write_reference",
    "write_scan",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'memscal' has no attribute '{name}'")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
