// Packing of charts into a region without overlap: the bitmap of each is put at the first free place from the bottom,
// as in Lévy, Petitjean, Ray, Maillot, Least Squares Conformal Maps, 2002 (§4), but with whole bitmaps instead of
// horizons, so that small charts fill the holes and concavities of large ones.
#include "iccm/core.h"

namespace iccm {
namespace {

using Word = uint64_t;
constexpr Index BITS = 64;

// Cells first .. last of a row of a chart: its extent, including gaps.
struct Run {
    Index row, first, last;
};

struct Size {
    Index width, height;
};

// A corner in cells, for one of four orientations: rotations by multiples of 90°.
void rotate(const double *corner, int quarters, double &x, double &y) {
    x = corner[0], y = corner[1];
    for (int k = 0; k < quarters; k++) {
        const double old = x;
        x = -y, y = old;
    }
}

// Mark the cells that a triangle touches. In each row of cells a convex shape covers one interval, from the least to
// the largest x of its part in that row.
void touch(const double (*t)[2], Word *cells, Index words, Size size) {
    double low = t[0][1], high = t[0][1];
    for (int k = 1; k < 3; k++) low = min(low, t[k][1]), high = max(high, t[k][1]);
    const Index top = max(Index(0), Index(floor(low))), bottom = min(size.height - 1, Index(floor(high)));
    for (Index y = top; y <= bottom; y++) {
        double left = INFINITY, right = -INFINITY;
        for (int k = 0; k < 3; k++) {
            const double *a = t[k], *b = t[(k + 1) % 3];
            if (a[1] > b[1]) swap(a, b);
            if (b[1] < double(y) || a[1] > double(y + 1)) continue;
            const double rise = b[1] - a[1];
            for (int end = 0; end < 2; end++) {
                const double at = end ? min(b[1], double(y + 1)) : max(a[1], double(y));
                const double x = rise > 0 ? a[0] + (b[0] - a[0]) * ((at - a[1]) / rise) : (end ? b[0] : a[0]);
                left = min(left, x), right = max(right, x);
            }
        }
        if (!(left <= right)) continue;
        const Index first = max(Index(0), Index(floor(left))), last = min(size.width - 1, Index(floor(right)));
        for (Index x = first; x <= last; x++) cells[y * words + x / BITS] |= Word(1) << (x % BITS);
    }
}

bool is_set(const Word *row, Index x) { return row[x / BITS] >> (x % BITS) & 1; }

// target |= row shifted towards lower x by `by` cells; beyond the end of the row nothing is set.
void or_shifted(Word *target, const Word *row, Index words, Index by) {
    const Index skip = by / BITS, rest = by % BITS;
    for (Index k = 0; k + skip < words; k++) {
        Word value = row[k + skip] >> rest;
        if (rest && k + skip + 1 < words) value |= row[k + skip + 1] << (BITS - rest);
        target[k] |= value;
    }
}

// row |= row shifted towards lower x by 0 .. length - 1 cells, by doubling.
void smear(Word *row, Index words, Index length) {
    for (Index reach = 1; reach < length;) {
        const Index by = min(reach, length - reach);
        or_shifted(row, row, words, by);  // reads ahead of its writes
        reach += by;
    }
}

// The runs of a chart's cells, the longest first, since they are the most likely to show that a place is taken.
Index runs_of(const Word *cells, Index words, Size size, Run *out) {
    Index count = 0;
    for (Index y = 0; y < size.height; y++)
        for (Index x = 0; x < size.width; x++) {
            if (!is_set(cells + y * words, x)) continue;
            const Index first = x;
            while (x + 1 < size.width && is_set(cells + y * words, x + 1)) x++;
            out[count++] = {y, first, x};
        }
    // a shell sort: there are few more runs than rows
    for (Index gap = count / 2; gap > 0; gap /= 2)
        for (Index k = gap; k < count; k++) {
            const Run run = out[k];
            Index at = k;
            for (; at >= gap && out[at - gap].last - out[at - gap].first < run.last - run.first; at -= gap)
                out[at] = out[at - gap];
            out[at] = run;
        }
    return count;
}

// The lowest row below `limit` at which a chart fits, and the first column there; `limit` if there is none.
Index lowest_place(const Word *taken, Index words, Size grid, const Run *runs, Index count, Size size, Index start,
                   Index limit, Word *blocked, Word *smeared, Index &column) {
    const Index places = grid.width - size.width + 1;
    if (places <= 0) return limit;
    for (Index y = start; y < min(limit, grid.height - size.height + 1); y++) {
        for (Index k = 0; k < words; k++) {  // columns at which it would leave the grid
            const Index left = places - k * BITS;
            blocked[k] = left >= BITS ? 0 : left <= 0 ? ~Word(0) : ~Word(0) << left;
        }
        bool full = false;
        for (Index r = 0; r < count && !full; r++) {
            memcpy(smeared, taken + (y + runs[r].row) * words, sizeof(Word) * words);
            smear(smeared, words, runs[r].last - runs[r].first + 1);
            or_shifted(blocked, smeared, words, runs[r].first);
            full = true;
            for (Index k = 0; k < words && full; k++) full = blocked[k] == ~Word(0);
        }
        if (full) continue;
        for (Index x = 0; x < places; x++)
            if (!is_set(blocked, x)) {
                column = x;
                return y;
            }
    }
    return limit;
}

// Mark the cells of a chart, and `margin` cells around it in all directions.
void take(Word *taken, Index words, Size grid, const Run *runs, Index count, Index x, Index y, Index margin) {
    for (Index r = 0; r < count; r++) {
        const Index first = max(Index(0), x + runs[r].first - margin);
        const Index last = min(grid.width - 1, x + runs[r].last + margin);
        const Index bottom = min(grid.height - 1, y + runs[r].row + margin);
        for (Index row = max(Index(0), y + runs[r].row - margin); row <= bottom; row++)
            for (Index c = first; c <= last; c++) taken[row * words + c / BITS] |= Word(1) << (c % BITS);
    }
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Place charts one after the other, each at the lowest free place of the orientation that lies lowest.
//
//   corners       (m, 3, 2) corners of all triangles in cells, chart by chart, y up
//   starts        (k + 1,) where each chart's triangles begin
//   k             number of charts
//   orientations  1: as given; 4: also rotated by multiples of 90°
//   taken         (height, words) bits of the cells that are not free, 64 to a word; changed
//   width, height size of the grid; words = ceil(width / 64)
//   margin        cells between charts
//   alike         (k,) whether a chart has the same corners as the one before: places too small for that one are too
//                 small for it
//   places        (k, 3) rotation about the origin in multiples of 90°, then the offsets of x and y; written
//
// Returns the number of charts that were placed: k unless one does not fit.
ICCM_EXPORT int64_t iccm_meshes_pack(const double *corners, const int64_t *starts, int64_t k, int64_t orientations,
                                     int64_t *taken, int64_t width, int64_t height, int64_t margin, const bool *alike,
                                     double *places) {
    const Index words = (width + BITS - 1) / BITS;
    const Size grid{width, height};
    // a row of a chart has at most one run for every other cell
    Buffer<Word> cells(height * words), blocked(words), smeared(words);
    Buffer<Run> runs(height * (width / 2 + 1)), best_runs(height * (width / 2 + 1));
    if (!cells || !blocked || !smeared || !runs || !best_runs) return OUT_OF_MEMORY;
    Word *bits = reinterpret_cast<Word *>(taken);
    Index reached[4] = {0, 0, 0, 0};
    for (Index chart = 0; chart < k; chart++) {
        Index best = height, best_column = 0, best_count = 0;
        double *place = places + 3 * chart;
        for (int quarters = 0; quarters < orientations; quarters++) {
            double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
            for (Index t = 3 * starts[chart]; t < 3 * starts[chart + 1]; t++) {
                double at[2];
                rotate(corners + 2 * t, quarters, at[0], at[1]);
                for (int axis = 0; axis < 2; axis++)
                    low[axis] = min(low[axis], at[axis]), high[axis] = max(high[axis], at[axis]);
            }
            if (!(high[0] - low[0] < double(width) && high[1] - low[1] < double(height))) continue;
            const Size size{Index(floor(high[0] - low[0])) + 1, Index(floor(high[1] - low[1])) + 1};
            for (Index w = 0; w < size.height * words; w++) cells[w] = 0;
            for (Index t = starts[chart]; t < starts[chart + 1]; t++) {
                double corner[3][2];
                for (int c = 0; c < 3; c++) {
                    rotate(corners + 2 * (3 * t + c), quarters, corner[c][0], corner[c][1]);
                    corner[c][0] -= low[0], corner[c][1] -= low[1];
                }
                touch(corner, cells.data, words, size);
            }
            const Index count = runs_of(cells.data, words, size, runs.data);
            const Index start = alike[chart] ? reached[quarters] : 0;
            Index column = 0;
            const Index row = lowest_place(bits, words, grid, runs.data, count, size, start, best, blocked.data,
                                           smeared.data, column);
            reached[quarters] = row;
            if (row >= best) continue;
            best = row, best_column = column, best_count = count;
            memcpy(best_runs.data, runs.data, sizeof(Run) * count);
            place[0] = quarters, place[1] = double(column) - low[0], place[2] = double(row) - low[1];
        }
        if (best >= height) return chart;
        take(bits, words, grid, best_runs.data, best_count, best_column, best, margin);
    }
    return k;
}
