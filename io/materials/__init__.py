"""Materials of meshes: pictures of GLB and MTL files, transferred to new texture coordinates, and written.

material_set     materials of a mesh: triangles, materials, pictures
of_gltf          material sets of glTF files
of_mtl           material sets of OBJ files with libraries
carried          pictures baked for new coordinates
carried_maps     `--carry-maps`: a mesh's other pictures
relaid           a mesh with another mesh's materials
translate        conversion between glTF and MTL materials
gltf_assignment  new materials for a glTF file
written          output files of a mesh with transferred materials
"""
