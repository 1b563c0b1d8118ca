"""Meshes in files: every format read into arrays, OBJ, PLY and glTF kept as they are but for what changes.

mesh_files        meshes from files of every format, and back
mesh_format       what a format is asked
obj_format        OBJ, with its material libraries
ply_format        PLY
gltf_format       glTF and GLB
off_stl_formats   OFF and STL
embedding         pictures as meshes hold them
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
