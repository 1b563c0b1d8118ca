"""Triangle meshes: topology, patches, cuts, flattening, and textures baked into their layouts."""
