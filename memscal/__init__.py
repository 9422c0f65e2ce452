"""memscal: calibration of stress sensors under an elastic film, and what they measure.

Each public name is loaded when it is first used; ``__init__.pyi`` repeats them for type checkers.
"""

import lazy_loader

from memscal import extensions

PUBLIC = {
    "apparatus": ["ApparatusFunction", "load_apparatus"],
    "axisymmetry.grids": ["EvenGrid", "FieldGrid", "Lattice"],
    "axisymmetry.kernels": ["GaussianMixture", "RadialKernel", "SmoothedDisc"],
    "calibration.calibrate": ["Calibration", "calibrate"],
    "deconvolution.fourier_ratio": [
        "Field",
        "Quotient",
        "divide",
        "lift",
        "normalise",
        "reconvolve",
    ],
    "deconvolution.widths": ["fit_gaussian"],
    "errors": ["MemscalError"],
    "formats.reference": ["read_reference", "write_reference"],
    "formats.scan": ["read_scan", "write_scan"],
    "formats.stress": ["read_stress"],
    "formats.tables.scan": ["ImportedScan", "import_table"],
    "formats.tables.stated": ["ScanConditions", "ScanUncertainties", "TableLayout"],
    "friction.compare": ["compare"],
    "friction.results": [
        "BoundedEstimate",
        "DryAgainstLubricated",
        "FrictionComparison",
        "Interval",
        "LoadComparison",
    ],
    "measurement.measure_stress": ["measure_stress"],
    "measurement.restoration": ["Restoration"],
    "measurement.restore": ["restore"],
    "mechanics.contact": ["Contact"],
    "mechanics.film_response": ["InterfaceTraction"],
    "mechanics.indent": ["indent"],
    "mechanics.interface": ["ExponentialCompliance", "GreenwoodTripp", "Interface", "NormalLaw"],
    "model.apparatus": [
        "ApparatusField",
        "ApparatusRadial",
        "ParameterSet",
        "Reconvolution",
        "TransferFunction",
    ],
    "model.assumptions": ["Assumption"],
    "model.bayes_factor": ["BayesFactor"],
    "model.checks": ["Message", "QualityCheck"],
    "model.field_mesh": ["FieldMesh"],
    "model.film": ["ElasticFilm"],
    "model.indenter": ["Cone", "Indenter", "Profile", "Rod", "RoundIndenter", "Sphere"],
    "model.instrument": ["Dynamics", "Equipment", "LoadCell", "StressSensor", "User"],
    "model.measured_stress": [
        "MeasuredPoints",
        "MeasuredProfile",
        "MeasuredScan",
        "MeasuredStress",
    ],
    "model.provenance": ["Process", "SourceFile"],
    "model.scan": ["Scan"],
    "model.stress": ["IdealReference", "StressField", "StressProfile"],
    "progress": ["Progress"],
    "version": ["__version__"],
    **extensions.PUBLIC,
}
"""Module: its public names."""

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, ["acquire"], PUBLIC)
__all__.remove("acquire")  # a module with names of its own
