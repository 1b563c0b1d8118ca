"""Sparse symmetric systems over the vertices of meshes, by multifrontal factorisation.

ordering            a minimum degree order of a mesh's vertices, and the pattern of the factor
fronts              columns of the factor gathered into dense blocks
cholesky            the factor of 2 × 2 blocks, and solving with it
nested_dissection   Hermitian systems of large surfaces, ordered by nested dissection
"""
