// Location of points of the plane in a flat mesh.
#include "iccm/locate.h"

using namespace iccm;

// Walk from triangle to triangle to each of several points (iccm/locate.h).
//
//   flat       (n,) vertices
//   faces      (m, 3) triangles, counter-clockwise
//   twin       (3m,) the half-edge beyond each one, negative on a border
//   z          (count,) points
//   start      (count,) triangle at which each walk begins
//   triangle   (count,) written
//   weights    (count, 3) written: barycentric coordinates there
ICCM_EXPORT int64_t iccm_meshes_walk(const Complex *flat, const int64_t *faces, const int64_t *twin, const Complex *z,
                                     const int32_t *start, int64_t count, int64_t *triangle, double *weights) {
    for (Index i = 0; i < count; i++) triangle[i] = walk_to(flat, faces, twin, z[i], start[i], weights + 3 * i);
    return 0;
}
