// The multifrontal method (Duff and Reid, The Multifrontal Solution of Indefinite Sparse Symmetric Linear Equations,
// ACM Transactions on Mathematical Software 9, 1983; Liu, The Multifrontal Method for Sparse Matrix Solution, SIAM
// Review 34, 1992): the columns of a front are a dense trapezoid and are eliminated at once; their contribution to
// later columns, the update, is added to the parent's front.
//
// The factor of [[H, g], [gᵀ, ·]] has (L⁻¹ g)ᵀ as its last row: with g as one more row of every front, the
// factorisation also does the forward substitution.
#include "linalg/cholesky.h"

#include "iccm/lanes.h"

namespace iccm {

namespace {

// A front while it is eliminated: `own` columns of `tall` rows, then the lower triangle of its update, stored in full
// columns of tall - own numbers.
struct Front {
    double *panel, *update;
    Index own, tall;

    // The diagonal entry of column c, among the front's own columns or in its update.
    double *column(Index c) const { return c < own ? panel + c * (tall + 1) : update + (c - own) * (tall - own + 1); }
};

// Add the front's part of the matrix and of the gradient to its columns, and fill in the positions of its rows.
void assemble(const BlockPattern &pattern, const double *matrix, const Complex *gradient, Index number,
              const Front &front, Index *place) {
    const Fronts &fronts = pattern.fronts;
    Index first = fronts.starts[number], end = fronts.starts[number + 1], tall = front.tall;
    for (Index c = first; c < end; c++) place[c] = 2 * (c - first);
    Index at = 2 * (end - first);
    for (Index p = fronts.beyond_starts[number]; p < fronts.beyond_starts[number + 1]; p++, at += 2)
        place[fronts.beyond[p]] = at;
    // Row c of the matrix's upper triangle is, by symmetry, column c of its lower triangle, which fronts hold. Each block
    // xx, xy, yx, yy fills two rows of the two columns of a vertex; the gradient is the last row.
    for (Index c = first; c < end; c++) {
        double *column = front.panel + place[c] * tall;
        Complex g = gradient[pattern.order[c]];
        for (Index p = pattern.starts[c]; p < pattern.starts[c + 1]; p++) {
            double *slot = column + place[pattern.columns[p]];
            slot[0] = matrix[4 * p];
            slot[1] = matrix[4 * p + 1];
            slot[tall] = matrix[4 * p + 2];
            slot[tall + 1] = matrix[4 * p + 3];
        }
        column[tall - 1] = g.re;
        column[2 * tall - 1] = g.im;
    }
}

// Add a child's update to the columns and to the update of its parent's front ("extend-add").
void extend_add(const Fronts &fronts, Index child, const double *update, const Index *place, const Front &parent) {
    const Index *beyond = fronts.beyond + fronts.beyond_starts[child];
    Index count = fronts.beyond_starts[child + 1] - fronts.beyond_starts[child], size = 2 * count + 1;
    for (Index p = 0; p < count; p++) {
        Index column = place[beyond[p]];
        for (Index half = 0; half < 2; half++) {
            const double *left = update + (2 * p + half) * size;
            // The column of the parent to which this one is added, so that goal[row] is the number in a row of the front.
            // Columns of the update begin at row `own`, so their pointer begins as much earlier.
            double *goal = parent.panel + (column + half) * parent.tall;
            if (column >= parent.own)
                goal = parent.update + (column - parent.own + half) * (parent.tall - parent.own) - parent.own;
            // `beyond` is ascending, so rows from p on are the lower triangle (and one number above it, which nobody reads)
            for (Index q = p; q < count; q++) {
                double *row = goal + place[beyond[q]];
                row[0] += left[2 * q];
                row[1] += left[2 * q + 1];
            }
            goal[parent.tall - 1] += left[size - 1];
        }
    }
}

// Subtract from x the columns of a block, each times its first number: column k of B Bᵀ is the sum over the columns b of
// B of b[k] · b. Sums are taken in the order of the columns.
template <int wide>
inline void subtract_columns(double *__restrict x, const double *block, Index tall, Index count) {
    if constexpr (wide == 8) {
        const double *a = block, *b = block + tall, *c = block + 2 * tall, *d = block + 3 * tall;
        const double *e = block + 4 * tall, *f = block + 5 * tall, *g = block + 6 * tall, *h = block + 7 * tall;
        double a0 = a[0], b0 = b[0], c0 = c[0], d0 = d[0], e0 = e[0], f0 = f[0], g0 = g[0], h0 = h[0];
        for (Index i = 0; i < count; i++)
            x[i] -= a0 * a[i] + b0 * b[i] + c0 * c[i] + d0 * d[i] + e0 * e[i] + f0 * f[i] + g0 * g[i] + h0 * h[i];
    } else {
        const double *a = block, *b = block + tall;
        double a0 = a[0], b0 = b[0];
        for (Index i = 0; i < count; i++) x[i] -= a0 * a[i] + b0 * b[i];
    }
}

// Σ x[i] y[i] as four independent sums, so that no addition waits for the previous one.
double product(const double *x, const double *y, Index count) {
    Double4 four = {0, 0, 0, 0};
    Index i = 0;
    for (; i + 4 <= count; i += 4) four += load(x + i) * load(y + i);
    double rest = 0;
    for (; i < count; i++) rest += x[i] * y[i];
    return sum(four) + rest;
}

// Subtracts the product B Bᵀ of a block's columns B from the lower triangle of all columns from `begin` on.
template <int wide>
void subtract_products(const Front &front, const double *block, Index begin) {
    for (Index c = begin; c < front.tall - 1; c++)
        subtract_columns<wide>(front.column(c), block + c, front.tall, front.tall - c);
}

// Eliminates the front's own columns, in blocks of eight or two; false if they are not positive definite.
bool eliminate(const Front &front) {
    Index tall = front.tall;
    for (Index begin = 0; begin < front.own;) {
        // The columns of a block are first finished one after another, then subtracted from all later ones at once, so
        // that these are read and written once per block. The number of columns is even, so that blocks of two handle
        // the remainder.
        Index wide = front.own - begin >= 8 ? 8 : 2;
        double *block = front.panel + begin * tall;
        for (Index j = 0; j < wide; j++) {
            Index count = tall - begin - j;
            double *__restrict x = block + j * tall + begin + j;
            for (Index k = 0; k < j; k++) {
                const double *a = block + k * tall + begin + j;
                double a0 = a[0];
                for (Index i = 0; i < count; i++) x[i] -= a0 * a[i];
            }
            if (!(x[0] > 0)) return false;
            double scale = 1 / sqrt(x[0]);
            for (Index i = 0; i < count; i++) x[i] *= scale;
        }
        begin += wide;
        if (wide == 8)
            subtract_products<8>(front, block, begin);
        else
            subtract_products<2>(front, block, begin);
    }
    return true;
}

}  // namespace

bool factorise(const BlockPattern &pattern, const double *matrix, const Complex *gradient, Factor &factor) {
    // `values` holds the columns of all fronts, which are the factor, and after them a stack of updates of finished
    // fronts whose parents are still to come. The stack has `top` entries, for the fronts in `waiting`; entry k begins
    // at sources[k], and free space begins at sources[top].
    const Fronts &fronts = pattern.fronts;
    double *values = factor.values;
    Index *waiting = factor.waiting, *sources = factor.sources, top = 0;
    sources[0] = fronts.panels[fronts.count];
    for (Index number = 0; number < fronts.count; number++) {
        // A front has two rows for each vertex, and one more for the gradient. `own` of its columns are eliminated
        // here; the `rest` of the rows is the size of the update, which is built on top of the stack.
        Index own = 2 * (fronts.starts[number + 1] - fronts.starts[number]);
        Index rest = 2 * (fronts.beyond_starts[number + 1] - fronts.beyond_starts[number]) + 1;
        Index update = sources[top];
        Front front{values + fronts.panels[number], values + update, own, own + rest};
        memset(front.panel, 0, sizeof(double) * own * front.tall);
        memset(front.update, 0, sizeof(double) * rest * rest);
        assemble(pattern, matrix, gradient, number, front, factor.place);
        // Fronts are numbered in postorder: the updates of this one's children are the last ones on the stack.
        while (top > 0 && fronts.parents[waiting[top - 1]] == number) {
            top--;
            extend_add(fronts, waiting[top], values + sources[top], factor.place, front);
        }
        if (!eliminate(front)) return false;
        Index goal = sources[top];
        // The children's updates are no longer needed: this front's update moves down to where they began.
        if (goal < update) memmove(values + goal, values + update, sizeof(double) * rest * rest);
        if (rest > 1) {  // else the front has no parent: only the gradient's row is left
            waiting[top] = number;
            top++;
            sources[top] = goal + rest * rest;
        }
    }
    return true;
}

void forward_substitute(const BlockPattern &pattern, const Complex *gradient, Factor &factor) {
    const Fronts &fronts = pattern.fronts;
    double *left = factor.left;
    for (Index row = 0; row < pattern.n; row++) {
        Complex g = gradient[pattern.order[row]];
        left[2 * row] = g.re;
        left[2 * row + 1] = g.im;
    }
    for (Index number = 0; number < fronts.count; number++) {
        Index first = fronts.starts[number], own = 2 * (fronts.starts[number + 1] - first);
        const Index *beyond = fronts.beyond + fronts.beyond_starts[number];
        Index count = fronts.beyond_starts[number + 1] - fronts.beyond_starts[number];
        Index tall = own + 2 * count + 1;
        double *column = factor.values + fronts.panels[number];
        for (Index j = 0; j < own; j++, column += tall) {
            double found = left[2 * first + j] / column[j];
            column[tall - 1] = found;
            for (Index i = j + 1; i < own; i++) left[2 * first + i] -= column[i] * found;
            for (Index p = 0; p < count; p++) {
                const double *row = column + own + 2 * p;
                left[2 * beyond[p]] -= row[0] * found;
                left[2 * beyond[p] + 1] -= row[1] * found;
            }
        }
    }
}

void back_substitute(const BlockPattern &pattern, Factor &factor, Complex *step) {
    const Fronts &fronts = pattern.fronts;
    double *part = factor.part;
    for (Index number = fronts.count - 1; number >= 0; number--) {
        Index first = fronts.starts[number], end = fronts.starts[number + 1];
        Index own = 2 * (end - first), tall = own;
        for (Index p = fronts.beyond_starts[number]; p < fronts.beyond_starts[number + 1]; p++) {
            Complex found = step[pattern.order[fronts.beyond[p]]];
            part[tall] = found.re;
            part[tall + 1] = found.im;
            tall += 2;
        }
        // Solve row j of Lᵀ x + L⁻¹ g = 0 for x[j], from the last row to the first. Column j of L is stored from its
        // diagonal entry on and ends with L⁻¹ g, and the solution below it ends with a one, so that one scalar product
        // covers both terms.
        part[tall] = 1.0;
        tall++;
        const double *column = factor.values + fronts.panels[number] + (own - 1) * tall;
        for (Index j = own - 1; j >= 0; j--, column -= tall) {
            part[j] = -product(part + j + 1, column + j + 1, tall - j - 1) / column[j];
        }
        for (Index c = first; c < end; c++) step[pattern.order[c]] = {part[2 * (c - first)], part[2 * (c - first) + 1]};
    }
}

}  // namespace iccm

using namespace iccm;

// See cholesky.h. Returns 1, or 0 if the matrix is not positive definite.
ICCM_EXPORT int64_t iccm_linalg_factorise(const BlockPattern *pattern, const double *matrix, const Complex *gradient,
                                          Factor *factor) {
    return factorise(*pattern, matrix, gradient, *factor);
}

ICCM_EXPORT int64_t iccm_linalg_forward_substitute(const BlockPattern *pattern, const Complex *gradient,
                                                   Factor *factor) {
    forward_substitute(*pattern, gradient, *factor);
    return 0;
}

ICCM_EXPORT int64_t iccm_linalg_back_substitute(const BlockPattern *pattern, Factor *factor, Complex *step) {
    back_substitute(*pattern, *factor, step);
    return 0;
}
