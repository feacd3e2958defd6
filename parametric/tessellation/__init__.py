"""How a shell becomes triangles: first cells, refinement, and proofs of the tolerance."""
