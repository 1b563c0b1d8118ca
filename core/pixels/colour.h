// Conversion of linear light to sRGB bytes (IEC 61966-2-1), by a table that rounds exactly.
#pragma once

#include "iccm/core.h"

namespace iccm {

// The tables made by iccm.pixels.colour.byte_edges.
struct ByteEdges {
    static constexpr Index CELLS = 4096;  // cells of the linear values 0 .. 1, each narrower than any byte's interval
    const double *edges;                  // (257,) linear values at which bytes 0 .. 255 begin, and infinity
    const uint8_t *start;                 // (CELLS + 1,) the byte at each cell's lower end; one more may begin in it
};

// A number clamped to [0, 1]; 0 for NaN.
inline double unit(double v) { return v > 0 ? min(v, 1.0) : 0.0; }

inline uint8_t srgb_byte(float value, const ByteEdges &table) {
    const double v = unit(value);
    const Index code = table.start[Index(v * ByteEdges::CELLS)];
    return uint8_t(code + (v >= table.edges[code + 1]));
}

// Rounded to the nearest integer, halves to even.
inline uint8_t linear_byte(float value) { return uint8_t(rint(unit(value) * 255)); }

}  // namespace iccm
