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

// Mark the cells that an edge touches: in each row of cells, one interval.
void touch(const double (*edge)[2], Word *cells, Index words, Size size) {
    const double *a = edge[0], *b = edge[1];
    if (a[1] > b[1]) swap(a, b);
    const Index first_row = max(Index(0), Index(floor(a[1]))), last_row = min(size.height - 1, Index(floor(b[1])));
    const double rise = b[1] - a[1];
    for (Index y = first_row; y <= last_row; y++) {
        double ends[2] = {a[0], b[0]};
        if (rise > 0) {
            const double from = max(a[1], double(y)), to = min(b[1], double(y + 1));
            ends[0] = a[0] + (b[0] - a[0]) * ((from - a[1]) / rise);
            ends[1] = a[0] + (b[0] - a[0]) * ((to - a[1]) / rise);
        }
        const Index first = max(Index(0), Index(floor(min(ends[0], ends[1]))));
        const Index last = min(size.width - 1, Index(floor(max(ends[0], ends[1]))));
        for (Index x = first; x <= last; x++) cells[y * words + x / BITS] |= Word(1) << (x % BITS);
    }
}

// Count an edge of the outline at the first cell of each row whose centre lies beyond it: the sums along a row are how
// often the outline winds around the cells' centres.
void wind(const double (*edge)[2], int32_t *winding, Size size) {
    const int sign = edge[1][1] > edge[0][1] ? 1 : -1;
    const double *a = edge[0], *b = edge[1];
    if (sign < 0) swap(a, b);
    const Index first_row = max(Index(0), Index(ceil(a[1] - 0.5)));
    for (Index y = first_row; y < size.height && double(y) + 0.5 < b[1]; y++) {
        const double x = a[0] + (b[0] - a[0]) * ((double(y) + 0.5 - a[1]) / (b[1] - a[1]));
        const Index column = max(Index(0), Index(ceil(x - 0.5)));
        if (column < size.width) winding[y * size.width + column] += sign;
    }
}

// Mark the cells that a chart touches, of which the outline is given.
void mark(const double *outline, Index edges, Word *cells, Index words, int32_t *winding, Size size) {
    for (Index w = 0; w < size.height * words; w++) cells[w] = 0;
    for (Index w = 0; w < size.height * size.width; w++) winding[w] = 0;
    for (Index e = 0; e < edges; e++) {
        const double (*edge)[2] = rows<2>(outline + 4 * e);
        touch(edge, cells, words, size);
        wind(edge, winding, size);
    }
    for (Index y = 0; y < size.height; y++) {
        int32_t sum = 0;
        for (Index x = 0; x < size.width; x++) {
            sum += winding[y * size.width + x];
            if (sum) cells[y * words + x / BITS] |= Word(1) << (x % BITS);
        }
    }
}

bool is_set(const Word *row, Index x) { return row[x / BITS] >> (x % BITS) & 1; }

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

// The mean row of a chart's cells.
double centre_row(const Run *runs, Index count) {
    double cells = 0, sum = 0;
    for (Index k = 0; k < count; k++) {
        const double length = double(runs[k].last - runs[k].first + 1);
        cells += length, sum += length * double(runs[k].row);
    }
    return cells > 0 ? sum / cells : 0;
}

// The last cell that is set in first .. last of a row; -1 if none is.
Index last_set(const Word *row, Index first, Index last) {
    for (Index k = last / BITS; k >= first / BITS; k--) {
        Word word = row[k];
        if (k == last / BITS) word &= ~Word(0) >> (BITS - 1 - last % BITS);
        if (k == first / BITS) word &= ~Word(0) << (first % BITS);
        if (word) return k * BITS + BITS - 1 - __builtin_clzll(word);
    }
    return -1;
}

