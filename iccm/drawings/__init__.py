"""Whole drawings: everything that a file paints, as one region of the plane.

drawing         the region, its parts and holes
region          queries whether points are painted
frame           simply connected regions around a drawing, with gaps closed to several degrees
mappable_holes  holes that leave room for a map
placing         the largest similar copy of one region inside another
pairing         pairs of corresponding parts of two drawings
raster          regions on a raster of pixels
cracks          slits of a result that look like defects
seen            energy and losses of a map of two drawings
cost            the cost by which maps are compared
"""
