"""Where lines and triangles are looked at, as parts of them from 0 to 1.

Lines are halved again and again, and a wave that fits into one of them is 0 at every dyadic point of it. So the samples
are irrational but for the middles, and where there are many their steps are unequal: no wave has one phase at all.
"""

import numpy as np

ALONG = 0.5 + np.array([-1, 0, 1]) * (3**0.5 / 6)
"""The middle, and where a cubic that crosses its chord there is farthest from the chord."""

CLOSELY = (1 - np.cos((np.arange(16) + 0.5) * (np.pi / 16))) / 2
"""Chebyshev's points, closer to the ends, where a curve that swings beyond them is seen."""

ENDS_AND_BETWEEN = (1 - np.cos(np.arange(17) * (np.pi / 16))) / 2
"""The same with both ends."""

_GOLDEN = (5**0.5 - 1) / 2
INSIDE = np.where(np.eye(4, 3, -1) > 0, _GOLDEN, (1 - _GOLDEN) / 2)
INSIDE[0] = 1 / 3
"""Barycentric coordinates of the middle of a triangle and of a point towards each corner."""
