"""Flat sheets on simple surfaces seen by a camera: mock-ups, and the rectification of photographs.

surfaces  the plane, cylinders, cones and spheres, on which a sheet lies
camera    pinhole cameras
view      a surface seen by a camera, as a map from the sheet to the picture
marked    views found from points marked on a photograph
method    the map between two views, or between a view and a flat sheet, in closed form
"""
