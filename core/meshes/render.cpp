// Depth buffer of a parallel projection.
#include "iccm/core.h"

namespace iccm {
namespace {

double least(double a, double b, double c) { return min(min(a, b), c); }
double greatest(double a, double b, double c) { return max(max(a, b), c); }

}  // namespace
}  // namespace iccm

using namespace iccm;

// Find the triangle nearest to the viewer at each sample.
//
//   corners  (m, 3, 2) corners in samples, x right, y down, centres at half-integers; either orientation
//   slopes   (m, 3) coefficients of 1, x and y in each triangle's depth; larger is nearer
//   owner    (height, width) triangle at each sample, written; unchanged where there is none
//   depth    (height, width) depth of the nearest triangle so far; changed
ICCM_EXPORT int64_t iccm_meshes_nearest(const double *corners, const double *slopes, int64_t m, int32_t *owner,
                                        float *depth, int64_t height, int64_t width) {
    for (Index t = 0; t < m; t++, corners += 6, slopes += 3) {
        const double *c = corners;
        const double area = (c[2] - c[0]) * (c[5] - c[1]) - (c[3] - c[1]) * (c[4] - c[0]);
        if (area == 0) continue;
        const Index x0 = max(Index(0), Index(floor(least(c[0], c[2], c[4]) - 0.5)));
        const Index x1 = min(width - 1, Index(ceil(greatest(c[0], c[2], c[4]) - 0.5)));
        const Index y0 = max(Index(0), Index(floor(least(c[1], c[3], c[5]) - 0.5)));
        const Index y1 = min(height - 1, Index(ceil(greatest(c[1], c[3], c[5]) - 0.5)));
        for (Index y = y0; y <= y1; y++)
            for (Index x = x0; x <= x1; x++) {
                const double u = double(x) + 0.5, v = double(y) + 0.5;
                bool inside = true;
                for (int k = 0; k < 3 && inside; k++) {
                    const double *p = c + 2 * k, *q = c + 2 * ((k + 1) % 3);
                    const double e = (q[0] - p[0]) * (v - p[1]) - (q[1] - p[1]) * (u - p[0]);
                    inside = !(e * area < 0);
                }
                if (!inside) continue;
                const double near = slopes[0] + slopes[1] * u + slopes[2] * v;
                if (near > double(depth[y * width + x])) {
                    depth[y * width + x] = float(near);
                    owner[y * width + x] = int32_t(t);
                }
            }
    }
    return 0;
}
