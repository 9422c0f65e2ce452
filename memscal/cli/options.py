"""Options that several commands share, each with its unit in its help text."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from memscal.cli.failures import debug_option
from memscal.cli.output import FigurePath
from memscal.extensions import hook

if TYPE_CHECKING:
    from memscal.axisymmetry.kernels import RadialKernel
    from memscal.model.film import ElasticFilm
    from memscal.model.indenter import RoundIndenter
    from memscal.model.scan import Scan

_Command = Callable[..., Any]
_Scan = TypeVar("_Scan", bound="Scan")
_Adder = Callable[[_Command], _Command]

Options = dict[str, Any]
"""Values of a command's options, by their names."""


class _FileName(click.Path):
    """A file's name; the library checks whether it can be read or written."""

    name = "file"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Refuse an empty name, which would be that of the folder."""
        if not os.fspath(value):
            self.fail("The name of the file is empty.", param, ctx)
        return super().convert(value, param, ctx)


FILE = _FileName(readable=False, path_type=Path)
artifact_argument = click.argument("artifact", type=FILE)


def files_argument(metavar: str = "SCAN...", name: str = "scans") -> _Adder:
    """Return the argument of one or several files."""
    return click.argument(name, type=FILE, nargs=-1, required=True, metavar=metavar)


#: Powers of ten that take what is given to SI units.
_POWERS = {
    "um": -6,
    "mm": -3,
    "mm/s": -3,
    "mV": -3,
    "mV/Pa": -3,
    "percent": -2,
    "MPa": 6,
    "1/mm^2": 6,
}


def si(value: float, power: int) -> float:
    """Return a value times a power of ten, rounded as if it had been typed so."""
    if not math.isfinite(value):
        return value
    from decimal import Decimal

    return float(Decimal(repr(value)).scaleb(power))


@dataclass(eq=False)
class Quantity(click.ParamType):  # type: ignore[type-arg] # generic since click 8.2 only
    """A finite number in a unit, the name of the value; it becomes one in SI units."""

    unit: str
    low: float = 0.0
    high: float = math.inf
    open_low: bool = True
    infinite: bool = False

    def __post_init__(self) -> None:
        self.name = self.unit

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Read the number; refuse one out of range; return it in SI units."""
        in_unit = f" (in {self.name})" if self.name != "ratio" else ""
        try:
            number = float(str(value).replace("_", "?"))  # 1_0 is a number of Python alone
        except ValueError:
            point = " Write a decimal point, not a comma." if "," in str(value) else ""
            self.fail(f"{value!r} is not a number{in_unit}.{point}", param, ctx)
        finite = math.isfinite(number) or (self.infinite and number == math.inf)
        above = number > self.low if self.open_low else number >= self.low
        if not (finite and above and number <= self.high):
            self.fail(f"{value} is not {self._range}{in_unit}.", param, ctx)
        return si(number, _POWERS.get(self.name, 0))

    def get_metavar(self, *_: Any, **__: Any) -> str:
        """Return the unit as the name of the value: MM, but MPa."""
        return self.name.upper() if self.name.islower() else self.name

    @property
    def _range(self) -> str:
        bounds = []
        if self.low > -math.inf:
            bounds.append(("above" if self.open_low else "of at least") + f" {self.low:g}")
        if self.high < math.inf:
            bounds.append(f"at most {self.high:g}")
        return f"a number {' and '.join(bounds)}" if bounds else "a finite number"


POSITION = Quantity("mm", low=-math.inf)
NonNegative = partial(Quantity, open_low=False)
"""A quantity that may be zero, such as an uncertainty."""


def option(
    names: str, kind: Any = None, default: Any = None, **settings: Any
) -> Callable[[str], _Adder]:
    """Return what makes an option of its help text; blanks part its names."""
    # A kind that is a text is the name of the value, which is then any text; a list is of choices.
    if isinstance(kind, list):
        kind = click.Choice(kind)
    settings |= {"metavar": kind} if isinstance(kind, str) else {"type": kind}
    if default is not None:
        settings = {"default": default, "show_default": True} | settings
    return lambda about: click.option(*names.split(), help=about, **settings)


flag = partial(option, is_flag=True)
"""An option without a value."""
repeatable = partial(option, multiple=True)
"""An option that may be given several times."""


def options_of(*options: _Adder) -> _Adder:
    """Return the options as one, in their order."""

    def add(command: _Command) -> _Command:
        for adder in reversed(options):
            command = adder(command)
        return command

    return add


def declared_options(rows: Iterable[Options], kinds: Mapping[str, Any]) -> _Adder:
    """Return the options that rows of a file declare, with the kinds of values that it names."""
    return options_of(*(_declared(kinds, **row) for row in rows))


