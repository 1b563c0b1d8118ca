"""The search for a good map: candidates on coarse meshes, of which the best are refined.

multilevel              the stages of a solve, from coarse maps to the final mesh
unit_problem            the problem in unit coordinates
levels                  one level of outlines and mesh size
initial_matches         correspondences of two outlines: elastic matches, and arclength with shifts
hole_partners           assignment of holes to holes
candidates              the best of many coarse maps
partial                 maps with filled concavities, and the cost of maps of outlines
homotopy, grid_paths    paths of constrained points to their goals
pin_continuation        pins moved to their goals, mesh by mesh
warm_start              start from an earlier map
rounding                outlines on a grid, so that noise does not change decisions
similarity, symmetry    similar shapes, and halves of symmetric shapes
final_mesh              the fine mesh, the final mesh, and bounds on the distortion
"""