// The lowest row below `limit` at which a chart fits, and the first column there; `limit` if there is none.
//
// Runs are checked in turn. Where one meets a cell that is taken, the chart moves just beyond this cell, until as many
// checks as there are runs have succeeded in sequence.
Index lowest_place(const Word *taken, Index words, Size grid, const Run *runs, Index count, Size size, Index start,
                   Index limit, Index &column) {
    const Index places = grid.width - size.width + 1;
    if (count == 0) return limit;
    Index r = 0;
    for (Index y = start; y < min(limit, grid.height - size.height + 1); y++) {
        Index x = 0, free = 0;
        while (free < count && x < places) {
            const Run &run = runs[r];
            const Index obstacle = last_set(taken + (y + run.row) * words, x + run.first, x + run.last);
            if (obstacle >= 0) {
                x = obstacle + 1 - run.first, free = 0;
            } else {
                free++;
                r = r + 1 < count ? r + 1 : 0;
            }
        }
        if (x < places) {
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

// Place charts one after the other, each at the best free place of all its rotations: the lowest row of places of a
// rotation, and the rotation with which a line of the chart lies lowest.
//
//   outlines      (m, 2) ends of the edges of all outlines in cells, chart by chart, y up
//   starts        (k + 1,) where each chart's edges begin
//   k             number of charts
//   order         (k,) numbers of the charts, in the order in which they are placed
//   rotations     (k, r) unit numbers by which a chart may be multiplied
//   r             how many
//   line          of a chart, which lies lowest: 0 its bottom, 1 its centre of gravity, 2 its top
//   taken         (height, words) bits of the cells that are not free, 64 to a word; changed
//   width, height size of the grid; words = ceil(width / 64)
//   margin        cells between charts
//   alike         (k,) whether the chart of a place in `order` has the same outline and rotations as the one before:
//                 places too small for that one are too small for it
//   places        (k, 3) index of the rotation, then the offsets of x and y; written
//
// Returns the number of charts that were placed: k unless one does not fit.
ICCM_EXPORT int64_t iccm_meshes_pack(const double *outlines, const int64_t *starts, int64_t k, const int64_t *order,
                                     const double *rotations, int64_t r, int64_t line, int64_t *taken, int64_t width,
                                     int64_t height, int64_t margin, const bool *alike, double *places) {
    const Index words = (width + BITS - 1) / BITS;
    const Size grid{width, height};
    // a row of a chart has at most one run for every other cell
    Buffer<Word> cells(height * words);
    Buffer<Run> runs(height * (width / 2 + 1)), best_runs(height * (width / 2 + 1));
    Buffer<Index> reached(r, 0);
    Index longest = 0;
    for (Index chart = 0; chart < k; chart++) longest = max(longest, starts[chart + 1] - starts[chart]);
    Buffer<double> rotated(4 * longest);
    Buffer<int32_t> winding(height * width);
    if (!cells || !winding || !runs || !best_runs || !reached || !rotated) return OUT_OF_MEMORY;
    Word *bits = reinterpret_cast<Word *>(taken);
    for (Index at = 0; at < k; at++) {
        const Index chart = order[at], first = starts[chart], edges = starts[chart + 1] - first;
        double best = double(height);
        Index best_row = 0, best_column = 0, best_count = 0;
        double *place = places + 3 * chart;
        bool fits = false;
        for (Index turn = 0; turn < r; turn++) {
            const double *by = rotations + 2 * (chart * r + turn);
            double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
            for (Index c = 0; c < 2 * edges; c++) {
                const double *z = outlines + 2 * (2 * first + c);
                rotated[2 * c] = z[0] * by[0] - z[1] * by[1], rotated[2 * c + 1] = z[0] * by[1] + z[1] * by[0];
                for (int axis = 0; axis < 2; axis++)
                    low[axis] = min(low[axis], rotated[2 * c + axis]),
                    high[axis] = max(high[axis], rotated[2 * c + axis]);
            }
            if (!(high[0] - low[0] < double(width) && high[1] - low[1] < double(height))) continue;
            const Size size{Index(floor(high[0] - low[0])) + 1, Index(floor(high[1] - low[1])) + 1};
            for (Index c = 0; c < 2 * edges; c++)
                for (int axis = 0; axis < 2; axis++) rotated[2 * c + axis] -= low[axis];
            mark(rotated.data, edges, cells.data, words, winding.data, size);
            const Index count = runs_of(cells.data, words, size, runs.data);
            const double rise = line == 0 ? 0 : line == 1 ? centre_row(runs.data, count) : double(size.height);
            const Index limit = min(height, max(Index(0), Index(ceil((fits ? best : double(2 * height)) - rise))));
            const Index start = alike[at] ? reached[turn] : 0;
            Index column = 0;
            const Index row = lowest_place(bits, words, grid, runs.data, count, size, start, limit, column);
            reached[turn] = row;
            if (row >= min(limit, height - size.height + 1)) continue;
            fits = true;
            best = double(row) + rise, best_row = row, best_column = column, best_count = count;
            memcpy(best_runs.data, runs.data, sizeof(Run) * count);
            place[0] = double(turn), place[1] = double(column) - low[0], place[2] = double(row) - low[1];
        }
        if (!fits) return at;
        take(bits, words, grid, best_runs.data, best_count, best_column, best_row, margin);
    }
    return k;
}
