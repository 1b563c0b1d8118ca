// Exact coverage of pixels by closed polylines: signed areas are accumulated along rows, as in font rasterisers
// (Levien, font-rs, 2016), but in double precision and one row at a time.
#include "iccm/core.h"

namespace iccm {
namespace {

// Error of a pixel's area that is removed: far above rounding, far below a byte.
constexpr double NOTHING = 1e-6;

// Add a piece of a segment within one row, from x0 to x1 >= x0, to the differences `area`, whose running sum is the
// area of each pixel to the right of the polylines: pixels left of the piece get nothing, those right of it all of
// `height`.
void spread(double *area, double x0, double x1, double height, Index width) {
    if (x1 <= 0) {
        area[0] += height;
        return;
    }
    if (x0 >= double(width)) return;
    const double low = max(x0, 0.0), high = min(x1, double(width));
    if (x1 - x0 < 1e-12) {  // vertical: dividing by the width would lose all digits
        const Index j = min(Index(low), width - 1);
        const double part = height * (double(j + 1) - low);
        area[j] += part;
        area[j + 1] += height - part;
        return;
    }
    const double density = height / (x1 - x0);
    area[0] += density * (low - x0);
    double before = 0;  // this piece's contribution to the previous pixel
    const Index stop = min(Index(ceil(high)), width);
    for (Index j = Index(low); j < stop; j++) {
        const double left = max(low, double(j)), right = min(high, double(j + 1));
        const double passed = density * (right - low);
        // the part of the pixel's square right of the piece, a trapezium, and all that is right of earlier parts
        const double part =
            density * (right - left) * (double(j + 1) - 0.5 * (left + right)) + density * (left - low);
        area[j] += part - before;
        before = part;
        if (double(j + 1) >= high) {
            area[j + 1] += passed - before;
            before = passed;
        }
    }
}

// Add the segment from a to b, a being the end with smaller y, to row i: to the signed area, and to the winding number
// of the pixels' centres.
void add(Complex a, Complex b, double sign, Index i, double *area, int64_t *windings, Index width) {
    const double slope = (b.re - a.re) / (b.im - a.im), row = double(i);
    const double y0 = max(a.im, row), y1 = min(b.im, row + 1.0);
    if (a.im <= row + 0.5 && row + 0.5 < b.im) {
        const double x = a.re + (row + 0.5 - a.im) * slope;
        // clamped before the conversion to an integer, which cannot represent every double
        windings[Index(min(max(ceil(x - 0.5), 0.0), double(width)))] += int64_t(sign);
    }
    if (y1 > y0) {
        const double x0 = a.re + (y0 - a.im) * slope, x1 = a.re + (y1 - a.im) * slope;
        spread(area, min(x0, x1), max(x0, x1), sign * (y1 - y0), width);
    }
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Compute how much of each pixel is covered by closed polylines, and whether they surround its centre. Row by row, so
// that the sums stay in the processor's cache.
//
//   low, high    (count,) ends of the segments with smaller and larger y, in pixel units, y down; no segment is
//                horizontal
//   sign         (count,) 1 for segments that run from `low` to `high`, else -1
//   covered      (rows, width) written: covered area of each pixel, the absolute mean of the winding number, at most 1
//   inside       (rows, width) written if `winding`: whether the winding number of the centre is nonzero
ICCM_EXPORT int64_t iccm_pixels_cover(const Complex *low, const Complex *high, const double *sign, int64_t count,
                                      int64_t rows, int64_t width, float *covered, bool *inside, bool winding) {
    Buffer<double> area(width + 2, 0.0);     // differences of the signed area along a row
    Buffer<int64_t> windings(width + 1, 0);  // differences of the centres' winding number
    if (!area || !windings) return OUT_OF_MEMORY;
    for (Index i = 0; i < rows; i++) {
        for (Index s = 0; s < count; s++)
            if (high[s].im >= double(i) && low[s].im < double(i + 1))
                add(low[s], high[s], sign[s], i, area.data, windings.data, width);
        double total = 0, value = 0;
        int64_t number = 0;
        for (Index j = 0; j < width; j++) {
            if (area[j] != 0 || windings[j] != 0) {
                total += area[j];
                number += windings[j];
                area[j] = 0, windings[j] = 0;
                value = fabs(total);
                value = value < NOTHING ? 0.0 : (value > 1 - NOTHING ? 1.0 : value);
            }
            covered[i * width + j] = float(value);
            if (winding) inside[i * width + j] = number != 0;
        }
        area[width] = 0, area[width + 1] = 0, windings[width] = 0;
    }
    return 0;
}
