"""What materials of meshes show: pictures read from GLB and MTL files, carried to new coordinates, and written."""
