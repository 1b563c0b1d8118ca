// The inverse of a triangulated map at the centres of pixels: scanlines over quadratic patches.
#include "pixels/texture.h"

namespace iccm {
namespace {

enum State : uint8_t { EMPTY = 0, FILLED = 1, TOUCHED = 2 };

// The pixels first .. last - 1 of a row.
struct Span {
    Index first, last;
};

// The pixels on the line at y whose centres, at integers, lie in a triangle. The intersection of the line with a side
// is computed the same way for both triangles of the side, so that the spans of neighbours abut and each centre belongs
// to one.
Span span(const Complex *corners, double y, Index width) {
    double low = INFINITY, high = -INFINITY;
    for (int k = 0; k < 3; k++) {
        Complex p = corners[k], q = corners[k == 2 ? 0 : k + 1];
        if (p.im > q.im) swap(p, q);
        if (p.im <= y && y < q.im) {
            const double x = p.re + (y - p.im) * ((q.re - p.re) / (q.im - p.im));
            low = min(low, x), high = max(high, x);
        }
    }
    if (!(low <= high)) return {0, 0};
    return {Index(ceil(min(max(low, 0.0), double(width)))), Index(ceil(max(min(high, double(width)), 0.0)))};
}

// Coefficients of 1, x, y, x², xy, y² of a patch, x and y being relative to its first corner.
struct Quadratic {
    Complex one, x, y, xx, xy, yy;
};

// A patch along a row of pixels: a + b x + c x². Its derivatives with respect to x and y are b + 2 c x
// and d + e x.
class Row {
  public:
    Row(const Quadratic &patch, double y)
        : a(patch.one + y * (patch.y + y * patch.yy)),
          b(patch.x + y * patch.xy),
          c(patch.xx),
          d(patch.y + 2 * y * patch.yy),
          e(patch.xy) {}

    void points(double start, Index count, Complex *z) const {
        for (Index j = 0; j < count; j++) {
            const double x = start + double(j);
            z[j] = {a.re + x * (b.re + x * c.re), a.im + x * (b.im + x * c.im)};
        }
    }

    void slopes(double start, Index count, Complex64 *right, Complex64 *down) const {
        for (Index j = 0; j < count; j++) {
            const double x = start + double(j);
            right[j] = {float(b.re + 2 * x * c.re), float(b.im + 2 * x * c.im)};
            down[j] = {float(d.re + x * e.re), float(d.im + x * e.im)};
        }
    }

  private:
    Complex a, b, c, d, e;
};

}  // namespace
}  // namespace iccm

using namespace iccm;

// Compute the preimages of the pixels whose centres lie in triangles; NaN elsewhere. Row by row, since a band is larger
// than the processor's cache.
//
//   corners      (m, 3) corners of all triangles, pixel centres at integers
//   powers       (m, 6) the triangles' patches, see Quadratic
//   chosen       (count,) the triangles that may touch the band; later ones are drawn over earlier ones
//   reach        (count, 2) their least and greatest y
//   row          the first row of the band
//   covered      (rows, width) covered area of each pixel
//   z            (rows, width) written: preimages
//   right, down  (rows, width) written if `slopes`: derivatives of z with respect to x and y
//   state        (rows, width) EMPTY; becomes FILLED, or TOUCHED where a pixel is covered but its centre is outside
//
// Returns the number of FILLED pixels.
ICCM_EXPORT int64_t iccm_pixels_fill(const Complex *corners, const Complex *powers, const int64_t *chosen,
                                     const double *reach, int64_t count, int64_t row, int64_t rows, int64_t width,
                                     const float *covered, Complex *z, Complex64 *right, Complex64 *down, bool slopes,
                                     uint8_t *state) {
    Index filled = 0;
    for (Index i = 0; i < rows; i++, covered += width, z += width, state += width) {
        const double line = double(i + row);
        for (Index n = 0; n < count; n++) {
            if (!(reach[2 * n] <= line && line < reach[2 * n + 1])) continue;
            const Complex *triangle = corners + 3 * chosen[n];
            const Span pixels = span(triangle, line, width);
            if (pixels.first >= pixels.last) continue;
            const Row patch(reinterpret_cast<const Quadratic *>(powers)[chosen[n]], line - triangle[0].im);
            const double start = double(pixels.first) - triangle[0].re;
            const Index length = pixels.last - pixels.first;
            patch.points(start, length, z + pixels.first);
            if (slopes) patch.slopes(start, length, right + pixels.first, down + pixels.first);
            memset(state + pixels.first, FILLED, size_t(length));
        }
        for (Index j = 0; j < width; j++) {
            if (state[j] == FILLED) {
                filled++;
                continue;
            }
            z[j] = {NAN, NAN};
            if (slopes) right[j] = down[j] = {NAN, NAN};
            if (covered[j] > 0) state[j] = TOUCHED;
        }
        if (slopes) right += width, down += width;
    }
    return filled;
}
