"""Deformations by pins and strokes, without a target: the balanced energy with a free outline.

mesh       a mesh of the shape, with constraints as vertices and edges
method     the deformation: a similarity, then a coarse and a fine mesh
"""
