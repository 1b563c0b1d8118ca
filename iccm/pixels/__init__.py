"""Pictures: preimages of pixels, texture filters, color encodings, and pixels outside the map.

thumbnail               pictures for notebooks
warp                    warp a texture by a map: inverse, filter, coverage
texture                 a picture placed in the plane
canvas                  a raster in the plane, and bands of its rows
preimages               source points of a canvas's pixels
triangulated_preimages  the same for triangulated maps: scanline rasterization of patches
composed                several maps as one, mirrored maps, and maps with holes
sampler                 a texture prepared for filtering; encoding of the results
colour                  linear light, premultiplied alpha, and back
pyramid                 mip levels of a picture, spline coefficients
filters                 anisotropic kernels that read pyramids
normals                 tangent-space normals that rotate with a map
coverage                exact coverage of pixels by outlines
raster                  distance transforms, morphology, resampling, connected components
padding                 colours beyond the outline
own_edge                textures whose alpha ends at the outline
paper                   a background colour for drawings used as textures
stmap                   maps stored as pictures
checkerboard            a test picture of numbered cells
"""
