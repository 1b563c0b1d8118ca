"""Cartograms: maps in which each region has a prescribed area.

mesh    a triangulation that has the regions' borders as edges
areas   Newton's method with areas as constraints
method  from regions and values to a map
"""
