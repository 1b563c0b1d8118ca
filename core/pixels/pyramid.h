// Pictures prepared for filtering: a mip pyramid of reductions by powers of two (Williams, Pyramidal parametrics,
// 1983).
//
// The rows of all levels are computed when they are first wanted: a filter that meets rows that are absent marks their
// strips as wanted, and is called again from there once they have been computed (iccm/pixels/pyramid.py).
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
    Index strip;  // number of the strip that begins with its first row
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

// A picture and its reductions; the same structure as in iccm/pixels/pyramid.py.
struct Pyramid {
    const uint8_t *base;    // bytes of the picture (h, w, c): float32 if it is ready to be filtered, else integers
    int64_t base_bytes;     // bytes of each number: 4, 1 or 2
    int64_t channels;       // c
    const float *decode;    // (levels, c) linear values of stored integers, by channel
    int64_t alpha;          // the channel that multiplies the others when they are decoded, or -1
    const float *texels;    // (t, c) the reductions, row after row
    const int64_t *levels;  // (level_count, 5) see Level
    int64_t level_count;
    int64_t edge;
    int64_t strip_rows;      // rows of a strip, of which the last of a level may have fewer
    const uint8_t *present;  // (strips,) whether the rows of each strip have been computed
    uint8_t *wanted;         // (strips,) set where a filter would read rows that have not

    const Level &level(Index number) const { return reinterpret_cast<const Level *>(levels)[number]; }
    Edge outside() const { return Edge(edge); }

    // Whether all rows first .. last of a level are present, wherever `edge` places those beyond it; marks what is
    // wanted.
    bool has(const Level &level, Index first, Index last) const {
        const Index rows = level.height;
        if (last - first >= rows) return has_between(level, 0, rows - 1);
        const bool beyond = first < 0 || last >= rows;
        if (!beyond || edge == Index(Edge::clamp) || edge == Index(Edge::clear))
            return has_between(level, inside(first, rows, Edge::clamp), inside(last, rows, Edge::clamp));
        bool all = true;
        for (Index row = first; row <= last; row++) {
            const Index at = inside(row, rows, outside());
            all &= has_between(level, at, at);
        }
        return all;
    }

    // The same for rows of the level itself.
    bool has_between(const Level &level, Index first, Index last) const {
        bool all = true;
        for (Index strip = level.strip + first / strip_rows; strip <= level.strip + last / strip_rows; strip++) {
            if (__atomic_load_n(present + strip, __ATOMIC_ACQUIRE)) continue;
            wanted[strip] = 1;
            all = false;
        }
        return all;
    }

    template <typename Stored>
    const Stored *stored() const {
        return reinterpret_cast<const Stored *>(base);
    }
};

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
