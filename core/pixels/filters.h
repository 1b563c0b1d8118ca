// Filtering a picture at points whose footprints depend on a map: a mip pyramid and a stretched kernel.
//
// A pixel's footprint in the texture is the ellipse of J, d(texel) / d(pixel). The filter is k(u) k(v) with (u, v) =
// S⁻¹ d, S being the symmetric square root of J Jᵀ with no axis shorter than one texel: elliptical filters as in
// Heckbert, Fundamentals of texture mapping and image warping (1989), with separable kernels in place of Gaussians. It
// is the plain separable kernel where the texture is magnified. Wide kernels read a smaller level of the pyramid.
#pragma once

#include "pixels/pyramid.h"
#include "pixels/sums.h"

namespace iccm {

constexpr Index MOST = 232;  // most rows and columns of a kernel: Lanczos, axes of 32 and 4 texels, rotated by 22.5°

// Conversion to integers; coordinates that are not finite, or beyond any picture, become 0.
inline Index whole(double x) { return fabs(x) < 1e15 ? Index(x) : 0; }
inline Index round_down(double x) { return whole(floor(x)); }
inline Index round_up(double x) { return whole(ceil(x)); }

// Filters a picture at points. `scratch` is for copies of texels that lie outside the picture or have to be decoded.
template <typename Stored>
class Filter {
  public:
    Filter(const Pyramid &picture, Kernel kernel, bool clamped)
        : picture(picture),
          kernel(kernel),
          clamped(clamped),
          edge(picture.outside()),
          periodic(edge == Edge::repeat || edge == Edge::mirror),
          scratch(MOST * MOST * picture.channels + COLUMNS * picture.channels) {}

    explicit operator bool() const { return bool(scratch); }

    // Write the values at `count` texel coordinates xy (count, 2) with footprints jacobian (count, 4) to out (count c +
    // LANES,).
    //
    // x is to the right, y down, and the first texel's centre at 0.5. If `clamped`, each channel of a value stays
    // between the least and the greatest of the texels that the kernel reads. Returns the number of points before the
    // first that wants rows of the pyramid which are absent. From there on, also in later calls, points are only looked
    // at for the rows that they want, and their values are not written.
    Index values(const double *xy, const double *jacobian, Index count, float *out);

    // Whether no rows have been wanted so far.
    bool complete() const { return has_all; }

  private:
    void magnify(const float *texels, Index row, double x, double y, float *out) {
        if (clamped)
            magnify<true>(texels, row, x, y, out);
        else
            magnify<false>(texels, row, x, y, out);
    }
    template <bool CLAMPED>
    void magnify(const float *texels, Index row, double x, double y, float *out) {
        switch (picture.channels) {
            case 1: return magnified<1, CLAMPED>(texels, row, x, y, out);
            case 2: return magnified<2, CLAMPED>(texels, row, x, y, out);
            case 3: return magnified<3, CLAMPED>(texels, row, x, y, out);
            case 4: return magnified<4, CLAMPED>(texels, row, x, y, out);
            default: magnified<CLAMPED>(texels, row, picture.channels, x, y, out);
        }
    }
    bool has_rows(const double *xy, const Shape *shapes, Index count) const;
    Index level_of(const Shape &shape) const;
    void stretched(double x, double y, Shape shape, float *out);
    template <Kernel KERNEL>
    void weigh(const float *texels, Index row, Index rows, Index columns, double x, double y, const Shape &shape,
               float *out) {
        if (clamped)
            weigh<KERNEL, true>(texels, row, rows, columns, x, y, shape, out);
        else
            weigh<KERNEL, false>(texels, row, rows, columns, x, y, shape, out);
    }
    template <Kernel KERNEL, bool CLAMPED>
    void weigh(const float *texels, Index row, Index rows, Index columns, double x, double y, const Shape &shape,
               float *out) {
        switch (picture.channels) {
            case 1: return weighed<KERNEL, 1, CLAMPED>(texels, row, rows, columns, x, y, shape, out);
            case 2: return weighed<KERNEL, 2, CLAMPED>(texels, row, rows, columns, x, y, shape, out);
            case 3: return weighed<KERNEL, 3, CLAMPED>(texels, row, rows, columns, x, y, shape, out);
            case 4: return weighed<KERNEL, 4, CLAMPED>(texels, row, rows, columns, x, y, shape, out);
            default: weighed<KERNEL, CLAMPED>(texels, row, picture.channels, rows, columns, x, y, shape, out);
        }
    }
    void copy(Index level, Index i, Index j, Index rows, Index columns);

