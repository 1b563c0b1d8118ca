"""The search for a good map: candidates on coarse meshes, of which the best are refined.

multilevel              the stages of a solve, from coarse maps to the final mesh
unit_problem            the problem in unit coordinates
levels                  one level of outlines and mesh size
initial_matches         correspondences of two outlines: elastic matches, and arclength with shifts
hole_partners           assignment of holes to holes
via_disc                coarse maps composed of maps to a disc, for spirals and shapes with many teeth
circle_domains          coarse maps composed of maps to discs with round holes, for shapes with several holes
candidates              the best of many coarse maps
partial                 concavities filled and holes ignored, and the cost of that
homotopy, grid_paths    paths of constrained points to their goals
pin_continuation        pins moved to their goals, mesh by mesh
warm_start              start from an earlier map
rounding                outlines on a grid, so that noise does not change decisions
similarity, symmetry    similar shapes, and halves of symmetric shapes
final_mesh              the fine mesh, the final mesh, and bounds on the distortion
"""
