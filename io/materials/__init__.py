"""Materials of meshes: pictures read from GLB and MTL files, carried to new coordinates, and written."""
