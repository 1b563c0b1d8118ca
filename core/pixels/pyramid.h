// Pictures prepared for filtering: a mip pyramid of reductions by powers of two (Williams, Pyramidal parametrics,
// 1983).
#pragma once

#include "iccm/core.h"

namespace iccm {

// Continuation outside a picture: its edge texels, nothing, the picture repeated, or the picture mirrored.
enum class Edge : Index { clamp = 0, clear = 1, repeat = 2, mirror = 3 };

// One level of a pyramid.
struct Level {
    Index size;   // width of its texels in texels of the picture; 1 is the picture itself
    Index start;  // index of its first texel in Pyramid::texels (for reductions)
    Index height, width;
};

// A picture and its reductions; the same structure as in iccm/pixels/pyramid.py.
struct Pyramid {
    const uint8_t *base;    // bytes of the picture (h, w, c): float32 if it is ready to be filtered, else integers
    int64_t base_bytes;     // bytes of each number: 4, 1 or 2
    int64_t channels;       // c
    const float *decode;    // (levels, c) linear values of stored integers, by channel
    int64_t alpha;          // the channel that multiplies the others when they are decoded, or -1
    const float *texels;    // (t, c) the reductions, row after row
    const int64_t *levels;  // (level_count, 4) see Level
    int64_t level_count;
    int64_t edge;

    const Level &level(Index number) const { return reinterpret_cast<const Level *>(levels)[number]; }
    Edge outside() const { return Edge(edge); }

    template <typename Stored>
    const Stored *stored() const {
        return reinterpret_cast<const Stored *>(base);
    }
};

// The index among n texels in a row that corresponds to any index i.
inline Index inside(Index i, Index n, Edge edge) {
    if (edge == Edge::repeat) return floor_remainder(i, n);
    if (edge == Edge::mirror) {
        i = floor_remainder(i, 2 * n);
        return min(i, 2 * n - 1 - i);
    }
    return min(max(i, Index(0)), n - 1);
}

// Channel k of texel (i, j) of the picture, decoded and premultiplied.
template <typename Stored>
inline float ready(const Pyramid &picture, Index i, Index j, Index k) {
    const Index c = picture.channels;
    const Stored *texel = picture.stored<Stored>() + (i * picture.level(0).width + j) * c;
    float value = picture.decode[texel[k] * c + k];
    if (picture.alpha < 0 || k == picture.alpha) return value;
    return value * picture.decode[texel[picture.alpha] * c + picture.alpha];
}

template <>
inline float ready<float>(const Pyramid &picture, Index i, Index j, Index k) {
    return picture.stored<float>()[(i * picture.level(0).width + j) * picture.channels + k];
}

}  // namespace iccm
