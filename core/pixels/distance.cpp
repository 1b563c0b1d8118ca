// Exact distances of pixels from a set of pixels (Meijster, Roerdink, Hesselink, *A General Algorithm for Computing
// Distance Transforms in Linear Time*, 2000), together with the nearest pixel.
#include "iccm/core.h"

namespace iccm {
namespace {

// Squared distances of the pixels of row i; `up` is the nearest row of the set in each column.
struct Row {
    const int32_t *up;
    int64_t i;

    // Squared distance of the pixel in column x from the set's nearest pixel in column j.
    int64_t squared(int64_t x, int64_t j) const {
        const int64_t down = i - up[j];
        return (x - j) * (x - j) + down * down;
    }

    // The last column that is not farther from the set's pixel in column j than from that in column u > j.
    int64_t last_before(int64_t j, int64_t u) const {
        const int64_t left = i - up[j], right = i - up[u];
        return floor_divide(u * u - j * j + right * right - left * left, 2 * (u - j));
    }
};

// Fill in, for each pixel, the nearest row of its column that belongs to the set: the upper one if two are equally
// near, -1 if the column has no pixel of the set.
void nearest_rows(const bool *known, int64_t height, int64_t width, int32_t *rows) {
    for (Index i = 0; i < height; i++)
        for (Index j = 0; j < width; j++) {
            const Index at = i * width + j;
            rows[at] = known[at] ? int32_t(i) : i > 0 ? rows[at - width] : -1;
        }
    for (Index i = height - 2; i >= 0; i--)
        for (Index j = 0; j < width; j++) {
            const Index at = i * width + j;
            const int32_t below = rows[at + width];
            if (below > i && (rows[at] < 0 || below - i < i - rows[at])) rows[at] = below;
        }
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Find the nearest pixel of a set to each pixel, and its distance.
//
//   known      (height, width) the set
//   nearest    (height, width) written: index of the nearest pixel of the set, row by row; -1 if it is empty
//   distances  (height, width) written: distance to it in pixels; infinite if the set is empty
ICCM_EXPORT int64_t iccm_pixels_nearest_known(const bool *known, int64_t height, int64_t width, int32_t *nearest,
                                              float *distances) {
    Buffer<int32_t> up(width, 0);      // the nearest rows of a row, which its output overwrites
    Buffer<int64_t> column(width, 0);  // columns of the pixels that are nearest to a part of the row, left to right
    Buffer<int64_t> first(width, 0);   // first column of each part
    if (!up || !column || !first) return OUT_OF_MEMORY;
    nearest_rows(known, height, width, nearest);
    for (Index i = 0; i < height; i++) {
        int32_t *out = nearest + i * width;
        float *away = distances + i * width;
        for (Index j = 0; j < width; j++) up[j] = out[j];
        const Row row{&up[0], i};
        Index last = -1;
        for (Index u = 0; u < width; u++) {
            if (up[u] < 0) continue;
            while (last >= 0 && row.squared(first[last], column[last]) > row.squared(first[last], u)) last--;
            const int64_t begin = last < 0 ? 0 : 1 + row.last_before(column[last], u);
            if (begin >= width) continue;
            last++;
            column[last] = u;
            first[last] = begin;
        }
        for (Index x = width - 1; x >= 0; x--) {
            if (last < 0) {
                out[x] = -1;
                away[x] = INFINITY;
                continue;
            }
            const int64_t j = column[last];
            out[x] = int32_t(up[j] * width + j);
            away[x] = float(sqrt(double(row.squared(x, j))));
            if (x == first[last]) last--;
        }
    }
    return height;
}
