// Affine functions of triangles at the texels of a layout.
#include "iccm/core.h"

namespace iccm {
namespace {

// Coordinate x, shifted by multiples of `size` unless it lies between three others or within half a texel of them.
double beside(double a, double b, double c, double x, double size) {
    const double low = min(min(a, b), c) - 0.5, high = max(max(a, b), c) + 0.5;
    if (x < low) return x + size * ceil((low - x) / size);
    if (x > high) return x - size * ceil((x - high) / size);
    return x;
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Evaluate one affine function per triangle at the texels that the triangle owns; texels that wrapped around to the
// other side of the layout are shifted back.
//
//   coefficients  (m, 3) coefficients of 1, x and y
//   corners       (m, 3, 2) corners in texels
//   owner         (count,) triangle that owns each texel
//   at            (count,) indices of the texels, row by row, from row `first` on
//   height, width size of the layout
//   z, zx, zy     (count,) written: the function, and its derivatives with respect to x and y
ICCM_EXPORT int64_t iccm_meshes_evaluate(const Complex *coefficients, const double *corners, const int32_t *owner,
                                         const int64_t *at, int64_t count, int64_t first, int64_t height, int64_t width,
                                         Complex *z, Complex *zx, Complex *zy) {
    for (Index i = 0; i < count; i++) {
        const Complex *k = coefficients + 3 * owner[i];
        const double *c = corners + 6 * owner[i];
        const Index row = at[i] / width, column = at[i] - row * width;
        const double x = beside(c[0], c[2], c[4], double(column) + 0.5, double(width));
        const double y = beside(c[1], c[3], c[5], double(first + row) + 0.5, double(height));
        zx[i] = k[1], zy[i] = k[2];
        z[i] = k[0] + k[1] * x + k[2] * y;
    }
    return 0;
}
