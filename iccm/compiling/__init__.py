"""Numba's compiler with less to do, and how long compiling takes.

pipeline   the compiler's passes that are left out, and its cache
shortcuts  what the compiler repeats, done once for each kernel
watch      when compiling begins, and how long it takes
"""
