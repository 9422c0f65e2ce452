"""Records of laws of the interface: their evidence, the slip length, and what it means."""

from scipy.special import chdtrc

from memscal.friction.results import BoundedEstimate
from memscal.model.arrays import FloatArray, array_record, value_record
from memscal.model.bayes_factor import POSITIVE, BayesFactor
from memscal.model.checks import Message
from memscal.model.result import Shown


@value_record
class InterfaceLaw:
    r"""One law of the interface, weighed over all loads together.

    ``best`` are its free parameters at the largest likelihood (coefficients, of each load if there
    are several, or a length in m).  ``log_evidence``,
    :math:`\ln \int p(u | \theta)\,\pi(\theta)\,d\theta`, and ``log_likelihood``, the largest
    :math:`\ln p(u | \theta)`, share a constant of the scans; ``numerical_error`` is the standard
    uncertainty of the integral.  ``least`` and ``degrees`` are of chi-square at best.
    """

    name: str
    best: tuple[float, ...]
    log_evidence: float
    log_likelihood: float
    numerical_error: float
    least: float
    degrees: int

    @property
    def p_value(self) -> float:
        """Chance of a larger chi-square."""
        return float(chdtrc(self.degrees, self.least)) if self.degrees > 0 else 1.0


@array_record
class ImpliedFriction:
    r"""What the fitted slip length means at each of ``loads`` (l,), in N, increasing.

    ``friction`` (l, 3): Amontons' coefficients that give the same stress on the axis, through the
    sensor, as lower end, best value and upper end of the slip length; ``inf`` where full stick is
    not more than that.  ``pressures`` (l,): :math:`\bar p = P/\pi a^2` in Pa.  ``stiffnesses``
    (l, 3): :math:`\mu\bar p/\ell` in Pa/m for the three; ``inf`` of a rigid interface.
    """

    loads: FloatArray
    friction: FloatArray
    pressures: FloatArray
    stiffnesses: FloatArray


@array_record
class LawComparison:
    """Laws of the interface over all ``loads`` (l,), in N, of one lubrication.

    The last of ``laws`` yields over ``length``; ``factors`` weigh it against each of the others.
    ``implied`` says what a slip length means at each load; it is ``None`` of a normal law.
    """

    lubrication: str
    loads: FloatArray
    laws: tuple[InterfaceLaw, ...]
    factors: tuple[BayesFactor, ...]
    length: BoundedEstimate
    implied: ImpliedFriction | None = None

    @property
    def yielding_preferred(self) -> bool:
        """Whether the evidence for the law that yields is positive, and its likelihood larger.

        Its largest likelihood is above that of every law with as many parameters or fewer.
        """
        *others, yielding = self.laws
        evident = 2 * (yielding.log_evidence - max(law.log_evidence for law in others)) >= POSITIVE
        rivals = [law for law in others if len(law.best) <= len(yielding.best)]
        likelier = all(yielding.log_likelihood > law.log_likelihood for law in rivals)
        return evident and likelier


@array_record
class InterfaceComparison(Shown):
    """Laws of the interface against an effective friction coefficient, by evidence.

    ``macroscopic`` is the coefficient at which the interface slips and its standard uncertainty.
    ``tangential``, of dry scans: one effective coefficient, one for each load, and the
    elasto-plastic law with a slip length; ``normal``, of lubricated scans: a rigid frictionless
    interface, and one that yields normally; ``None`` without such scans.

    Examples
    --------
    >>> import memscal
    >>> film = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> made = memscal.simulate_experiment(
    ...     film=film, friction=0.1, loads=[0.69], lubricated_loads=[0.69]
    ... )
    >>> sensor = memscal.calibrate(made.rod, method="bayesian").apparatus
    >>> comparison = memscal.compare(
    ...     made.dry, sensor, friction=(0, 0.1), loading="total", interface=True, macroscopic=0.1
    ... )
    >>> laws = comparison.interface
    >>> laws.normal is None  # no lubricated scan was given
    True
    """

    macroscopic: tuple[float, float | None]
    tangential: LawComparison | None
    normal: LawComparison | None
    messages: tuple[Message, ...] = ()

    def __repr__(self) -> str:
        """Return the length of each law that yields."""
        lengths = (f"{name}: {laws.length}" for name, laws in self.by_direction.items())
        return f"<InterfaceComparison: {'; '.join(lengths)}>"

    @property
    def by_direction(self) -> dict[str, LawComparison]:
        """What was compared, by the direction in which the interface yields."""
        both = {"tangential": self.tangential, "normal": self.normal}
        return {name: laws for name, laws in both.items() if laws is not None}
