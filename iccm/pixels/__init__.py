"""Pictures: where pixels come from, how texels are filtered, what is written where nothing is covered.

thumbnail               pictures as notebooks show them
warp                    a texture carried through a map: inverse, filter, coverage
texture                 a picture with its place in the plane
canvas                  a raster in the plane, and bands of its rows
preimages               source points of a canvas's pixels
triangulated_preimages  those of triangulated maps: scanlines over patches
composed                maps made of several parts, and with holes
sampler                 a texture ready to be filtered; stored pixels again
colour                  linear light, premultiplied, and back
pyramid                 reductions of a picture, coefficients of its spline
filters                 stretched kernels that read it
normals                 normals that turn with a map
coverage                exact coverage of pixels by outlines
raster                  distances, neighbourhoods, other resolutions, connected pieces
padding                 colours beyond the outline
own_edge                textures whose own edge is the outline
paper                   a colour below drawings that are textures
stmap                   maps as pictures
checkerboard            a test picture of numbered cells
"""
