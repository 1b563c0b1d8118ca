// Reading a picture at points with the footprint that a map gives a pixel: a mip pyramid and a stretched kernel.
//
// A pixel's footprint in the texture is the ellipse of J, d(texel) / d(pixel). The filter is k(u) k(v) with
// (u, v) = S⁻¹ d, S being the symmetric square root of J Jᵀ with no axis under one texel: elliptical filters as in
// Heckbert, Fundamentals of texture mapping and image warping (1989), with separable kernels in place of Gaussians. It is
// the plain separable kernel where the texture is magnified. Wide kernels read a smaller level of the pyramid.
#pragma once

#include "iccm/lanes.h"
#include "pixels/pyramid.h"

namespace iccm {

enum class Kernel : Index { linear = 1, cubic = 2, lanczos = 3 };

constexpr Index LANES = 4;      // channels that are weighed side by side
constexpr Index COLUMNS = 8;    // texels of a row whose weights are computed side by side
constexpr double LONGEST = 8;   // longest over shortest axis of a kernel: beyond, the short one is widened
constexpr Index MOST = 232;     // rows and columns of a kernel: Lanczos, axes of 32 and 4 texels, leaning by 22.5°

inline double radius(Kernel kernel) {  // in texels
    return kernel == Kernel::linear ? 1.0 : kernel == Kernel::cubic ? 2.0 : 3.0;
}

// Whole numbers from real ones; places that are not finite, or where no picture reaches, become 0.
inline Index whole(double x) { return fabs(x) < 1e15 ? Index(x) : 0; }
inline Index round_down(double x) { return whole(floor(x)); }
inline Index round_up(double x) { return whole(ceil(x)); }

// S⁻¹ = [[p, q], [q, r]], and the axes of S.
struct Shape {
    double p, q, r, longest, shortest;
};

// The shape of the footprint [[xx, xy], [yx, yy]]; one that is not finite counts as a point.
inline Shape footprint(double xx, double xy, double yx, double yy) {
    const Shape point = {1, 0, 1, 1, 1};
    const double e = xx * xx + xy * xy, f = xx * yx + xy * yy, g = yx * yx + yy * yy;
    if (e <= 1 && g <= 1 && (1 - e) * (1 - g) >= f * f) return point;  // no axis over one texel
    const double mean = 0.5 * (e + g), half = 0.5 * (e - g);
    const double root = sqrt(half * half + f * f);
    const double longest = sqrt(max(mean + root, 1.0));
    if (!(longest < 1e12)) return point;
    const double shortest = max(sqrt(max(mean - root, 1.0)), longest / LONGEST);
    if (root <= 1e-6 * mean || longest == 1) return {1 / longest, 0, 1 / longest, longest, longest};
    const double cosine = half / root, sine = f / root;  // of twice the longest axis's angle
    const double middle = 0.5 * (1 / longest + 1 / shortest), deviation = 0.5 * (1 / longest - 1 / shortest);
    return {middle + deviation * cosine, deviation * sine, middle - deviation * cosine, longest, shortest};
}

template <Kernel KERNEL, bool CLAMPED>
void weighed(const float *texels, Index row, Index c, Index rows, Index columns, double x, double y, const Shape &shape,
             float *out);

// Filters a picture at points. `scratch` holds texels that lie beside the picture or that are yet to be decoded.
template <typename Stored>
class Filter {
  public:
    Filter(const Pyramid &picture, Kernel kernel, bool clamped)
        : picture(picture),
          kernel(kernel),
          clamped(clamped),
          edge(picture.outside()),
          periodic(edge == Edge::repeat || edge == Edge::mirror),
          scratch(MOST * MOST * picture.channels + LANES) {}

    explicit operator bool() const { return bool(scratch); }

    // The values at `count` texel coordinates xy (count, 2) with footprints turn (count, 4) into out (count c + LANES,).
    //
    // x is to the right, y down, and the first texel's centre at 0.5. If `clamped`, each channel of a value stays between
    // the least and the greatest of the texels that the kernel reads.
    void values(const double *xy, const double *turn, Index count, float *out);

  private:
    void stretched(double x, double y, Shape shape, float *out);
    template <Kernel KERNEL>
    void weigh(const float *texels, Index row, Index rows, Index columns, double x, double y, const Shape &shape,
               float *out) {
        if (clamped)
            weighed<KERNEL, true>(texels, row, picture.channels, rows, columns, x, y, shape, out);
        else
            weighed<KERNEL, false>(texels, row, picture.channels, rows, columns, x, y, shape, out);
    }
    void copy(Index level, Index i, Index j, Index rows, Index columns);