def _declared(
    kinds: Mapping[str, Any],
    names: str,
    about: str,
    kind: str = "",
    number: Options | None = None,
    choices: Sequence[str] = (),
    **settings: Any,
) -> _Adder:
    value = kinds.get(kind)
    if number:
        value = Quantity(**number)
    elif choices:
        value = choices
    return option(names, value, **settings)(about)


out_option = option("-o --output", FILE, metavar="OUT")
"""The option of the file to write, once its text says what that is."""


def figure_option(about: str) -> _Adder:
    """Return the option of a figure's files; the text says what is drawn."""
    return repeatable("--figure figures", FigurePath(), metavar="FILE.png|svg|pdf")(
        f"{about} May be repeated."
    )


def laboratory_option(subject: str) -> _Adder:
    """Return the option of a laboratory's file."""
    about = "Laboratory's file (lab.toml): sensor, film, rod, equipment, operator, conditions."
    return option("--lab", FILE, metavar="lab.toml")(subject + about)


def with_laboratory(path: Path | None, scan: _Scan) -> _Scan:
    """Return a scan with what a laboratory's file adds to it, where there is one."""
    if path is None:
        return scan
    return replace(scan, **hook("read_laboratory")(path).additions(scan))


def _one_form(ctx: click.Context, param: click.Parameter, given: bool) -> bool:
    """Refuse two forms of the results."""
    form = param.opts[0]
    if given and ctx.meta.setdefault("memscal.form", form) != form:
        raise click.UsageError(f"Give {ctx.meta['memscal.form']} or {form}, not both.")
    return given


json_option = flag("--json as_json", callback=_one_form)(
    "Print one JSON object in place of tables."
)
brief_option = flag("--brief", callback=_one_form)(
    "Print the first lines only, which say what was found."
)
force_option = flag("--force")("Replace outputs that exist.")
report_option = option("--report", FILE, metavar="FILE.html")(
    "Write a report as one HTML page, without other files, network or scripts."
)
override_option = flag("--override")(
    "Go on although sensor, channel or film of artifact and scan differ: recorded in the output."
)
accept_altered_option = flag("--accept-altered")(
    "Use files although their content does not fit their digest: recorded in the output."
)
noise_record_option = option("--noise-record", FILE)(
    "Readings at rest (memscal import --noise-record): their noise, in size and correlation, is "
    "that of the scans, at the times of the readings."
)
contact_options = options_of(noise_record_option, override_option, accept_altered_option)
"""How scans of contacts are read."""
output_options = options_of(json_option, force_option, debug_option)
report_options = options_of(brief_option, report_option, output_options)
"""Those of commands that answer in a few lines and can write a report."""

#: Those of memscal.model.film, which takes longer to import than help may; a test compares them.
FILM_LAWS = ("linear", "neo-hookean", "mooney-rivlin")
FILM = ("young_modulus", "poisson_ratio", "thickness")
"""What describes a film, by the names of its options."""
FILM_NUMBERS = (*FILM, *(f"{name}_uncertainty" for name in FILM))
"""The same with their uncertainties."""
LAW = ("film_law", "mooney_rivlin_ratio")
"""What describes its law."""

Defaults = Mapping[str, float | str | None]
"""Values of options that are not given, by their names without dashes."""

_NO_DEFAULTS: Defaults = {}

#: The paper's film and rod, in the units of the command line.
PAPER: Defaults = {
    "radius": 0.25,
    "radius-uncertainty": 0.0025,
    "young-modulus": 2.2,
    "poisson-ratio": 0.5,
    "thickness": 2.0,
    "young-modulus-uncertainty": 0.1,
    "poisson-ratio-uncertainty": 0.005,
    "thickness-uncertainty": 0.02,
    "film-law": "neo-hookean",
}

_UNCERTAINTY = "Standard uncertainty (k = 1) of "


def film_options(*, defaults: Defaults = _NO_DEFAULTS, uncertainties: bool = True) -> _Adder:
    """Return the film's options, with or without those of the uncertainties."""
    entries = (
        (
            "young-modulus",
            Quantity("MPa"),
            "Young's modulus of the film, in MPa.",
            "Young's modulus, in MPa.",
        ),
        (
            "poisson-ratio",
            NonNegative("ratio", high=0.5),
            "Poisson's ratio of the film, from 0 to 0.5 (incompressible).",
            "Poisson's ratio.",
        ),
        ("thickness", Quantity("mm"), "Thickness of the film, in mm.", "the thickness, in mm."),
    )
    return options_of(
        _measured(entries, defaults, uncertainties),
        option("--film-law", [*FILM_LAWS], defaults.get("film-law"))(
            "Law of the film's stress: small strain, or rubber."
        ),
        option("--mooney-rivlin-ratio", NonNegative("ratio"))(
            "C2/C1 of a film of --film-law mooney-rivlin."
        ),
    )


