"""Records of memscal as tables of quantities, in the order in which files hold them."""

from dataclasses import replace

from memscal.model.assumptions import LENGTHS, SIZE_KEYS
from memscal.model.quantities import ESTIMATED, Quantity, Record, along, measured, record, required
from memscal.model.scan import STATED_ERRORS

_L = "length"
#: What a scan states an uncertainty of that is one, and not none, where all is as it should be.
_FACTORS = ("position_scale", "gain")
_P = "stress"
_U = "voltage"
_ONE = "dimensionless"
_A = "voltage per stress"
_W = "wavenumber"
_PER_AREA = "per area"
_OF_G = "standard uncertainty of G, with detail that the film hides"
_R = ("r",)
_X = ("x",)
_YX = ("y", "x")

# The second axis of a covariance has a name of its own: netCDF tools want each dimension once.
_RR = ("r", "r_prime")

FILM = record(
    "NXcollection",
    *measured(Quantity("young_modulus", _P, "Young's modulus", "E", shown="MPa", required=True)),
    *measured(Quantity("poisson_ratio", _ONE, "Poisson's ratio", "ν", required=True)),
    *measured(Quantity("thickness", _L, "thickness", "h", required=True)),
    *measured(Quantity("roughness_rms", _L, "rms roughness", shown="um")),
    Quantity("law", "text", "law"),
    Quantity("mooney_rivlin_ratio", _ONE, "C2/C1"),
    Quantity("name", "text", "name of the film", origin="film"),
)

ROUND_INDENTER = record(
    "NXcollection",
    *measured(Quantity("radius", _L, "radius", "R", required=True)),
    Quantity("name", "text", "name of the indenter", origin="indenter"),
)
CONE = record(
    "NXcollection", Quantity("inclination", "angle", "inclination of the face", required=True)
)
INDENTER_FACE = record(
    "NXdata",
    *required(
        Quantity("r", _L, "radius", "r", _R), Quantity("z", _L, "height of the face", "z", _R)
    ),
    signal="z",
)
_LOAD = measured(Quantity("load", "force", "load", "P", required=True))
SLIDING = record(
    "NXcollection",
    Quantity("motion", "text", "motion of the indenter"),
    Quantity("speed", "speed", "speed of the indenter", "V"),
    *measured(Quantity("sliding_friction", _ONE, "sliding friction", "μ")),
)
"""How an indenter moves over the film."""

LOAD = record(
    "NXcollection",
    *_LOAD,
    Quantity("rod_friction", _ONE, "friction of the rod", stored="friction_coefficient"),
    *SLIDING.quantities,
)
INDENTER = record(
    "NXcollection",
    Quantity("shape", "text", "shape of the indenter", required=True),
    *ROUND_INDENTER.quantities,
    *CONE.quantities,
    *LOAD.quantities,
)
"""What the group of an indenter may hold, by its shape."""

SAMPLE = record(
    "NXsample",
    Quantity("lubrication", "text", "dry or lubricated", origin="lubrication"),
    Quantity("lubricant", "text", "lubricant", origin="lubricant"),
)
SENSOR = record(
    "NXsensor",
    Quantity("name", "text", "name of the sensor", origin="sensor"),
    Quantity("model", "text", "model of the sensor", origin="sensor_model"),
    Quantity("serial_number", "text", "serial number of the sensor"),
    Quantity("channel", "text", "channel of the sensor", origin="channel"),
    Quantity("manufacturer", "text", "manufacturer of the sensor"),
    *measured(Quantity("temperature", "temperature", "temperature of the sensor")),
)
DYNAMICS = record(
    "NXcollection",
    *measured(Quantity("low_pass", "frequency", "low-pass", "f_c")),
    *measured(Quantity("resonance", "frequency", "resonance", "f₀")),
    *measured(Quantity("quality", _ONE, "quality of the resonance", "Q")),
    *measured(Quantity("creep_share", _ONE, "share of the creep", "g")),
    *measured(Quantity("creep_time", "time", "time of the creep", "τ")),
    Quantity("creep_record", "time", "length of the record of the creep"),
)
"""How a sensor follows a signal in time."""


def _equipment(nx_class: str, words: str, origin: str) -> Record:
    return record(
        nx_class,
        Quantity("name", "text", f"name of the {words}", origin=origin),
        Quantity("serial_number", "text", f"serial number of the {words}"),
        Quantity("certificate", "text", f"certificate of the {words}"),
        Quantity("certificate_date", "text", f"date of the certificate of the {words}"),
    )


