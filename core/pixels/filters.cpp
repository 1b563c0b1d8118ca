// Filters at scattered points: nearest texel, stretched kernels, quintic spline.
#include "pixels/filters.h"

namespace iccm {
namespace {

constexpr Index FRAME = 12;    // texels around a spline's coefficients
constexpr double BLEND = 1.5;  // the spline is blended into the cubic for footprints from one texel to this

template <typename Stored>
Index nearest(const Pyramid &picture, const double *xy, Index count, float *out) {
    Index done = 0;
    const Index w = picture.level(0).width, h = picture.level(0).height, c = picture.channels;
    for (Index n = 0; n < count; n++, xy += 2, out += c) {
        Index i = round_down(xy[1]), j = round_down(xy[0]);
        const bool nowhere = picture.outside() == Edge::clear && (i < 0 || j < 0 || i >= h || j >= w);
        i = inside(i, h, picture.outside()), j = inside(j, w, picture.outside());
        const bool has_row = picture.has(picture.level(0), i, i);
        for (Index k = 0; k < c; k++) out[k] = nowhere || !has_row ? 0.0f : ready<Stored>(picture, i, j, k);
        if (has_row && done == n) done++;
    }
    return done;
}

template <typename Stored>
Index filter(const Pyramid &picture, const double *xy, const double *jacobian, Index count, Kernel kernel, bool clamped,
             float *out) {
    Filter<Stored> filter(picture, kernel, clamped);
    if (!filter) return OUT_OF_MEMORY;
    return filter.values(xy, jacobian, count, out);
}

// The six quintic B-splines that reach t in [0, 1) after the third knot (Unser, Splines: a perfect fit, 1999).
void quintic(double t, double *weights) {
    for (int k = 0; k < 6; k++) {
        const double x = fabs(t + 2 - k), y = 3 - x;
        if (x < 1)
            weights[k] = (66 - x * x * (60 - x * x * (30 - 10 * x))) / 120;
        else if (x < 2)
            weights[k] = (51 + x * (75 - x * (210 - x * (150 - x * (45 - 5 * x))))) / 120;
        else
            weights[k] = x < 3 ? y * y * y * y * y / 120 : 0;
    }
}

// Evaluate the spline through the texels at (x, y). `coefficients` (height, width, c) extend FRAME beyond the texels on
// all sides.
void spline(const float *coefficients, Index height, Index width, Index c, Edge edge, double x, double y, double *out) {
    const double past = 6;  // farther out the value is constant
    const Index h = height - 2 * FRAME, w = width - 2 * FRAME;
    if (edge != Edge::clear) x = folded(x, w, edge), y = folded(y, h, edge);
    x = min(max(x, -past), double(w) + past), y = min(max(y, -past), double(h) + past);
    const Index i = round_down(y - 0.5), j = round_down(x - 0.5);
    double down[6], across[6];
    quintic(y - 0.5 - double(i), down);
    quintic(x - 0.5 - double(j), across);
    for (Index k = 0; k < c; k++) out[k] = 0;
    for (Index a = 0; a < 6; a++)
        for (Index b = 0; b < 6; b++) {
            const double weight = down[a] * across[b];
            const float *texel = coefficients + ((i + a - 2 + FRAME) * width + j + b - 2 + FRAME) * c;
            for (Index k = 0; k < c; k++) out[k] += weight * double(texel[k]);
        }
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Read the texels that contain points.
//
//   xy   (count, 2) texel coordinates, x right, y down, the first texel's centre at 0.5
//   out  (count, c) written: the texels' values, decoded and premultiplied
//
// Returns the number of points before the first whose row is wanted; see Filter::values.
ICCM_EXPORT int64_t iccm_pixels_nearest(const Pyramid *picture, const double *xy, int64_t count, float *out) {
    switch (picture->base_bytes) {
        case 1: return nearest<uint8_t>(*picture, xy, count, out);
        case 2: return nearest<uint16_t>(*picture, xy, count, out);
        default: return nearest<float>(*picture, xy, count, out);
    }
}

// Filter a picture at points with footprints.
//
//   xy       (count, 2) as for iccm_pixels_nearest
//   jacobian (count, 4) derivatives of x and y with respect to the output's x and y: dx/dx, dx/dy, dy/dx, dy/dy
//   kernel   see Kernel
//   clamped  whether each channel stays between the least and the greatest of the texels that the kernel reads
//   out      (count c + LANES,) written
//
// Returns the number of points before the first that wants rows; see Filter::values.
ICCM_EXPORT int64_t iccm_pixels_filter(const Pyramid *picture, const double *xy, const double *jacobian, int64_t count,
                                       int64_t kernel, bool clamped, float *out) {
    switch (picture->base_bytes) {
        case 1: return filter<uint8_t>(*picture, xy, jacobian, count, Kernel(kernel), clamped, out);
        case 2: return filter<uint16_t>(*picture, xy, jacobian, count, Kernel(kernel), clamped, out);
        default: return filter<float>(*picture, xy, jacobian, count, Kernel(kernel), clamped, out);
    }
}

// Replace the cubic's values by those of the spline, blended into the cubic where the texture is reduced.
//
//   coefficients  (height, width, c) of the spline, extending FRAME beyond the texels on all sides
//   edge          see Edge
//   xy, jacobian  as for iccm_pixels_filter
//   out           (count, c) the cubic's values, changed
ICCM_EXPORT int64_t iccm_pixels_spline(const float *coefficients, int64_t height, int64_t width, int64_t c,
                                       int64_t edge, const double *xy, const double *jacobian, int64_t count,
                                       float *out) {
    Buffer<double> value(c);
    if (!value) return OUT_OF_MEMORY;
    for (Index n = 0; n < count; n++, xy += 2, jacobian += 4, out += c) {
        const double longest = footprint(jacobian[0], jacobian[1], jacobian[2], jacobian[3]).longest;
        const double share = max(0.0, (BLEND - longest) / (BLEND - 1));
        if (!(share > 0)) continue;
        spline(coefficients, height, width, c, Edge(edge), xy[0], xy[1], value.data);
        for (Index k = 0; k < c; k++) {
            const double smooth = value[k];
            out[k] = float(share == 1 ? smooth : share * smooth + (1 - share) * double(out[k]));
        }
    }
    return 0;
}
