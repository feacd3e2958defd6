"""Named surfaces with their facts, one page of pictures, and the command line."""

import implicit

if getattr(implicit, "__dist__", None) != "implicit-parametric":
    raise ImportError(
        f"`gallery` needs the package `implicit` of the distribution implicit-parametric, but Python found "
        f"another one at {implicit.__file__}. Install implicit-parametric in a fresh environment."
    )
