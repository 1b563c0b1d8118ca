// The nearest of many segments to each of many points.

#include "iccm/buckets.h"
#include "iccm/core.h"

namespace iccm {
namespace {

// Segments from `start` to start + along.
struct Segments {
    const Complex *start, *along;
};

// The nearest segment so far. Among equally near ones it is the first, whatever the order in which they are visited.
struct Nearest {
    double distance;  // squared
    Index segment;
    double part;  // position along the segment, from 0 to 1

    void compare(const Segments &segments, Index s, Complex point) {
        Complex along = segments.along[s], off = point - segments.start[s];
        double projection = dot(along, off);
        double length = dot(along, along), t = 0.0;
        if (projection > 0) t = projection < length ? projection / length : 1.0;
        double away =
            dot({off.re - t * along.re, off.im - t * along.im}, {off.re - t * along.re, off.im - t * along.im});
        if (away < distance || (away == distance && s < segment)) distance = away, segment = s, part = t;
    }
};

// Search rings of buckets around the point's own, or around the one nearest to a point outside the grid, until the
// remaining ones cannot contain a nearer segment.
Nearest nearest_to(Complex point, const Segments &segments, const BucketGrid &grid) {
    Nearest nearest = {INFINITY, 0, 0.0};
    double x = (point.re - grid.low.re) / grid.size, y = (point.im - grid.low.im) / grid.size;
    if (!(fabs(x) + fabs(y) < INFINITY)) return nearest;
    double columns = static_cast<double>(grid.columns), rows = static_cast<double>(grid.rows);
    Index column = static_cast<Index>(min(max(x, 0.0), columns - 1.0));
    Index row = static_cast<Index>(min(max(y, 0.0), rows - 1.0));
    // In units of buckets: a point outside is at least this far from all of them, beyond the reach of the rings.
    double beside_x = max(max(-x, x - columns), 0.0), beside_y = max(max(-y, y - rows), 0.0);
    double beside = beside_x * beside_x + beside_y * beside_y, unit = grid.size * grid.size;
    double reached = 0.0;  // the squared distance within which the rings so far contain every segment
    Index most = max(grid.columns, grid.rows);
    for (Index ring = 0; ring <= most && !(nearest.distance <= (beside + reached) * unit); ++ring) {
        for (Index r = max(row - ring, Index{0}), end = min(row + ring + 1, grid.rows); r < end; ++r) {
            // The ring has the first and the last row in full, and the two ends of the others.
            Index step = r == row - ring || r == row + ring ? 1 : 2 * ring;
            for (Index c = column - ring; c <= column + ring; c += step) {
                if (c < 0 || c >= grid.columns) continue;
                Index bucket = r * grid.columns + c;
                for (Index b = grid.begin[bucket]; b < grid.begin[bucket + 1]; ++b)
                    nearest.compare(segments, grid.boxes[b], point);
            }
        }
        reached = static_cast<double>(ring) * static_cast<double>(ring);
    }
    return nearest;
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Find the nearest of many segments to each of many points. Returns 0.
//
//   points      (p,) points; those that are not finite get segment 0
//   p           number of points
//   start       (s,) start of each segment
//   along       (s,) end less start
//   low_x       x of the lower left corner of a bucket grid of the segments' boxes
//   low_y       y of that corner
//   size        side of a bucket
//   columns     number of bucket columns
//   rows_count  number of bucket rows
//   begin       (columns · rows_count + 1,) where each bucket begins in `boxes`, row by row
//   boxes       segments whose boxes touch each bucket
//   segment     (p,) written: the nearest one, the first of equals
//   part        (p,) written: position of the nearest point along it, from 0 to 1
ICCM_EXPORT int64_t iccm_maps_nearest_segments(const Complex *points, int64_t p, const Complex *start,
                                               const Complex *along, double low_x, double low_y, double size,
                                               int64_t columns, int64_t rows_count, const int64_t *begin,
                                               const int64_t *boxes, int64_t *segment, double *part) {
    const BucketGrid grid = {{low_x, low_y}, size, columns, rows_count, begin, boxes};
    for (Index n = 0; n < p; n++) {
        Nearest nearest = nearest_to(points[n], {start, along}, grid);
        segment[n] = nearest.segment, part[n] = nearest.part;
    }
    return 0;
}