LOAD_CELL = _equipment("NXsensor", "load cell", "load_cell")
STAGE = _equipment("NXpositioner", "stage", "stage")
USER = record(
    "NXuser",
    Quantity("name", "text", "who measured", origin="user"),
    Quantity("affiliation", "text", "laboratory", origin="laboratory"),
)
CONVERSION = record(
    "NXcollection",
    *required(*measured(Quantity("conversion_constant", _A, "conversion constant", "A"))),
)

TIMES = record(
    "NXentry",
    Quantity("start_time", "text", "begin of the scan", origin="start_time"),
    Quantity("end_time", "text", "end of the scan", origin="end_time"),
)
EXPERIMENT = record(
    "NXentry",
    *TIMES.quantities,
    Quantity("notes", "note", "notes of the experiment", origin="notes"),
)
_POSITION_X = Quantity("x", _L, "position along x", "x", _X)
_POSITION_Y = Quantity("y", _L, "position along y", "y", ("y",))
# The axes of the signal are those of the scan: [x], [y], [repeat, x], [repeat, y] or [y, x].
SCAN_DATA = record(
    "NXdata",
    _POSITION_X,
    _POSITION_Y,
    Quantity("repeat", _ONE, "repeat", axes=("repeat",)),
    Quantity("branch", _ONE, "approach (1) or retreat (2) of the indenter", axes=_X),
    Quantity("x_errors", _L, "standard uncertainty of x", axes=_X),
    Quantity("y_errors", _L, "standard uncertainty of y", axes=("y",)),
    Quantity("u_zz", _U, "voltage of the normal channel", "U_zz", _X, required=True),
    Quantity("u_zz_errors", _U, "noise of the normal channel", axes=_X),
    Quantity("u_zz_correlation", _ONE, "correlation of the noise", axes=("point", "point_prime")),
    *along(
        _X,
        Quantity("normal_load", "force", "load at each point", "P"),
        Quantity("normal_load_errors", "force", "standard uncertainty of the load"),
        Quantity("tangential_load", "force", "tangential load", "Q"),
        Quantity("u_xz", _U, "voltage of the channel xz", "U_xz"),
        Quantity("u_xz_errors", _U, "noise of the channel xz"),
        Quantity("u_yz", _U, "voltage of the channel yz", "U_yz"),
        Quantity("u_yz_errors", _U, "noise of the channel yz"),
        Quantity("time", "time", "time from the first reading", "t"),
        Quantity("sliding_direction", _ONE, "direction of sliding", stored="direction"),
    ),
    # One number of a single sensor.
    Quantity("reading_high", _U, "end of the range of each sensor", axes=("sensor",)),
    signal="u_zz",
)
SENSORS = (
    Quantity("sensors", "names", "sensors of an array", stored="sensor_names"),
    *along(
        ("sensor",),
        Quantity("layout_x", _L, "place of each sensor along x"),
        Quantity("layout_y", _L, "place of each sensor along y"),
        Quantity("layout_x_errors", _L, "standard uncertainty of the place along x"),
        Quantity("layout_y_errors", _L, "standard uncertainty of the place along y"),
        Quantity("used", _ONE, "1 of a sensor that is used, 0 of another"),
        Quantity("reading_low", _U, "begin of the range of each sensor"),
        Quantity("board", _ONE, "number of the board of each sensor"),
    ),
)
"""What the scan of an array states of its sensors, beside its arrays."""
TAKEN_FOR_GRANTED = record(
    "NXdata",
    Quantity("line_offset", _L, "distance of the line from the sensor"),
    *(
        Quantity(
            f"{name}_uncertainty",
            _L if name in LENGTHS else _ONE,
            stored=f"{name}_errors",
            of=float(name in _FACTORS),
        )
        for name in STATED_ERRORS
    ),
    Quantity("averaging_length", _L, "way over which each reading is the mean"),
    Quantity("dwell_time", "time", "time at each place before its reading"),
    Quantity("position_errors_by_repeat", "truth", "whether x_errors are new in each repeat"),
    Quantity("at_ceiling", _ONE, "number of readings left out at a ceiling"),
    *SENSORS,
)
"""What a scan states of that beside its arrays, each number only where it is stated."""
SYNTHETIC = record(
    "NXcollection", Quantity("description", "text", "what is synthetic", origin="synthetic")
)

