"""Whole drawings: everything that a file paints, as one region of the plane.

drawing         the region, its parts and holes
region          queries whether points are painted
frame           simply connected regions around a drawing, with gaps closed to several degrees
mappable_holes  holes that leave room for a map
placing         the largest similar copy of one region inside another
pairing         pairs of corresponding parts of two drawings
cracks          slits of a result that look like defects
visible         what is visible of two drawings
cost            the one cost by which maps are compared
detail          detail of a picture: the edges that people recognise it by
intermediate    the drawing between two drawings in the same plane: parts and holes grow and shrink, and nothing fades
faces           faces in photos: people see every bend of them, so they count more than other detail, and are hardly…
"""
