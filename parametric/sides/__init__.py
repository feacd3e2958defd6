"""On which side of a shell a point lies, found without a mesh."""
