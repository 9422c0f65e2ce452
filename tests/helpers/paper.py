"""The paper's film, of any Poisson's ratio and thickness, its indenters and its loads."""

from memscal import ElasticFilm, Rod, Sphere


def film(nu=0.5, thickness=2e-3) -> ElasticFilm:
    """Film of 2.2 MPa that states neither uncertainties nor a law."""
    return ElasticFilm(young_modulus=2.2e6, poisson_ratio=nu, thickness=thickness)


FILM = film()
ROD = Rod(radius=0.25e-3)
SPHERE = Sphere(radius=128.8e-3)
LOADS = (0.34, 0.69, 1.37, 2.75)
