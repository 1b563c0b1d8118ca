"""The energy and its minimisation: projected Newton on sparse LDLᵀ, boundary vertices sliding, nothing ever folding."""
