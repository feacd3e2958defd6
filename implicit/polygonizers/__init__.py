"""Ways from a surface to a mesh."""
