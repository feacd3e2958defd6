"""On which side a point lies: certified signs, proofs of nearness, winding numbers of meshes."""
