// A grid of square buckets over the plane, each listing the boxes that touch it, so that a search near a point need not
// look at all of them.
#pragma once

#include "iccm/core.h"

namespace iccm {

// The arrays of `iccm.buckets.BucketGrid`.
struct BucketGrid {
    Complex low;  // lower left corner
    double size;  // of a bucket
    Index columns, rows;
    const Index *begin;  // (columns · rows + 1,) where each bucket's boxes begin, row by row
    const Index *boxes;  // numbers of the boxes

    // The bucket that contains a point; -1 outside the grid and for points that are not finite.
    Index bucket_at(Complex point) const {
        double x = floor((point.re - low.re) / size), y = floor((point.im - low.im) / size);
        if (!(0 <= x && x < static_cast<double>(columns) && 0 <= y && y < static_cast<double>(rows))) return -1;
        return static_cast<Index>(y) * columns + static_cast<Index>(x);
    }
};

}  // namespace iccm
