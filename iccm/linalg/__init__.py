"""Sparse symmetric systems over the vertices of meshes, by multifrontal factorisation.

ordering            a minimum degree order of a mesh's vertices, and the pattern of the factor
fronts              dense blocks of columns of the factor
cholesky            real systems of 2 × 2 blocks, factored in each Newton step
nested_dissection   an elimination order for large surfaces
hermitian           complex systems of large surfaces, solved once
"""