rod_friction_option = option(
    "--rod-friction",
    ["0", "inf"],
    callback=lambda _, __, text: None if text is None else float(text),
)
FREE_OR_STUCK = "Rod: 0, the film slides freely under it; inf, it sticks."


def radius_options(
    of: str = "the rod",
    *,
    defaults: Defaults = _NO_DEFAULTS,
    uncertainties: bool = True,
) -> _Adder:
    """Return the option of the indenter's radius, with or without its uncertainty."""
    about = f"Radius of {of} (not the diameter), in mm."
    radius = ("radius", Quantity("mm"), about, "the radius, in mm.")
    return _measured([radius], defaults, uncertainties)


def _measured(
    entries: Sequence[tuple[str, Quantity, str, str]],
    defaults: Defaults,
    uncertainties: bool,
) -> _Adder:
    """Return the options of quantities, then those of their uncertainties (the last texts)."""
    options = [(name, kind, about) for name, kind, about, _ in entries]
    for name, kind, _, of in entries if uncertainties else ():
        options.append((f"{name}-uncertainty", NonNegative(kind.name), _UNCERTAINTY + of))
    return options_of(
        *(option(f"--{name}", kind, defaults.get(name))(about) for name, kind, about in options)
    )


def film_from(options: Options, otherwise: str = "") -> ElasticFilm:
    """Return the film that the options describe; ``otherwise``: what to do without one of them."""
    _require("The film", options, FILM, otherwise)
    law = options["film_law"] or ""
    ratio = options["mooney_rivlin_ratio"]
    if (law == FILM_LAWS[-1]) != (ratio is not None):
        raise click.UsageError(
            "--film-law mooney-rivlin and --mooney-rivlin-ratio go together: give both or neither."
        )
    from memscal.model.film import ElasticFilm

    numbers: Options = {name: options.get(name) for name in FILM_NUMBERS}
    name = options.get("film_name") or ""
    return ElasticFilm(law=law, mooney_rivlin_ratio=ratio, name=name, **numbers)


def indenter_from(shape: str, options: Options) -> RoundIndenter:
    """Return the indenter that the options describe."""
    _require("The indenter", options, ("radius",))
    from memscal.model.indenter import Rod, Sphere

    kind = {"rod": Rod, "sphere": Sphere}[shape]
    spread = options.get("radius_uncertainty")
    name = options.get("indenter_name") or ""
    return kind(radius=options["radius"], radius_uncertainty=spread, name=name)


def named(names: Iterable[str]) -> str:
    """Return options as they are typed, by the names of their values."""
    return ", ".join("--" + name.replace("_", "-") for name in names)


def _require(subject: str, options: Options, names: Iterable[str], otherwise: str = "") -> None:
    missing = [name for name in names if options[name] is None]
    if missing:
        raise click.UsageError(f"{subject} is not fully given: add {named(missing)}.{otherwise}")


kernel_options = options_of(
    repeatable("--sigma sigmas", Quantity("um"), (561.0,))(
        "Standard deviation of the Gaussian apparatus function, in um. Repeated with "
        "--weight: a sum of Gaussians."
    ),
    repeatable("--weight weights", Quantity("ratio", low=-math.inf))(
        "Share of each Gaussian, in the order of --sigma; they add up to 1."
    ),
    option("--disc-radius", Quantity("um"))(
        "Radius of a uniform disc, in um: the apparatus function is this disc, blurred by a "
        "Gaussian of --sigma."
    ),
    option("--conversion-constant", Quantity("mV/Pa"), 1e-4)("Conversion constant A, in mV/Pa."),
)
"""The apparatus function and the conversion constant."""


def kernel_from(options: Options) -> RadialKernel:
    """Return the apparatus function that the options describe; refuse those of none, or of two."""
    from memscal.axisymmetry.kernels import GaussianMixture, SmoothedDisc

    sigmas = options["sigmas"]
    weights = options["weights"]
    if options["disc_radius"] is not None:
        if weights or len(sigmas) > 1:
            raise click.UsageError(
                "A disc is blurred by one Gaussian: give --disc-radius and one --sigma, and no "
                "--weight."
            )
        return SmoothedDisc(radius=options["disc_radius"], sigma=sigmas[0])
    if len(weights) != len(sigmas) and (weights or len(sigmas) > 1):
        raise click.UsageError(
            f"There are {len(sigmas)} --sigma and {len(weights)} --weight: give one weight to each."
        )
    return GaussianMixture(weights or (1.0,), sigmas)