PROFILE = record(
    "NXdata",
    *along(
        _R,
        *required(
            Quantity("r", _L, "distance from the indenter's axis", "r"),
            Quantity("sigma_zz", _P, "normal stress at the base", "σ_zz"),
        ),
        Quantity("sigma_rz", _P, "radial traction on the film", "σ_rz"),
        Quantity("sigma_zz_errors", _P, "standard uncertainty of the normal stress"),
    ),
    signal="sigma_zz",
)
IDEAL_REFERENCE = record(
    "NXcollection",
    *required(
        Quantity("shape", "text", "shape of the reference"),
        Quantity("size", _L, "size of the reference"),
    ),
)
REFERENCE_DATA = record(
    "NXdata",
    *PROFILE.quantities,
    *IDEAL_REFERENCE.quantities,
    _POSITION_X,
    _POSITION_Y,
    Quantity("values", _ONE, "field", axes=_YX, stored="field"),
)
"""What the group of a reference may hold: a profile, an ideal reference, or a field."""
CONTACT = record(
    "NXcollection",
    _LOAD[0],
    Quantity("depth", _L, "depth", "d", shown="um"),
    Quantity("contact_radius", _L, "contact radius", "a"),
    Quantity("stick_radius", _L, "stick radius", "c"),
    Quantity("friction_coefficient", _ONE, "friction coefficient", "μ"),
    Quantity("loading", "text", "incremental or total loading"),
)
SOLVER = record(
    "NXprocess", Quantity("solver", "text", "program", stored="program", origin="program")
)
NUMERICS = record(
    "NXparameters",
    Quantity("convergence", _ONE, "estimated relative error of the largest stress"),
    Quantity("discretisation", "text", "mesh or quadrature"),
)
PROFILE_NOTES = record("NXprocess", Quantity("notes", "note", "notes", origin="reference_notes"))

FIELD = record(
    "NXdata",
    *required(
        _POSITION_X,
        _POSITION_Y,
        Quantity("g", _PER_AREA, "apparatus function", "G", _YX),
        Quantity("g_errors", _PER_AREA, _OF_G, axes=_YX),
    ),
    Quantity("g_scatter", _PER_AREA, "part of g_errors that scatters between scans", axes=_YX),
    signal="g",
)
RADIAL = record(
    "NXdata",
    *along(
        _R,
        *required(
            Quantity("r", _L, "distance from the sensor", "r"),
            Quantity("g", _PER_AREA, "apparatus function", "G"),
            Quantity("g_errors", _PER_AREA, _OF_G),
            Quantity("g_gaussian", _PER_AREA, "Gaussian fitted to the scan"),
        ),
        Quantity("conversion_correlation", _ONE, "correlation of the errors of G and A"),
    ),
    signal="g",
)
RADIAL_COVARIANCE = record(
    "NXdata",
    RADIAL.quantities[0],
    Quantity("r", _L, "distance from the sensor", axes=("r_prime",), stored="r_prime"),
    Quantity("g_covariance", "per area squared", "covariance of G", axes=_RR, required=True),
    signal="g_covariance",
)
KERNEL_CHANGES = record(
    "NXdata",
    Quantity(
        "kernel_changes",
        _PER_AREA,
        "A G over A by one uncertainty",
        axes=("input", "r"),
        required=True,
        stored="changes",
    ),
    signal="changes",
)
"""Changes of A G over A by one standard uncertainty of each input, in the order of names."""
SHARED_EFFECTS = record(
    "NXdata",
    *required(
        Quantity("k", _W, "wavenumber", "k", ("k",)),
        Quantity("of_a", _ONE, "change of ln A", axes=("source",)),
        Quantity("of_sigma", _ONE, "change of ln sigma", axes=("source",)),
        Quantity("of_transfer", _ONE, "change of ln(A G(k))", axes=("source", "k")),
    ),
    signal="of_transfer",
)
"""Signed effects of one standard uncertainty of each source, in the order of names."""
RADIAL_VERSION_1_0 = record(
    "NXdata",
    *RADIAL.quantities[:4],
    *RADIAL_COVARIANCE.quantities[1:],
    RADIAL.quantities[4],
    signal="g",
)
"""The radial profile in files of version 1.0, which held its covariance."""
TRANSFER = record(
    "NXdata",
    *required(
        *along(
            ("k",),
            Quantity("k", _W, "wavenumber", "k"),
            Quantity("modulus", _ONE, "modulus of the transfer function", "|Ĝ|"),
            Quantity("modulus_errors", _ONE, "standard uncertainty of |Ĝ|"),
            Quantity("window", _ONE, "window of the regularisation"),
        ),
        Quantity("resolved_wavenumber", _W, "resolved up to the wavenumber", "k"),
    ),
    signal="modulus",
)
RECONVOLUTION = record(
    "NXdata",
    *along(
        _X,
        *required(
            Quantity("x", _L, "position", "x"),
            Quantity("u_zz", _U, "voltage", "U"),
            Quantity("u_zz_errors", _U, "noise of the voltage"),
            Quantity("u_zz_predicted", _U, "predicted with the deconvolved G"),
            Quantity("u_zz_gaussian", _U, "predicted with the Gaussian"),
            Quantity("residual", _U, "measured minus predicted"),
        ),
        Quantity("offset_x", _L, "position from the centre along x"),
        Quantity("offset_y", _L, "position from the centre along y"),
        Quantity("load", "force", "load at each point", "P", stored="normal_load"),
        Quantity("background", _U, "baseline and drift"),
    ),
    signal="u_zz",
)
CHECK = record(
    "NXcollection",
    Quantity("name", "text", "check"),
    *required(
        Quantity("value", _ONE, "value"),
        Quantity("limit", _ONE, "limit"),
        Quantity("passed", "truth", "whether the value is within the limit"),
    ),
    Quantity("meaning", "text", "meaning"),
    Quantity("p_value", _ONE, "chance of such a value, or a larger one", "p"),
)


