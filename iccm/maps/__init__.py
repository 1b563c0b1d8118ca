"""Maps between planar domains, harmonic and triangulated: evaluation, inverse, boundary image and injectivity.

A kind of map is a class with these methods; z is in the source's plane, w in the target's, arrays are complex and (p,):

- `map(z)` and `derivatives(z)`: f, and its f_z and f_z̄. `jet(z, threads)` gives all three at once.
- `extended_inverse(w, threads)`: preimages, where the nearest point of the boundary's image stands for a point outside,
  and how far outside each lay (`extended_inverse.Invertible`; `ExtendedInverse` keeps count).
- `preimages(canvas, tolerance, slopes)`: the source points of a canvas's pixels, band by band
  (`iccm.pixels.preimages.Mapping`; `preimages.of` asks for them).
- its boundary image: `boundary_image.BoundaryImage`, closed polylines with their preimages.
- its injectivity: `injectivity.Certificate`, what was proven.

A harmonic map is bare coefficients: `Evaluator` makes it fast to evaluate, `Inverse` to invert, and whoever takes maps
of every kind (`ExtendedInverse`, `preimages.of`) makes these from it; another kind is asked for its own methods.

kinds             the kinds of maps, and what each is asked for
harmonic          harmonic maps by their coefficients; dilatation and scale
cauchy_green      the coordinates of the paper and their derivatives
evaluate          fast evaluation at many points
quadtree          the tree of local expansions behind it
inverse           Newton's method from seeds that the map suggests
chebyshev         polynomials for the inverse on square tiles
extended_inverse  preimages of points in the image and just outside
boundary_image    the image of the boundary, as finely as asked
injectivity       a certificate that a harmonic map is one-to-one
enclosure         derivatives and the image of a curve enclosed, for certificates
triangulated/     maps given by two triangulations
bounds            bounds on stretch and dilatation of triangulated maps
distortion        figures of distortion, over the target's area
bezier_fit        curves carried through a map, as cubic Béziers
"""