    const Pyramid &picture;
    const Kernel kernel;
    const bool clamped;
    const Edge edge;
    const bool periodic;
    Buffer<float> scratch;
};

// The place among n texels in a row that a place beyond them repeats; those of edges that do not repeat stay.
inline double folded(double x, Index n, Edge edge) {
    if (edge == Edge::repeat) return x - double(n) * floor(x / double(n));
    if (edge == Edge::mirror) {
        x -= double(2 * n) * floor(x / double(2 * n));
        return min(x, double(2 * n) - x);
    }
    return x;
}

// Catmull-Rom's weights of the four texels around a place t past the first one, 1 <= t <= 2.
struct CatmullRom {
    double weights[4];

    explicit CatmullRom(double t) {
        t -= 1;
        weights[0] = ((-0.5 * t + 1) * t - 0.5) * t;
        weights[1] = (1.5 * t - 2.5) * t * t + 1;
        weights[2] = ((-1.5 * t + 2) * t + 0.5) * t;
        weights[3] = (0.5 * t - 0.5) * t * t;
    }
};

// The plain cubic kernel, which reads 4 × 4 texels; `row` numbers are one row of texels. Writes LANES numbers for each
// LANES channels or fewer.
inline void magnified(const float *texels, Index row, Index c, double x, double y, bool clamped, float *out) {
    const CatmullRom across(x), down(y);
    for (Index part = 0; part < c; part += LANES) {
        const float *texel = texels + part;
        Float4 least = load(texel), most = least;
        Double4 value = {0, 0, 0, 0};
        for (int a = 0; a < 4; a++, texel += row) {
            const Float4 t0 = load(texel), t1 = load(texel + c), t2 = load(texel + 2 * c), t3 = load(texel + 3 * c);
            // two sums of two products each, and rows by themselves: shorter chains of dependent additions
            value += down.weights[a] * ((across.weights[0] * widen(t0) + across.weights[1] * widen(t1)) +
                                        (across.weights[2] * widen(t2) + across.weights[3] * widen(t3)));
            if (clamped) {
                least = lower(lower(lower(t0, t1), lower(t2, t3)), least);
                most = higher(higher(higher(t0, t1), higher(t2, t3)), most);
            }
        }
        Float4 rounded = narrow(value);
        if (clamped) rounded = lower(higher(rounded, least), most);
        store(rounded, out + part);
    }
}

// Catmull-Rom by truncated powers, without branches.
inline Floats cubic(Floats x) {
    const Floats zero = {}, negative = -x;
    x = higher(x, negative);
    const Floats a = higher(1 - x, zero), b = higher(2 - x, zero);
    return 0.5f * b * b * (b - 1) + a * a * (1 - 2 * a);
}

// The tent.
inline Floats linear(Floats x) {
    const Floats zero = {}, negative = -x;
    return higher(1 - higher(x, negative), zero);
}

// Lanczos's kernel with three lobes.
inline double lanczos(double x) {
    x = fabs(x);
    if (x < 1e-9) return 1;
    if (x >= 3) return 0;
    const double a = 3.14159265358979323846 * x;
    return 3 * sin(a) * sin(a / 3) / (a * a);
}

template <Kernel KERNEL>
inline Floats product(Floats u, Floats v) {
    if (KERNEL == Kernel::cubic) return cubic(u) * cubic(v);
    if (KERNEL == Kernel::linear) return linear(u) * linear(v);
    Floats out;
    for (Index b = 0; b < WIDTH; b++) out[b] = float(lanczos(double(u[b])) * lanczos(double(v[b])));
    return out;
}

// The weights k(u) k(v), (u, v) = S⁻¹ d, of rows × COLUMNS texels, zero from column `count` on; their sum.
//
// x, y: the kernel's middle, from the first texel's. In single precision, widened for the sums that follow.
template <Kernel KERNEL>
double weights(const Shape &shape, Index rows, Index count, double x, double y, double *out) {
    const float p = float(shape.p), q = float(shape.q), r = float(shape.r), left = float(x), middle = float(y);
    Double4 total = {0, 0, 0, 0};
    for (Index a = 0; a < rows; a++) {
        const float dy = float(a) - middle;
        for (Index b = 0; b < COLUMNS; b += WIDTH) {
            const Floats column = COUNT + float(b), dx = column - left;
            Floats weight = product<KERNEL>(p * dx + q * dy, q * dx + r * dy);
            weight = column < float(count) ? weight : Floats{};
            for (Index k = 0; k < WIDTH; k += 4, out += 4) {
                Float4 four;
                memcpy(&four, reinterpret_cast<const float *>(&weight) + k, sizeof four);
                const Double4 wide = widen(four);
                memcpy(out, &wide, sizeof wide);
                total += wide;
            }
        }
    }
    return sum(total);
}

// Sums over texels of up to LANES channels, each texel times its weight, and their ranges.
//
// Even and odd columns have sums of their own, so that an addition need not wait for the one before.
template <bool RANGES>
struct Sums {
    Double4 even = {0, 0, 0, 0}, odd = even;
    Float4 least, most;

    explicit Sums(const float *first) : least(load(first)), most(least) {}