def assumption_record(name: str) -> Record:
    """Return the record of the sizes at which an assumption moves each parameter by one u."""
    dimension = _L if name in LENGTHS else _ONE
    sizes = (
        Quantity(moved, dimension, f"size for u({ESTIMATED[moved].symbol})", stored=key)
        for moved, key in SIZE_KEYS.items()
    )
    state = Quantity("state", "text", "assumed, stated or measured", required=True)
    return record("NXcollection", state, *required(*sizes))


PROCESS = record(
    "NXprocess",
    Quantity("program", "text", "program", origin="program"),
    Quantity("version", "text", "version of the program", origin="version"),
    Quantity("date", "text", "date", origin="date"),
    Quantity("configuration", "mapping", "Every option with its value.", origin="configuration"),
    Quantity(
        "environment",
        "mapping",
        "Versions of Python and of the numerical libraries.",
        origin="environment",
    ),
    Quantity("messages", "messages", "What the user was told while it ran.", origin="messages"),
    Quantity("input_scan", "file", "scan", origin="input_scan"),
    Quantity("input_reference", "file", "reference", origin="input_reference"),
)

# Along r; x and y are the indenter's positions.
STRESS_PROFILE = record(
    "NXdata",
    *along(
        _R,
        *required(
            Quantity("r", _L, "distance from the centre", "r"),
            Quantity("x", _L, "position along x", "x"),
        ),
        Quantity("y", _L, "position along y", "y"),
        *required(
            Quantity("s_zz", _P, "measured normal stress", "S_zz"),
            Quantity("s_zz_errors", _P, "standard uncertainty of S_zz"),
        ),
    ),
    signal="s_zz",
)
_LUBRICATION = Quantity("lubrication", "text", "dry or lubricated")
_TOTAL_FORCE = measured(Quantity("force", "force", "total force", "F", required=True))
STRESS_NUMBERS = record(
    "NXdata",
    *_LOAD,
    _LUBRICATION,
    *_TOTAL_FORCE,
    *measured(Quantity("maximum", _P, "maximum of S_zz", "S", required=True)),
    *required(*measured(Quantity("centre", _L, "centre", "x₀"))),
    *measured(Quantity("centre_y", _L, "centre along y", "y₀")),
    *required(*measured(Quantity("baseline", _U, "baseline", "U₀"))),
    Quantity("contact_radius", _L, "contact radius", "a", required=True),
)
SLID = record(
    "NXdata",
    Quantity("direction", _ONE, "direction of sliding"),
    Quantity("tangential_load", "force", "mean tangential load", "Q"),
)
"""Numbers of a profile whose indenter slid, beside its other ones."""
STRESS_CURVE = record(
    "NXdata",
    *required(
        Quantity("curve_r", _L, "distance from the centre", "r", _R, stored="r"),
        Quantity("curve_s_zz", _P, "fitted stress", "S_zz", _R, stored="s_zz"),
    ),
    signal="s_zz",
)
MEASURED_SCAN = record(
    "NXcollection",
    *required(
        Quantity("width", _L, "extent of the positions"),
        Quantity("synthetic", "truth", "whether the scan is synthetic"),
    ),
    *TAKEN_FOR_GRANTED.quantities[1:3],  # scale of the positions, and gain
    TAKEN_FOR_GRANTED.quantities[-3],  # whether errors of positions are new in each repeat
    Quantity("unit", "text", "unit of readings that are no voltages"),
)


