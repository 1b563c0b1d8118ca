// Conversion of linear light to stored bytes.
#include "pixels/colour.h"

using namespace iccm;

// Convert linear values to sRGB bytes; channel `alpha` is stored linearly.
//
//   values        (count, c)
//   edges, start  see ByteEdges
//   out           (count, c) written
ICCM_EXPORT int64_t iccm_pixels_encode_bytes(const float *values, int64_t count, int64_t c, int64_t alpha,
                                             const double *edges, const uint8_t *start, uint8_t *out) {
    const ByteEdges table = {edges, start};
    for (Index i = 0; i < count * c; i += c)
        for (Index k = 0; k < c; k++)
            out[i + k] = k == alpha ? linear_byte(values[i + k]) : srgb_byte(values[i + k], table);
    return 0;
}
