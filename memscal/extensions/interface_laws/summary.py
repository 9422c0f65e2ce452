"""Laws of the interface and their evidence, as tables and as JSON."""

from memscal.extensions.interface_laws.results import (
    ImpliedFriction,
    InterfaceComparison,
    InterfaceLaw,
    LawComparison,
)
from memscal.friction.results import INTERVAL, VALUE
from memscal.model.arrays import FloatArray, Values
from memscal.model.quantities import KPA, Quantity
from memscal.model.records import ESTIMATE_FIT, SLIP_LENGTH
from memscal.summaries.comparison import bounded_json, friction_name
from memscal.summaries.declared import members, plain
from memscal.summaries.table import Table, percent, texts_of

_LAW = ("name", "best", "log_evidence", "log_likelihood", "numerical_error")
_FACTOR = ("favoured", "against", "log_factor", "words", "log_likelihood_ratio")

COMPARED_LAWS = (
    Quantity("lubrication", "text", "dry or lubricated"),
    Quantity("loads", "force", "loads"),
)

_FRICTION = "effective_friction_coefficient"

IMPLIED = (
    Quantity("load", "force", "load"),
    Quantity("friction", "dimensionless", "effective coefficient", label=_FRICTION),
    Quantity("pressure", "stress", "mean pressure", label="mean_pressure"),
    Quantity("stiffness", "stress per length", "stiffness"),
)
"""What a slip length means at one load; coefficient and stiffness with the ends of intervals."""

_STIFFNESS = IMPLIED[-1]


def tables(comparison: InterfaceComparison) -> list[Table]:
    """Return evidence and lengths, and what a slip length means at each load."""
    shown = []
    for direction, compared in comparison.by_direction.items():
        shown += [_law_table(direction, compared), _length_table(direction, compared)]
        if compared.implied is not None:
            shown.append(_implied_table(compared.implied))
    return shown


def _law_table(direction: str, compared: LawComparison) -> Table:
    """Return the evidence of each law."""
    best = max(law.log_evidence for law in compared.laws)
    title = (
        f"Laws of the {compared.lubrication or 'contact'} interface, {direction}: "
        "evidence over all loads, below the best"
    )
    rows = []
    for law in compared.laws:
        below = f"{law.log_evidence - best:.1f}"
        reduced = f"{law.least / law.degrees:.2f}" if law.degrees > 0 else ""
        rows.append([law.name, _best(compared, law), below, reduced, f"{law.p_value:.2g}"])
    return Table(title, ["law", "best", "ln of evidence", "χ²/ν", "p"], rows)


def _best(compared: LawComparison, law: InterfaceLaw) -> str:
    """Return the free parameters where the likelihood is largest; the last law's is a length."""
    if law is compared.laws[-1]:
        return ", ".join(f"{value / SLIP_LENGTH.scale:.3g} um" for value in law.best)
    return ", ".join(friction_name(float(f"{value:.3g}")) for value in law.best)


def _length_table(direction: str, compared: LawComparison) -> Table:
    """Return the length, and the evidence for the law that yields against each other one."""
    words = "slip length" if direction == "tangential" else "length"
    rows = []
    for factor in compared.factors:
        law = factor.favoured
        side = "against"
        sign = -1
        if law == compared.laws[-1].name:
            law = factor.against
            side = "for"
            sign = 1
        value = f"{factor.value:.3g}" if factor.value < 1e6 else f"{factor.value:.1e}"
        ratio = factor.log_likelihood_ratio
        likelier = "" if ratio is None else f"{sign * ratio:+.1f}"
        rows.append([law, value, f"{side} it, {factor.words}", likelier])
    length = str(compared.length)
    if compared.length.kind in (VALUE, INTERVAL):
        length += f" [{percent(compared.length.interval.level)} interval]"
    title = f"The law that yields, {words} {length}, against the others"
    return Table(title, ["law", "Bayes factor", "evidence", "ln of likelihoods"], rows)


def _implied_table(implied: ImpliedFriction) -> Table:
    """Return what the slip length means at each load."""
    rows = []
    for load, friction, pressure, stiffness in zip(*vars(implied).values(), strict=True):
        stiff = _between(stiffness / _STIFFNESS.scale)
        rows.append([f"{load:.4g}", _between(friction), f"{pressure / KPA:.4g}", stiff])
    head = [quantity.heading for quantity in IMPLIED]
    return Table("What the slip length means at each load [its 95 % interval]", head, rows)


def _between(ends_about_best: FloatArray) -> str:
    """Return the best of three values, and the others as its interval."""
    first, best, last = (float(f"{number:.2g}") for number in ends_about_best)
    low = friction_name(min(first, last))
    high = friction_name(max(first, last))
    return f"{friction_name(best)} [{low}, {high}]"


def mapping(comparison: InterfaceComparison) -> Values:
    """Return laws, evidence and lengths as JSON holds them."""
    whole = {
        direction: {
            **members(COMPARED_LAWS, compared),
            "laws": [_held(_LAW, law) | members(ESTIMATE_FIT[1:], law) for law in compared.laws],
            "bayes_factors": [_held(_FACTOR, factor) for factor in compared.factors],
            "length": bounded_json(SLIP_LENGTH, compared.length),
            "implied": None if compared.implied is None else _implied_json(compared.implied),
        }
        for direction, compared in comparison.by_direction.items()
    }
    return whole | {"warnings": texts_of(comparison.messages)}


def _held(names: tuple[str, ...], record: object) -> Values:
    return {name: plain(getattr(record, name)) for name in names}


def _implied_json(implied: ImpliedFriction) -> list[Values]:
    names = [quantity.name for quantity in IMPLIED]
    rows = zip(*vars(implied).values(), strict=True)
    return [members(IMPLIED, implied, **dict(zip(names, row, strict=True))) for row in rows]
