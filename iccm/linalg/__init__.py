"""Sparse symmetric systems over the vertices of meshes, by multifrontal factorisation.

ordering            a minimum degree order of a mesh's vertices, and the pattern of the factor
fronts              columns of the factor gathered into dense blocks
cholesky            real systems of 2 × 2 blocks, factored once a Newton step
nested_dissection   an order for large surfaces
hermitian           complex systems of large surfaces, solved once
"""
