// Painting of a band of pixels as sRGB bytes: pixels are located, filtered and encoded a row at a time, which stays in
// the processor's first-level cache.
#include "pixels/colour.h"
#include "pixels/filters.h"
#include "pixels/texture.h"

namespace iccm {
namespace {

// A band of pixels as in iccm.pixels.canvas.Band, and which of its columns are painted.
struct Band {
    const Complex *z;
    const Complex64 *right, *down;
    const float *covered;
    Index rows, width, first, last;
};

// Convert the filtered values of one pixel to stored bytes, unpremultiplied, with alpha times the coverage; `alpha` is
// c if alpha is appended.
void encode(const float *values, Index c, Index alpha, float covered, const ByteEdges &table, uint8_t *out) {
    float share = covered, opacity = 1;
    if (alpha < c) {
        opacity = values[alpha];
        share *= opacity;
        if (opacity == 0) opacity = 1;
    }
    for (Index k = 0; k < c; k++)
        if (k != alpha) out[k] = srgb_byte(values[k] / opacity, table);
    out[alpha] = linear_byte(share);
}

template <typename Stored>
Index paint(const Pyramid &picture, const Band &band, const Corner &corner, Kernel kernel, bool clamped, Index alpha,
            const ByteEdges &table, uint8_t *out) {
    const Index c = picture.channels, stride = max(c, alpha + 1), most = band.last - band.first;
    Filter<Stored> filter(picture, kernel, clamped);
    Buffer<Index> columns(most);
    Buffer<double> xy(2 * most), jacobian(4 * most);
    Buffer<float> values(most * c + LANES);
    if (!filter || !columns || !xy || !jacobian || !values) return OUT_OF_MEMORY;
    Index done = 0;
    for (Index i = 0; i < band.rows; i++) {
        const Index row = i * band.width;
        Index count = 0;
        for (Index j = band.first; j < band.last; j++) {
            if (band.covered[row + j] == 0) continue;
            const Place at = place(band.z[row + j], band.right[row + j], band.down[row + j], corner);
            double *point = &xy[2 * count], *steps = &jacobian[4 * count];
            point[0] = at.x, point[1] = at.y;
            steps[0] = at.xx, steps[1] = at.xy, steps[2] = at.yx, steps[3] = at.yy;
            columns[count++] = j;
        }
        filter.values(xy.data, jacobian.data, count, values.data);
        if (!filter.complete()) continue;
        done++;
        for (Index n = 0; n < count; n++) {
            const Index at = row + columns[n];
            encode(&values[n * c], c, alpha, band.covered[at], table, out + at * stride);
        }
    }
    return done;
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Paint the covered pixels of a band as sRGB bytes, in columns first .. last - 1.
//
//   z, right, down, covered  (rows, width) as in iccm.pixels.canvas.Band
//   corner        (4,) position and scale of the picture, see Corner
//   kernel        see Kernel
//   clamped       as for iccm_pixels_filter
//   alpha         index of the alpha channel; c to append one
//   edges, start  see ByteEdges
//   out           (rows, width, c), or one more channel; covered pixels are written
//
// Returns the number of rows before the first that wants rows of the picture which are absent; from there on
// nothing is painted.
ICCM_EXPORT int64_t iccm_pixels_paint(const Pyramid *picture, const Complex *z, const Complex64 *right,
                                      const Complex64 *down, const float *covered, int64_t rows, int64_t width,
                                      int64_t first, int64_t last, const double *corner, int64_t kernel, bool clamped,
                                      int64_t alpha, const double *edges, const uint8_t *start, uint8_t *out) {
    const Band band = {z, right, down, covered, rows, width, first, last};
    const Corner at = {corner[0], corner[1], corner[2], corner[3]};
    const ByteEdges table = {edges, start};
    switch (picture->base_bytes) {
        case 1: return paint<uint8_t>(*picture, band, at, Kernel(kernel), clamped, alpha, table, out);
        case 2: return paint<uint16_t>(*picture, band, at, Kernel(kernel), clamped, alpha, table, out);
        default: return paint<float>(*picture, band, at, Kernel(kernel), clamped, alpha, table, out);
    }
}
