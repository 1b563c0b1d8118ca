// Location of points in a picture.
#include "pixels/texture.h"

using namespace iccm;

// Compute texel coordinates of points in a picture that lies in the plane.
//
//   z            (count,) points
//   right, down  (count,) their derivatives with respect to the output's x and y
//   corner       (4,) see Corner
//   xy, jacobian (count, 2) and (count, 4) written: texel coordinates and their derivatives, in the order of Place
ICCM_EXPORT int64_t iccm_pixels_place(const Complex *z, const Complex *right, const Complex *down, int64_t count,
                                      const double *corner, double *xy, double *jacobian) {
    const Corner at = {corner[0], corner[1], corner[2], corner[3]};
    for (Index i = 0; i < count; i++) {
        const Place found = place(z[i], right[i], down[i], at);
        xy[2 * i] = found.x, xy[2 * i + 1] = found.y;
        double *j = jacobian + 4 * i;
        j[0] = found.xx, j[1] = found.xy, j[2] = found.yx, j[3] = found.yy;
    }
    return 0;
}
