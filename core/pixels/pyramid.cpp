// Construction of pyramids: halving of pictures, and decoding of stored integers.
#include "pixels/pyramid.h"

#include "iccm/lanes.h"

namespace iccm {
namespace {

constexpr Index TAPS = 12;    // of the half-band filter; output j is centred between taps 5 and 6, on input 2 j + 1/2
constexpr Index BEFORE = 5;   // number of inputs before input 2 j that the filter reads
constexpr Index AFTER = 7;    // number of inputs from input 2 j on
constexpr Index LANES = 4;    // channels that are weighed at a time
constexpr Index PIECE = 1024; // numbers of a row that are summed at a time, in the first-level cache

// Write the weighted sum of TAPS rows of a picture around row 2 i to `line`; within their range if CLAMPED.
//
// The negative lobes of the filter overshoot at edges. Clamping each step keeps the range of the texels below it, and
// changes nothing where there is no overshoot.
template <bool CLAMPED>
void halve_down(const float *picture, Index height, Index size, Index i, const float *taps, Edge edge, float *line) {
    float least[PIECE], most[PIECE];
    const bool outside = edge == Edge::clear && (2 * i < BEFORE || 2 * i - BEFORE + TAPS > height);  // zeros are read
    for (Index first = 0; first < size; first += PIECE) {
        const Index count = min(PIECE, size - first);
        float *piece = line + first;
        for (Index j = 0; j < count; j++) piece[j] = 0;
        if (CLAMPED) {
            const float *middle = picture + 2 * i * size + first;
            for (Index j = 0; j < count; j++) {
                least[j] = outside ? min(middle[j], 0.0f) : middle[j];
                most[j] = outside ? max(middle[j], 0.0f) : middle[j];
            }
        }
        for (Index t = 0; t < TAPS; t++) {
            const Index row = 2 * i + t - BEFORE;
            if (edge == Edge::clear && (row < 0 || row >= height)) continue;
            const float *from = picture + inside(row, height, edge) * size + first;
            const float tap = taps[t];
            for (Index j = 0; j < count; j++) {
                const float texel = from[j];
                piece[j] += tap * texel;
                if (CLAMPED) least[j] = min(least[j], texel), most[j] = max(most[j], texel);
            }
        }
        if (CLAMPED)
            for (Index j = 0; j < count; j++) piece[j] = min(max(piece[j], least[j]), most[j]);
    }
}

// Fill in the texels outside a row of `width` texels: BEFORE of them to its left, AFTER to its right.
void surround(float *row, Index width, Index c, Edge edge) {
    for (Index k = 0; k < BEFORE * c; k++) row[k - BEFORE * c] = row[inside(k / c - BEFORE, width, edge) * c + k % c];
    for (Index k = 0; k < AFTER * c; k++) row[width * c + k] = row[inside(width + k / c, width, edge) * c + k % c];
}

// Write the weighted sums of TAPS texels around every second one of a row, whose surroundings are filled in; within
// their range if CLAMPED.
template <bool CLAMPED>
void halve_across(const float *row, Index width, Index c, const float *taps, float *out) {
    for (Index j = 0; j < width; j++)
        for (Index first = 0; first < c; first += LANES) {
            const float *from = row + (2 * j - BEFORE) * c + first;
            Double4 value = {0, 0, 0, 0};
            Float4 least = load(from), most = least;
            for (Index t = 0; t < TAPS; t++) {
                const Float4 texel = load(from + t * c);
                value += double(taps[t]) * widen(texel);
                if (CLAMPED) least = lower(texel, least), most = higher(texel, most);
            }
            Float4 rounded = narrow(value);
            if (CLAMPED) rounded = lower(higher(rounded, least), most);
            memcpy(out + j * c + first, &rounded, sizeof(float) * size_t(min(c - first, LANES)));
        }
}

template <bool CLAMPED>
Index halve(const float *picture, Index height, Index width, Index c, const float *taps, Edge edge, Index first,
            Index last, float *out) {
    const Index out_width = (width + 1) / 2;
    // zeros around the row, as required if there is nothing outside; LANES more, since a register extends beyond the
    // last texel's channels
    Buffer<float> line((width + BEFORE + AFTER) * c + LANES, 0.0f);
    if (!line) return OUT_OF_MEMORY;
    float *row = line.data + BEFORE * c;
    for (Index i = first; i < last; i++, out += out_width * c) {
        halve_down<CLAMPED>(picture, height, width * c, i, taps, edge, row);
        if (edge != Edge::clear) surround(row, width, c, edge);
        halve_across<CLAMPED>(row, out_width, c, taps, out);
    }
    return 0;
}

template <typename Stored>
void decode(const Stored *pixels, Index count, Index c, const float *table, Index alpha, float *out) {
    for (Index i = 0; i < count; i++, pixels += c, out += c) {
        const float opacity = alpha < 0 ? 1.0f : table[pixels[alpha] * c + alpha];
        for (Index k = 0; k < c; k++) {
            const float value = table[pixels[k] * c + k];
            out[k] = k == alpha ? value : opacity * value;
        }
    }
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Halve a picture in both directions by the same filter: first down the columns, in single precision, then across.
//
//   picture      (height, width, c) values, of which BEFORE rows above row 2 first to AFTER rows below row 2 last are read
//   taps         (TAPS,)
//   edge         see Edge
//   clamped      whether each channel stays between the least and the greatest of the texels that are read
//   first, last  the rows first .. last - 1 of the result are computed
//   out          (last - first, ceil(width / 2), c) written
ICCM_EXPORT int64_t iccm_pixels_halve(const float *picture, int64_t height, int64_t width, int64_t c, const float *taps,
                                      int64_t edge, bool clamped, int64_t first, int64_t last, float *out) {
    if (clamped) return halve<true>(picture, height, width, c, taps, Edge(edge), first, last, out);
    return halve<false>(picture, height, width, c, taps, Edge(edge), first, last, out);
}

// Mark a strip of a pyramid as present, after its rows have been written: a thread that sees the mark sees the rows.
ICCM_EXPORT int64_t iccm_pixels_present(uint8_t *present, int64_t strip) {
    __atomic_store_n(present + strip, 1, __ATOMIC_RELEASE);
    return 0;
}

// Decode stored integers to linear premultiplied numbers.
//
//   pixels  bytes of (count, c) integers of 1 or 2 bytes each
//   table   (levels, c) the linear value of every integer, by channel
//   alpha   the channel that multiplies the others, or -1
//   out     (count, c) written
ICCM_EXPORT int64_t iccm_pixels_decode(const uint8_t *pixels, int64_t bytes, int64_t count, int64_t c,
                                       const float *table, int64_t alpha, float *out) {
    if (bytes == 1)
        decode(pixels, count, c, table, alpha, out);
    else
        decode(reinterpret_cast<const uint16_t *>(pixels), count, c, table, alpha, out);
    return 0;
}
