"""The table of what is loaded when it is asked for: commands, views and hooks.

Names stand as text, so that reading the table loads no extension.  The core calls what stands above
it by a hook, and never imports it; an extension is one folder here, and its lines in this table.
"""

from importlib import import_module
from typing import Any

COMMANDS = {
    "calibrate": ("cli.calibrate", "Find a sensor's apparatus function from a rod scan."),
    "batch": (
        "extensions.fleet.batch_command",
        "Calibrate a folder of scans, or those of a manifest.",
    ),
    "summary": (
        "extensions.fleet.summary_command",
        "Summarise the results of a batch: distributions, outliers, map.",
    ),
    "reference": ("cli.reference", "Solve the stress at the base of a film under an indenter."),
    "apply": ("cli.apply", "Turn contact scans into measured stress, load by load."),
    "restore": ("cli.restore", "Restore the stress at the base of a film from a scan."),
    "compare": ("cli.compare", "Compare measured with calculated stress: effective friction."),
    "certificate": (
        "extensions.certificate.command",
        "Write a certificate of calibration (HTML, PDF, XML).",
    ),
    "design": (
        "extensions.planning.command",
        "Predict the uncertainties of a scan before it is made.",
    ),
    "response": (
        "extensions.response.command",
        "Find which waves of pressure a sensor resolves, and how small ones.",
    ),
    "creep": (
        "extensions.motion.creep_command",
        "Find a sensor's creep from its readings while an indenter rests on it.",
    ),
    "history": (
        "extensions.history.command",
        "Say whether a sensor has changed since its last calibrations.",
    ),
    "locate": (
        "extensions.arrays.command",
        "Find where contacts press on an array of sensors, and how strongly.",
    ),
    "simulate": (
        "extensions.simulation.command",
        "Make a synthetic scan, or the scans of an experiment.",
    ),
    "import": ("cli.import_", "Convert a table or a mesh to a scan or a reference."),
    "inspect": ("cli.inspect", "Show what a file holds."),
    "check": ("cli.check", "Check a file's safety, schema, digest and content."),
    "explain": ("cli.explain", "Explain what a quality check tests, and what to do if it fails."),
    "completion": ("cli.completion", "Print the shell's completion script."),
}
"""Command: its module, and what it does."""

VIEWS = {
    "ApparatusFunction": ("summaries.calibration", "figures.calibration.calibration_figure"),
    "Calibration": ("summaries.calibration", "figures.calibration.calibration_figure"),
    "Contact": ("summaries.contact", "figures.stress.contact_figure"),
    "FrictionComparison": ("summaries.comparison", "figures.friction.comparison_figure"),
    "Holds": ("", "figures.holds.holds_figure"),
    "MeasuredStress": ("summaries.stress", "figures.stress.measured_stress_figure"),
    "SlidingComparison": (
        "extensions.motion.friction_summary",
        "extensions.motion.friction_figure.friction_figure",
    ),
    "Restoration": ("summaries.restoration", "figures.stress.restoration_figure"),
    "ArrayCalibration": (
        "extensions.arrays.summary",
        "extensions.arrays.figure.array_figure",
    ),
    "Contacts": ("extensions.arrays.contacts_summary", ""),
    "SensorArray": ("extensions.arrays.summary", "extensions.arrays.figure.array_figure"),
    "Creep": (
        "extensions.motion.creep_summary",
        "extensions.motion.creep_figure.creep_figure",
    ),
    "Design": ("extensions.planning.summary", "extensions.planning.figure.design_figure"),
    "History": ("extensions.history.summary", "extensions.history.figure.history_figure"),
    "FleetResults": ("extensions.fleet.results_summary", "extensions.fleet.figure.fleet_figure"),
    "InterfaceComparison": (
        "extensions.interface_laws.summary",
        "extensions.interface_laws.figure.interface_figure",
    ),
    "MonteCarlo": ("extensions.monte_carlo.summary", ""),
    "Response": (
        "extensions.response.summary",
        "extensions.response.figure.response_figure",
    ),
    "SlidingContact": (
        "extensions.motion.sliding_summary",
        "extensions.motion.sliding_figure.sliding_figure",
    ),
    "Sweep": (
        "extensions.monte_carlo.sweep_summary",
        "extensions.monte_carlo.sweep_figure.sweep_figure",
    ),
}
"""Class of a result: the module with its tables, and the function that draws it."""

HOOKS = {
    "add_up": "extensions.arrays.import_array",
    "calibrate_array_file": "extensions.arrays.calibrate_command",
    "array_scan": "extensions.arrays.import_array",
    "columns_of_array": "extensions.arrays.import_array",
    "errors_of_sensors": "extensions.arrays.import_array",
    "drawn_as": "figures.style",
    "changes_by_dynamics": "extensions.motion.moving_model",
    "html_image": "figures.report",
    "html_report": "figures.report",
    "atomic_write_bytes": "formats.files",
    "text_of": "summaries.table",
    "scan_of_arrays": "formats.tables.scan",
    "write_artifact": "formats.artifact",
    "write_stress": "formats.stress",
    "compare_interface": "extensions.interface_laws.model_comparison",
    "compare_sliding": "extensions.motion.compare_sliding",
    "count_presses": "extensions.recorded.presses",
    "import_tables": "extensions.fleet.import_tables",
    "interface_figure": "extensions.interface_laws.figure",
    "kind_of_record": "extensions.recorded.kinds",
    "open_record": "extensions.recorded.kinds",
    "is_mesh": "extensions.meshes.mesh_files",
    "LiveScan": "extensions.acquisition.live_scan",
    "monte_carlo": "extensions.monte_carlo.monte_carlo",
    "moving_model": "extensions.motion.moving_model",
    "place_in_name": "extensions.fleet.recipe",
    "positions": "extensions.acquisition.positions",
    "press_at_finite_strain": "extensions.finite_strain.solve",
    "read_laboratory": "extensions.certificate.laboratory",
    "read_recipe": "extensions.fleet.recipe",
    "read_reference_mesh": "extensions.meshes.reference_mesh",
    "recipe_text": "extensions.fleet.recipe",
    "require_all_held": "extensions.recorded.presses",
    "accepted_differences": "formats.opened",
    "table_of": "summaries.table",
    "sweep_noise": "extensions.monte_carlo.sweep",
    "sliding_speed": "extensions.motion.velocities",
    "velocities": "extensions.motion.velocities",
    "with_creep": "extensions.motion.creep",
    "with_drawn_in": "extensions.meshes.mesh_files",
    "write_mesh": "extensions.meshes.mesh_files",
}
"""Function by which a room calls what stands above it, or an extension: its module."""

FILES = {
    "memscal-array": "extensions.arrays.files",
    "memscal-creep": "extensions.motion.creep",
}
"""Schema of an extension's files: the module with their reader, ``read_open``, and ``LAYOUT``."""

USES = {"planning": ["simulation"], "acquisition": ["planning"]}
"""Extension: the other ones that it imports."""


def module(name: str) -> Any:
    """Import a module that the table names."""
    return import_module(f"memscal.{name}")


def hook(name: str) -> Any:
    """Import a function that the table names."""
    return getattr(module(HOOKS[name]), name)
