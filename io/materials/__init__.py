"""Materials of meshes: pictures read from GLB and MTL files, carried to new coordinates, and written.

material_set     what a mesh shows: triangles, materials, pictures
of_gltf          those of glTF files
of_mtl           those of OBJ files with libraries
carried          pictures carried to new coordinates
carried_maps     `--carry-maps`: a mesh's other pictures
relaid           a mesh with another mesh's materials
translate        glTF's materials as MTL's, and back
gltf_assignment  new materials for a glTF file
written          the mesh with carried materials as files
"""
