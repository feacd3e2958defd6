"""Surfaces of galleries of algebraic surfaces, many of Hauser's, and some more: which are listed as unresolved.

Their topology is not written down here; what is counted is what `method="auto"` itself does not pass off as right.
"""

import time

from implicit import Ball, Surface, polygonize
from tests.benchmarks.measure import markdown

SURFACES = {
    "zitrus": ("x^2+z^2-y^3*(1-y)^3", 1.5),
    "daisy": ("(x^2-y^3)^2-(z^2-y^2)^3", 1.5),
    "calyx": ("x^2+y^2*z^3-z^4", 1.5),
    "helix": ("6*x^2-2*x^4-y^2*z^2", 1.5),
    "tuelle": ("y*z*(x^2+y^2-z)", 1.5),
    "sofa": ("x^2+y^3+z^5", 1.5),
    "nepali": ("(x*y-z^3-1)^2-(1-x^2-y^2)^3", 2),
    "himmel": ("x^2-y^2*z^2", 1.5),
    "durchblick": ("x^3*y+x*z^3+y^3*z+z^3+5*z", 1.5),
    "eistuete": ("(x^2+y^2)^3-4*x^2*y^2*(z^2+1)", 2),
    "distel": ("x^2+y^2+z^2+1500*(x^2+y^2)*(x^2+z^2)*(y^2+z^2)-1", 1.5),
    "dullo": ("(x^2+y^2+z^2)^2-x^2-y^2", 1.5),
    "crixxi": ("(y^2+z^2-1)^2+(x^2+y^2-1)^3", 2),
    "buggle": ("x^4*y^2+y^4*x^2-x^2*y^2+z^6", 1.5),
    "flirt": ("x^2-x^3+y^2+y^4+z^3-10*z^4", 1.5),
    "geisha": ("x^2*y*z+x^2*z^2-y^3*z-y^3", 1.5),
    "harlekin": ("x^3*z+10*x^2*y+x*y^2+y*z^2-z^3", 1.5),
    "leopold": ("1000*x^2*y^2*z^2+3*x^2+3*y^2+z^2-1", 1.5),
    "limao": ("x^2-y^3*z^3", 1.5),
    "miau": ("x^2*y*z+x^2*z^2+2*y^3*z+3*y^3", 1.5),
    "pilzchen": ("(z^3-1)^2+(x^2+y^2-1)^3", 1.5),
    "plop": ("x^2+(z+y^2)^3", 1.5),
    "seepferdchen": ("(x^2-y^3)^2-(x+y^2)*z^3", 1.5),
    "solitude": ("x^2*y*z+x*y^2+y^3+y^3*z-x^2*z^2", 1.5),
    "subway": ("x^2*y^2+(z^2-1)^3", 1.5),
    "suess": ("(x^2+9/4*y^2+z^2-1)^3-x^2*z^3-9/80*y^2*z^3", 1.5),
    "taube": ("256*z^3-128*x^2*z^2+16*x^4*z+144*x*y^2*z-4*x^3*y^2-27*y^4", 1.5),
    "tanz": ("2*x^4-x^2-y^2*z^2", 1.5),
    "trichter": ("x^2+z^3-y^2*z^2", 1.5),
    "twilight": ("(z^3-2)^2+(x^2+y^2-3)^3", 2.2),
    "visavis": ("x^2-x^3+y^2+y^4+z^3-z^4", 1.5),
    "wigwam": ("x^2+y^2*z^3", 1.5),
    "windkanal": ("-x^2+y^4+z^4-x*y*z", 1.5),
    "xano": ("x^4+z^3-y*z^2", 1.5),
    "zeck": ("x^2+y^2-z^3*(1-z)", 1.5),
    "diabolo": ("x^2-(y^2+z^2)^2", 1.5),
    "dromedar": ("x^4-3*x^2+y^2+z^3", 1.5),
    "columpius": ("x^3*y+x*z^3+y^3*z+z^3+7*z^2+5*z", 1.5),
    "octdong": ("x^2+y^2+z^4-z^2", 1.5),
    "schneeflocke": ("x^3+y^2*z^3+y*z^4", 1.5),
    "kreisel": ("60*(x^2+y^2)*z^4-(60-x^2-y^2-z^2)^3", 9),
    "vierblatt": ("(x^2+y^2)^3-(x^2-y^2)^2*(1-z^2)", 1.5),
    "clebsch": (
        "81*(x^3+y^3+z^3)-189*(x^2*y+x^2*z+y^2*x+y^2*z+z^2*x+z^2*y)"
        "+54*x*y*z+126*(x*y+x*z+y*z)-9*(x^2+y^2+z^2)-9*(x+y+z)+1",
        1.5,
    ),
    "togliatti_like": ("x^2*y^2+y^2*z^2+z^2*x^2-3*x*y*z", 1.5),
    "crosscap": ("4*x^2*(x^2+y^2+z^2+z)+y^2*(y^2+z^2-1)", 1.5),
    "cushion": ("z^2*x^2-z^4-2*z*x^2+2*z^3+x^2-z^2-(x^2-z)^2-y^4-2*x^2*y^2-y^2*z^2+2*y^2*z+y^2", 1.5),
    "bifolia": ("(x^2+y^2+z^2)^2-3*y*(x^2+z^2)", 1.5),
    "tooth": ("x^4+y^4+z^4-x^2-y^2-z^2", 1.5),
    "chmutov4": ("8*(x^4+y^4+z^4)-8*(x^2+y^2+z^2)+3", 1.5),
    "endrass_like": ("64*(x^2-1)*(y^2-1)*((x+y)^2-2)*((x-y)^2-2)-(z^2-1)^2*100", 2),
    "cyl3": ("(x^2+y^2-1)*(y^2+z^2-1)*(z^2+x^2-1)", 1.8),
    "viviani": ("(x^2+y^2+z^2-4)*((x-1)^2+y^2-1)", 2.5),
    "monkey": ("x^3-3*x*y^2-z", 1.5),
    "tangentdev": ("(x*y-z)^2-4*(x^2-y)*(y^2-x*z)", 1.5),
    "catalan_like": ("x^4-(x^2-y^2)*z^2", 1.5),
}
"""Formulas, and the radii of the balls they are looked at in."""


def table(resolution: int = 40, names: tuple[str, ...] = tuple(SURFACES)) -> str:
    """CPU seconds, with the singular set; "smooth" where there was nothing to list."""
    rows = []
    for name in names:
        formula, radius = SURFACES[name]
        start = time.process_time()
        mesh = polygonize(Surface(formula), Ball(radius), resolution=resolution)
        listed = "smooth" if mesh.unresolved is None else str(len(mesh.unresolved))
        rows.append([name, str(len(mesh.faces)), listed, f"{time.process_time() - start:.1f}"])
    return markdown(["surface", "triangles", "listed", "seconds"], rows)
