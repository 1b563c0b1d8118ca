"""The search for a good map: candidates on coarse meshes, the best of them refined, constraints met on the way.

multilevel              the stages of a solve, from coarse maps to the final mesh
unit_problem            the problem in unit coordinates
levels                  one level of outlines and mesh size
initial_matches         correspondences of two outlines: elastic matches, and arclength with shifts
hole_partners           which hole goes to which
via_disc                coarse maps by way of a disc, for spirals and shapes with many teeth
circle_domains          coarse maps by way of discs with round holes, for shapes with several holes
candidates              the best of many coarse maps
partial                 concavities filled and holes ignored, and what that costs
homotopy, grid_paths    ways of constrained points to their goals
pin_continuation        pins brought to their goals, mesh by mesh
warm_start              an earlier map continued from
rounding                outlines on a grid, so that noise chooses nothing
similarity, symmetry    similar shapes, and halves of symmetric ones
final_mesh              the fine mesh and the final one, its worst stretch lowered
"""
