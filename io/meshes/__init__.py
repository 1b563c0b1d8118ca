"""Mesh files: all formats are read into arrays; OBJ, PLY and glTF files are written back otherwise unchanged.

mesh_files        read and write meshes of any format
mesh_format       interface of a format
obj_format        OBJ with material libraries
ply_format        PLY
gltf_format       glTF and GLB
off_stl_formats   OFF and STL
overlays          numbers and labels at the vertices of a surface
embedding         pictures as stored in mesh files
obj               OBJ files with all their bytes
obj_scan          the compiled loops that parse them
obj_write         new texture coordinates for OBJ
obj_materials     materials of OBJ faces, and their libraries
material_library  MTL files with all their lines
ply               PLY files with all their properties
ply_write         new texture coordinates for PLY
gltf              JSON, buffers and accessors of glTF, and GLB
gltf_schema       validation of glTF
gltf_compressed   decompression of Draco and meshopt
gltf_materials    textures of a glTF material
gltf_write        new texture coordinates and pictures for glTF
splitting         vertices split at seams
odd_forms         triangle strips, and unusual OFF files
"""