    // Texels `stride` numbers apart.
    void add(const double *weights, Index count, const float *texel, Index stride) {
        Index b = 0;
        for (; b + 1 < count; b += 2, texel += 2 * stride) {
            const Float4 one = load(texel), next = load(texel + stride);
            even += weights[b] * widen(one);
            odd += weights[b + 1] * widen(next);
            if (RANGES) least = lower(lower(one, next), least), most = higher(higher(one, next), most);
        }
        if (b == count) return;
        const Float4 last = load(texel);
        even += weights[b] * widen(last);
        if (RANGES) least = lower(last, least), most = higher(last, most);
    }
};

// The mean of rows × columns texels weighed by a kernel; `row` numbers are one row of texels.
//
// Reads and writes LANES numbers where there may be fewer channels. If CLAMPED, each channel stays between the least and the greatest of the texels.
template <Kernel KERNEL, bool CLAMPED>
void weighed(const float *texels, Index row, Index c, Index rows, Index columns, double x, double y, const Shape &shape,
             float *out) {
    double kernel[MOST * COLUMNS];
    for (Index part = 0; part < c; part += LANES) {
        Sums<CLAMPED> sums(texels + part);
        double total = 0;
        for (Index first = 0; first < columns; first += COLUMNS) {
            const Index count = min(COLUMNS, columns - first);
            total += weights<KERNEL>(shape, rows, count, x - double(first), y, kernel);
            for (Index a = 0; a < rows; a++)
                sums.add(kernel + a * COLUMNS, count, texels + a * row + first * c + part, c);
        }
        Float4 mean = narrow((sums.even + sums.odd) * (1 / total));
        if (CLAMPED) mean = lower(higher(mean, sums.least), sums.most);
        store(mean, out + part);
    }
}

// Texels of a level from (i, j) on into `scratch`, ready; beyond the edge what lies there.
template <typename Stored>
void Filter<Stored>::copy(Index number, Index i, Index j, Index rows, Index columns) {
    constexpr Index NOWHERE = -1;
    const Level level = picture.level(number);
    const Index w = level.width, h = level.height, c = picture.channels;
    const bool empty = edge == Edge::clear;
    const float *stored = number ? picture.texels + level.start * c : picture.stored<float>();
    Index sources[MOST];  // the column of the level that each one shows
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
void Filter<Stored>::values(const double *xy, const double *turn, Index count, float *out) {
    const Index c = picture.channels, w = picture.level(0).width, h = picture.level(0).height;
    const bool repeats = edge == Edge::repeat, limited = clamped;
    const bool direct = sizeof(Stored) == sizeof(float) && kernel == Kernel::cubic && w * c >= LANES;
    const float *texels = picture.stored<float>();
    for (Index n = 0; n < count; n++, xy += 2, turn += 4, out += c) {
        double x = xy[0], y = xy[1];
        if (repeats) x = folded(x, w, Edge::repeat), y = folded(y, h, Edge::repeat);
        const Shape shape = footprint(turn[0], turn[1], turn[2], turn[3]);
        // Magnified, and columns ceil(x - 2.5) .. floor(x + 1.5) are there, as are such rows and one more, since a
        // register reaches beyond the last texel's channels: the short way to the same.
        if (direct && shape.longest == 1 && x > 1.5 && y > 1.5 && x + 1.5 < double(w) && y + 1.5 < double(h - 1)) {
            const double j = ceil(x - 2.5), i = ceil(y - 2.5);
            magnified(texels + (Index(i) * w + Index(j)) * c, w * c, c, x - 0.5 - j, y - 0.5 - i, limited, out);
        } else {
            stretched(x, y, shape, out);
        }
    }
}

// The value at texel coordinates x, y for a kernel of any shape.
template <typename Stored>
void Filter<Stored>::stretched(double x, double y, Shape shape, float *out) {
    constexpr bool STORED_READY = sizeof(Stored) == sizeof(float);
    const Index c = picture.channels;
    const Level &whole_picture = picture.level(0);
    Index number = 0;
    while (number + 1 < picture.level_count && shape.shortest >= double(picture.level(number + 1).size)) number++;
    const Level level = picture.level(number);
    const double size = double(level.size);
    const Index w = level.width, h = level.height;
    if (shape.shortest >= 4 * size)  // nothing smaller is left: the whole picture
        shape.p = 0.25 / size, shape.q = 0, shape.r = 0.25 / size;
    if (number) {
        x /= size, y /= size;
        shape.p *= size, shape.q *= size, shape.r *= size;
        if (periodic) {  // the last texel of a level may reach beyond: all share the picture evenly
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
    // a row more, as above
    const bool within = i >= 0 && j >= 0 && i + rows < h && j + columns <= w && w * c >= LANES;
    const float *texels = scratch.data;
    Index row = columns * c;
    if (within && number) {
        texels = picture.texels + (level.start + i * w + j) * c, row = w * c;
    } else if (within && STORED_READY) {
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
