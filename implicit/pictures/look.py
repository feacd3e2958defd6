"""How a picture is taken: colours, direction, lens."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

from implicit.domain import Vector

Color: TypeAlias = tuple[float, float, float]
"""Red, green and blue from 0 to 1."""

RED: Color = (0.86, 0.07, 0.09)
DARK: Color = (0.13, 0.14, 0.17)


@dataclass(frozen=True)
class Look:
    """How a picture is taken.

    outside, inside    colours (red, green, blue) from 0 to 1 of the two sides of the surface
    triangles          "smooth", or "random": every triangle in a colour of its own
    edges              whether the edges of the triangles are drawn
    view, up           from the surface to the eye, and the direction that points up in the picture
    angle              the opening of the lens in radians
    background         colours at the top and at the bottom; None is transparent
    """

    outside: Color = (0.16, 0.42, 0.68)
    inside: Color = (0.96, 0.70, 0.30)
    triangles: Literal["smooth", "random"] = "smooth"
    edges: bool = False
    view: Vector = (1.0, -1.7, 1.0)
    up: Vector = (0.0, 0.0, 1.0)
    angle: float = 0.4
    background: tuple[Color, Color] | None = ((1.0, 1.0, 1.0), (0.90, 0.92, 0.94))
