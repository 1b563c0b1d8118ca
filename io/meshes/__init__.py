"""Meshes in files: every format read into arrays, OBJ kept line by line.

mesh_files        meshes from files of every format, and back
size_limits       how large a mesh is, before memory is taken for it
obj_source        an OBJ file opened once
obj               OBJ files that keep their bytes
obj_scan          the compiled loops that read them
obj_write         new texture coordinates for one
obj_materials     materials of its faces, and its libraries
material_library  MTL files that keep their lines
ply               PLY files that keep what they hold
ply_write         new texture coordinates for one
gltf              glTF's tree, buffers and accessors, and GLB
gltf_schema       what readers of glTF rely on, checked
gltf_compressed   what Draco or meshopt compressed, as it was
gltf_materials    textures of a glTF material
gltf_write        new texture coordinates and pictures for a glTF file
splitting         vertices split where coordinates part
odd_forms         triangle strips, and OFF files without line breaks
"""