    const Pyramid &picture;
    const Kernel kernel;
    const bool clamped;
    const Edge edge;
    const bool periodic;
    Buffer<float> scratch;
    bool has_all = true;
};

// The coordinate within a row of n texels that corresponds to coordinate x on repeated or mirrored pictures; x itself
// for other edges.
inline double folded(double x, Index n, Edge edge) {
    if (edge == Edge::repeat) return x - double(n) * floor(x / double(n));
    if (edge == Edge::mirror) {
        x -= double(2 * n) * floor(x / double(2 * n));
        return min(x, double(2 * n) - x);
    }
    return x;
}

// Copy the rows × columns texels of a level that begin at (i, j) to `scratch`, decoded and premultiplied. Texels beyond
// the picture follow from `edge`.
template <typename Stored>
void Filter<Stored>::copy(Index number, Index i, Index j, Index rows, Index columns) {
    constexpr Index NOWHERE = -1;
    const Level level = picture.level(number);
    const Index w = level.width, h = level.height, c = picture.channels;
    const bool empty = edge == Edge::clear;
    const float *stored = number ? picture.texels + level.start * c : picture.stored<float>();
    Index sources[MOST];  // the level's column for each copied column
    for (Index b = 0; b < columns; b++)
        sources[b] = empty && (j + b < 0 || j + b >= w) ? NOWHERE : inside(j + b, w, edge);
    float *out = scratch.data;
    for (Index a = i; a < i + rows; a++) {
        const Index y = inside(a, h, edge);
        const bool outside = empty && (a < 0 || a >= h);
        for (Index b = 0; b < columns; b++, out += c) {
            const Index x = sources[b];
            if (outside || x == NOWHERE) {
                for (Index k = 0; k < c; k++) out[k] = 0;
            } else if (number || sizeof(Stored) == sizeof(float)) {
                const float *texel = stored + (y * w + x) * c;
                for (Index k = 0; k < c; k++) out[k] = texel[k];
            } else {
                for (Index k = 0; k < c; k++) out[k] = ready<Stored>(picture, y, x, k);
            }
        }
    }
}

template <typename Stored>
Index Filter<Stored>::values(const double *xy, const double *jacobian, Index count, float *out) {
    const Index c = picture.channels, w = picture.level(0).width, h = picture.level(0).height;
    const bool repeats = edge == Edge::repeat;
    const bool direct = sizeof(Stored) == sizeof(float) && kernel == Kernel::cubic && w * c >= LANES;
    const float *texels = picture.stored<float>();
    // The shapes of some pixels are computed before their values: addresses are then known early, and loads do not wait
    // for square roots. No shapes are needed if all pixels are magnified.
    constexpr Index SOME = 64;
    Shape shapes[SOME];
    Index done = 0;
    for (Index first = 0; first < count; first += SOME) {
        const Index some = min(SOME, count - first);
        bool small = true;
        for (Index n = 0; n < 4 * some; n += 4) {
            const double *j = jacobian + n;
            small &= Gram(j[0], j[1], j[2], j[3]).small();
        }
        for (Index n = 0; n < some && !small; n++) {
            const double *t = jacobian + 4 * n;
            shapes[n] = footprint(t[0], t[1], t[2], t[3]);
        }
        jacobian += 4 * some;
        has_all &= has_rows(xy, small ? nullptr : shapes, some);
        if (!has_all) {
            xy += 2 * some, out += some * c;
            continue;
        }
        done += some;
        for (Index n = 0; n < some; n++, xy += 2, out += c) {
            const Shape &shape = small ? POINT : shapes[n];
            double x = xy[0], y = xy[1];
            if (repeats) x = folded(x, w, Edge::repeat), y = folded(y, h, Edge::repeat);
            // A shortcut with the same result if the pixel is magnified and columns ceil(x - 2.5) .. floor(x + 1.5) are
            // inside the picture, as well as the corresponding rows and one more, since a register extends beyond the
            // last texel's channels.
            if (direct && shape.longest == 1 && x > 1.5 && y > 1.5 && x + 1.5 < double(w) &&
                y + 1.5 < double(h - 1)) {
                const double j = ceil(x - 2.5), i = ceil(y - 2.5);
                magnify(texels + (Index(i) * w + Index(j)) * c, w * c, x - 0.5 - j, y - 0.5 - i, out);
            } else {
                stretched(x, y, shape, out);
            }
        }
    }
    return done;
}

// The number of the level that a kernel reads.
template <typename Stored>
inline Index Filter<Stored>::level_of(const Shape &shape) const {
    Index number = 0;
    while (number + 1 < picture.level_count && shape.shortest >= double(picture.level(number + 1).size)) number++;
    return number;
}

// Whether all rows are present that kernels of these shapes read at points xy (count, 2); null for kernels of one texel.
//
// The rows are bounded for all points together, which is quick and asks for few rows that are not read.
template <typename Stored>
bool Filter<Stored>::has_rows(const double *xy, const Shape *shapes, Index count) const {
    constexpr double FAR = 1e12;    // texels; where coordinates are farther out or not finite, all rows are wanted
    constexpr Index MARGIN = 2;     // rows, for rounding and registers that extend beyond a row
    constexpr double DIAGONAL = 1.4143;  // a square as long as the kernel's longest axis contains it in any orientation
    const double h = double(picture.level(0).height);
    double low = 1e300, high = -1e300, longest = 1;
    Index finest = 0, coarsest = 0;
    bool near = true;
    for (Index n = 0; n < count; n++) {
        double y = xy[2 * n + 1];
        near &= fabs(y) < FAR;
        if (edge == Edge::repeat) y = folded(y, picture.level(0).height, edge);
        low = min(low, y), high = max(high, y);
    }
    if (shapes) {
        const Shape *least = shapes, *most = shapes;
        for (const Shape *shape = shapes; shape < shapes + count; shape++) {
            if (shape->shortest < least->shortest) least = shape;
            if (shape->shortest > most->shortest) most = shape;
            longest = max(longest, shape->longest);
        }
        finest = level_of(*least), coarsest = level_of(*most);
    }
    const double reach = DIAGONAL * radius(kernel) * longest;
    bool all = true;
    for (Index number = finest; number <= coarsest; number++) {
        const Level &level = picture.level(number);
        if (!near || !(reach < FAR)) {
            all &= picture.has(level, 0, level.height - 1);
            continue;
        }
        // rows of a picture that repeats are those of the level scaled to fit, see `stretched`
        const double size = periodic ? h / double(level.height) : double(level.size);
        all &= picture.has(level, round_down((low - reach) / size) - MARGIN, round_up((high + reach) / size) + MARGIN);
    }
    return all;
}

// The value at texel coordinates x, y for a kernel of any shape.
template <typename Stored>
void Filter<Stored>::stretched(double x, double y, Shape shape, float *out) {
    constexpr bool STORED_READY = sizeof(Stored) == sizeof(float);
    const Index c = picture.channels;
    const Level &whole_picture = picture.level(0);
    const Index number = level_of(shape);
    const Level level = picture.level(number);
    const double size = double(level.size);
    const Index w = level.width, h = level.height;
    if (shape.shortest >= 4 * size)  // beyond the last level: average the whole picture
        shape.p = 0.25 / size, shape.q = 0, shape.r = 0.25 / size;
    if (number) {
        x /= size, y /= size;
        shape.p *= size, shape.q *= size, shape.r *= size;
        if (periodic) {  // the last texel of a level may extend beyond the picture: scale the level to fit
            x = x * size * double(w) / double(whole_picture.width);
            y = y * size * double(h) / double(whole_picture.height);
        }
    }
    const double reach = radius(kernel) / (shape.p * shape.r - shape.q * shape.q);
    const double reach_x = reach * (fabs(shape.r) + fabs(shape.q)), reach_y = reach * (fabs(shape.p) + fabs(shape.q));
    const Index j = round_up(x - reach_x - 0.5), i = round_up(y - reach_y - 0.5);
    const Index columns = min(round_down(x + reach_x - 0.5) - j + 1, MOST);
    const Index rows = min(round_down(y + reach_y - 0.5) - i + 1, MOST);
    x = x - 0.5 - double(j), y = y - 0.5 - double(i);
    // one more row, since COLUMNS texels are read at a time
    const bool there = i >= 0 && j >= 0 && i + rows < h && j + columns <= w && w >= COLUMNS;
    const float *texels = scratch.data;
    Index row = columns * c;
    if (there && number) {
        texels = picture.texels + (level.start + i * w + j) * c, row = w * c;
    } else if (there && STORED_READY) {
        texels = picture.stored<float>() + (i * w + j) * c, row = w * c;
    } else {
        copy(number, i, j, rows, columns);
    }
    switch (kernel) {
        case Kernel::linear: return weigh<Kernel::linear>(texels, row, rows, columns, x, y, shape, out);
        case Kernel::cubic: return weigh<Kernel::cubic>(texels, row, rows, columns, x, y, shape, out);
        case Kernel::lanczos: return weigh<Kernel::lanczos>(texels, row, rows, columns, x, y, shape, out);
    }
}

}  // namespace iccm
