"""How an implicit equation was found and what is proved about it."""

from dataclasses import dataclass
from typing import Literal

Proof = Literal["exact", "modular", "approximate"]


@dataclass(frozen=True)
class Certificate:
    """What is known of the result of `implicitize`.

    Attributes
    ----------
    method
        "null space", "moving planes" or "approximate".
    degree
        Total degree of f.
    map_degree
        How many parameter points (complex, in general) lie over one point of the surface; 0 if not counted.
    base_points
        Finite parameter points where all homogeneous coordinates vanish, counted with multiplicity.
    proof
        "exact": f(x(u, v), y(u, v), z(u, v)) = 0 is proved over the integers and f is proved irreducible.
        "modular": both hold modulo fresh primes at random points. "approximate": neither, see `residual`.
    residual
        Largest distance from f = 0 to the points of the patch that were measured, a length; 0 for exact answers.
    chance
        A bound on the probability of error of a modular proof; 0 for exact ones, 1 for approximate answers.
    """

    method: str
    degree: int
    map_degree: int
    base_points: int
    proof: Proof
    residual: float = 0.0
    chance: float = 0.0