def points_record(channel: str) -> Record:
    """Return the record of the measured points of a channel: ``zz``, ``xz`` or ``yz``."""
    u = f"u_{channel}"
    return record(
        "NXdata",
        *along(
            ("point",),
            *required(
                Quantity("x", _L, "position along x"),
                Quantity("y", _L, "position along y"),
                Quantity("x_errors", _L),
                Quantity("u", _U, "voltage", stored=u),
                Quantity("weight", _ONE, stored="outlier_weight"),
                Quantity("load", "force", stored="normal_load"),
                Quantity("load_errors", "force", stored="normal_load_errors"),
            ),
            Quantity("noise", _U, stored=f"{u}_errors"),
        ),
        Quantity("correlation", _ONE, axes=("point", "point_prime"), stored=f"{u}_correlation"),
        Quantity("by_dynamics", _U, axes=("source", "point"), stored=f"{u}_by_dynamics"),
        signal=u,
    )


# What results show beyond what files hold: the members of JSON, the cells of tables.
_COUNT = "number"

FIT = (
    Quantity("chi_square", _COUNT, "chi-square", "χ²", label="chi2"),
    Quantity("degrees", _COUNT, "degrees of freedom", "ν"),
    Quantity("p_value", _COUNT, "chance of such a chi-square, or a larger one", "p"),
)
FRICTION = Quantity("friction", _ONE, "friction coefficient", "μ")
_FRICTION_LAW = (
    replace(FRICTION, label="friction_coefficient"),
    Quantity("sticking", "truth", "whether nothing slips"),
)
SOLUTION = (
    *CONTACT.quantities[:4],
    Quantity("max_interface_stress", _P, "interface peak", shown="Pa"),
    Quantity("max_base_stress", _P, "base peak", shown="Pa"),
    *_FRICTION_LAW,
    CONTACT.quantities[5],
    Quantity("backend", "text", "method of solution"),
    Quantity("strain", "text", "linear or finite strain"),
    Quantity("film_law", "text", "law of the film"),
    Quantity("convergence", _ONE, "change"),
    Quantity("steps", _COUNT, "steps"),
    Quantity("elastic_energy", "energy", "elastic energy of the film"),
    Quantity("work", "energy", "work of the indenter"),
    Quantity("dissipated_energy", "energy", "energy that friction has taken"),
    NUMERICS.quantities[1],
)
FORCE_BUDGET = Quantity("force_budget", "force", "uncertainty of it by source", axes=("source",))
MAXIMUM_BUDGET = Quantity("maximum_budget", _P, "that of the maximum", axes=("source",))
APPLIED = (
    *measured(Quantity("conversion_constant", _A, "conversion constant A")),
    *measured(Quantity("force_over_load", _ONE, "total force over applied load")),
)
RESTORED = (
    _LOAD[0],
    *_TOTAL_FORCE,
    *measured(Quantity("stress_on_axis", _P, "stress on the axis")),
    *measured(ESTIMATED["centre"]),
    *measured(ESTIMATED["centre_y"]),
    *measured(ESTIMATED["baseline"]),
    FORCE_BUDGET,
    TRANSFER.quantities[-1],
)
"""Numbers of a restoration; a centre is left out where it does not apply."""

RESTORED_AGAINST = (
    Quantity("origin", "text", "what was calculated"),
    Quantity("chi_square", _COUNT, "reduced chi-square", "χ²/ν", label="chi2_reduced"),
    *FIT[1:],
    Quantity("difference", _COUNT, "largest difference", label="largest_difference"),
    Quantity("within", _COUNT, "share of the radii", label="share_within_95_percent"),
)
SLIP_LENGTH = Quantity("length", _L, "slip length", shown="um")

ESTIMATE_FIT = (
    Quantity("budget", _COUNT, "standard uncertainty by source", axes=("source",)),
    Quantity("least", _COUNT, "least chi-square", "χ²", label="chi2"),
    *FIT[1:],
)
COMPARED_LOAD = (_LUBRICATION, _LOAD[0], *measured(Quantity("force", "force", "force", "F")))
COMPARED_MAXIMA = (
    *measured(Quantity("s_max", _P, "S_max", label="S_max")),
    *measured(Quantity("p0_max", _P, "p0_max", label="p0_max")),
    *measured(Quantity("ratio", _ONE, "S_max/p0_max")),
)
"""What was measured at one load: the profile's force, maxima beside the frictionless ones."""

CALCULATED = (
    *_FRICTION_LAW,
    Quantity("p_max", _P, "largest calculated stress"),
    FIT[0],
    FIT[2],
    Quantity("deviance", _COUNT, "twice the loss of the log likelihood", "-2 ln(p/p_max)"),
)
DRY_AGAINST_LUBRICATED = (
    _LOAD[0],
    *measured(Quantity("maximum", _P, "on the axis", label="on_axis")),
    *measured(Quantity("relative", _ONE, "of the lubricated")),
    *FIT,
)
