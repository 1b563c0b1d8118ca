// Reading a picture at points with the footprint that a map gives a pixel: a mip pyramid and a stretched kernel.
//
// A pixel's footprint in the texture is the ellipse of J, d(texel) / d(pixel). The filter is k(u) k(v) with (u, v) =
// S⁻¹ d, S being the symmetric square root of J Jᵀ with no axis under one texel: elliptical filters as in Heckbert,
// Fundamentals of texture mapping and image warping (1989), with separable kernels in place of Gaussians. It is the
// plain separable kernel where the texture is magnified. Wide kernels read a smaller level of the pyramid.
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

constexpr Shape POINT = {1, 0, 1, 1, 1};

// J Jᵀ = [[e, f], [f, g]].
struct Gram {
    double e, f, g;

    Gram(double xx, double xy, double yx, double yy)
        : e(xx * xx + xy * xy), f(xx * yx + xy * yy), g(yx * yx + yy * yy) {}

    // Whether no axis is over one texel.
    bool small() const { return (e <= 1) & (g <= 1) & ((1 - e) * (1 - g) >= f * f); }
};

// The shape of the footprint [[xx, xy], [yx, yy]]; one that is not finite counts as a point. Without branches, so that
// those of several pixels are computed side by side.
inline Shape footprint(double xx, double xy, double yx, double yy) {
    const Gram gram(xx, xy, yx, yy);
    const double e = gram.e, f = gram.f, g = gram.g;
    const double mean = 0.5 * (e + g), half = 0.5 * (e - g);
    const double root = sqrt(half * half + f * f);
    const double longest = sqrt(max(mean + root, 1.0));
    const double shortest = max(sqrt(max(mean - root, 1.0)), longest / LONGEST);
    const bool point = gram.small() | !(longest < 1e12);
    const bool round = (root <= 1e-6 * mean) | (longest == 1);
    const double cosine = round ? 0 : half / root, sine = round ? 0 : f / root;  // of twice the longest axis's angle
    const double least = 1 / longest, most = round ? least : 1 / shortest;
    const double middle = 0.5 * (least + most), deviation = 0.5 * (least - most);
    return {point ? 1 : middle + deviation * cosine, point ? 0 : deviation * sine,
            point ? 1 : middle - deviation * cosine, point ? 1 : longest,
            point ? 1 : (round ? longest : shortest)};
}

template <Kernel KERNEL, int C, bool CLAMPED>
void weighed(const float *texels, Index row, Index rows, Index columns, double x, double y, const Shape &shape,
             float *out);
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
          scratch(MOST * MOST * picture.channels + COLUMNS * picture.channels) {}

    explicit operator bool() const { return bool(scratch); }

    // The values at `count` texel coordinates xy (count, 2) with footprints turn (count, 4) into out (count c +
    // LANES,).
    //
    // x is to the right, y down, and the first texel's centre at 0.5. If `clamped`, each channel of a value stays
    // between the least and the greatest of the texels that the kernel reads.
    void values(const double *xy, const double *turn, Index count, float *out);

  private:
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

// The weights k(u) k(v), (u, v) = S⁻¹ d, of COLUMNS texels of a row, zero from column `count` on. In single precision,
// as are the sums that they are for: a mean is off by less than 1e-6 of the greatest texel
// (tests/iccm/pixels/test_filters.py).
struct RowWeights {
    static constexpr Index PARTS = COLUMNS / WIDTH;
    Floats part[PARTS];

    // x: the kernel's middle, from the first texel's. dy: from there to the row.
    template <Kernel KERNEL>
    static RowWeights of(const Shape &shape, Index count, float x, float dy) {
        const float p = float(shape.p), q = float(shape.q), r = float(shape.r);
        RowWeights out;
        for (Index k = 0; k < PARTS; k++) {
            const Floats column = COUNT + float(k * WIDTH), dx = column - x;
            const Floats weight = product<KERNEL>(p * dx + q * dy, q * dx + r * dy);
            out.part[k] = column < float(count) ? weight : Floats{};
        }
        return out;
    }
};

// Registers number PART of a row of texels of C channels: number l belongs to texel l / C and is channel l % C. These
// repeat each weight for the channels of its texel, and a texel's channels for every texel.
#if defined(__AVX__)
template <int C, int PART>
Floats for_each_channel(const RowWeights &weights) {
    constexpr int L = 8 * PART;
    return __builtin_shufflevector(weights.part[0], weights.part[0], L / C, (L + 1) / C, (L + 2) / C, (L + 3) / C,
                                   (L + 4) / C, (L + 5) / C, (L + 6) / C, (L + 7) / C);
}

template <int C, int PART>
Floats for_each_texel(Float4 texel) {
    constexpr int L = 8 * PART;
    return __builtin_shufflevector(texel, texel, L % C, (L + 1) % C, (L + 2) % C, (L + 3) % C, (L + 4) % C,
                                   (L + 5) % C, (L + 6) % C, (L + 7) % C);
}
#else
template <int C, int PART>
Floats for_each_channel(const RowWeights &weights) {
    constexpr int L = 4 * (PART % C);
    const Floats four = weights.part[PART / C];
    return __builtin_shufflevector(four, four, L / C, (L + 1) / C, (L + 2) / C, (L + 3) / C);
}

template <int C, int PART>
Floats for_each_texel(Float4 texel) {
    constexpr int L = 4 * PART;
    return __builtin_shufflevector(texel, texel, L % C, (L + 1) % C, (L + 2) % C, (L + 3) % C);
}
#endif

// A mean within the range of its texels if CLAMPED. All the same the mean of equal texels is what they are, to the last
// bit.
template <bool CLAMPED>
Float4 within(Float4 mean, Float4 least, Float4 most) {
    if (CLAMPED) return lower(higher(mean, least), most);
    return least == most ? least : mean;
}

// Sums over rows of texels, each texel times its weight, and their ranges: column by column, and as the numbers lie in
// memory, so that registers are full for any number of channels.
template <int C>
class RowSums {
  public:
    explicit RowSums(const float *texel) : first(load(texel)) { begin(); }

    // Rows of texels, `stride` numbers apart; COLUMNS texels of each are read, and those from `count` on do not matter.
    // x, y: the kernel's middle, from the first texel's.
    template <Kernel KERNEL>
    void add(const float *texels, Index stride, Index rows, Index count, const Shape &shape, float x, float y) {
        if (count == COLUMNS)
            add<KERNEL, true>(texels, stride, rows, count, shape, x, y);
        else
            add<KERNEL, false>(texels, stride, rows, count, shape, x, y);
    }

    template <bool CLAMPED>
    Float4 mean() const {
        const auto plus = [](Float4 a, Float4 b) { return a + b; };
        const Float4 mean = folded<C>(sums, plus) / folded<1>(totals, plus);
        return within<CLAMPED>(mean, folded<C>(least, lower<Float4>), folded<C>(most, higher<Float4>));
    }

  private:
    static constexpr int PARTS = int(C * COLUMNS / WIDTH);

    template <int PART = 0>
    void begin() {
        if constexpr (PART < PARTS) {
            sums[PART] = Floats{};
            least[PART] = most[PART] = for_each_texel<C, PART>(first);
            begin<PART + 1>();
        }
    }

    template <Kernel KERNEL, bool ALL>
    void add(const float *texels, Index stride, Index rows, Index count, const Shape &shape, float x, float y) {
        RowSums sums = *this;  // in registers
        for (Index a = 0; a < rows; a++, texels += stride)
            sums.template add_row<ALL>(texels, RowWeights::of<KERNEL>(shape, count, x, float(a) - y), float(count * C));
        *this = sums;
    }

    template <bool ALL, int PART = 0>
    void add_row(const float *texels, const RowWeights &weights, float end) {
        if constexpr (PART < PARTS) {
            if constexpr (PART % C == 0) totals[PART / C] += weights.part[PART / C];
            Floats numbers = load_wide(texels + PART * WIDTH);
            if (!ALL) numbers = COUNT + float(PART * WIDTH) < end ? numbers : for_each_texel<C, PART>(first);
            sums[PART] += for_each_channel<C, PART>(weights) * numbers;
            least[PART] = lower(numbers, least[PART]);
            most[PART] = higher(numbers, most[PART]);
            add_row<ALL, PART + 1>(texels, weights, end);
        }
    }

    // Register of four numbers `part` of 2 C.
    static Float4 quarter(const Floats *parts, int part) {
#if defined(__AVX__)
        const Floats eight = parts[part / 2];
        return Float4(part % 2 ? _mm256_extractf128_ps(eight, 1) : _mm256_castps256_ps128(eight));
#else
        return parts[part];
#endif
    }

    // One texel of COLUMNS: those four apart are joined first, then what is left of them in pairs.
    template <int CHANNELS, typename Operation>
    static Float4 folded(const Floats *parts, Operation join) {
        Float4 four[CHANNELS];
        for (int k = 0; k < CHANNELS; k++) four[k] = join(quarter(parts, k), quarter(parts, k + CHANNELS));
        if constexpr (CHANNELS == 1) {
            const Float4 two = join(four[0], __builtin_shufflevector(four[0], four[0], 1, 0, 3, 2));
            return join(two, __builtin_shufflevector(two, two, 2, 3, 0, 1));
        } else if constexpr (CHANNELS == 2) {
            const Float4 two = join(four[0], four[1]);
            return join(two, __builtin_shufflevector(two, two, 2, 3, 0, 1));
        } else if constexpr (CHANNELS == 3) {
            const Float4 second = __builtin_shufflevector(four[0], four[1], 3, 4, 5, 5);
            const Float4 third = __builtin_shufflevector(four[1], four[2], 2, 3, 4, 4);
            const Float4 fourth = __builtin_shufflevector(four[2], four[2], 1, 2, 3, 3);
            return join(join(four[0], second), join(third, fourth));
        } else {
            return join(join(four[0], four[1]), join(four[2], four[3]));
        }
    }

    Float4 first;
    Floats totals[RowWeights::PARTS] = {}, sums[PARTS], least[PARTS], most[PARTS];
};

// The mean of rows × columns texels weighed by a kernel, in single precision; `row` numbers are one row of texels.
//
// Reads COLUMNS texels at a time, and writes LANES numbers where there may be fewer channels. If CLAMPED, each channel
// stays between the least and the greatest of the texels.
template <Kernel KERNEL, int C, bool CLAMPED>
void weighed(const float *texels, Index row, Index rows, Index columns, double x, double y, const Shape &shape,
             float *out) {
    RowSums<C> sums(texels);
    for (Index first = 0; first < columns; first += COLUMNS) {
        const Index count = min(COLUMNS, columns - first);
        sums.template add<KERNEL>(texels + first * C, row, rows, count, shape, float(x - double(first)), float(y));
    }
    store(sums.template mean<CLAMPED>(), out);
}

// The same for any number of channels, LANES of them at a time.
template <Kernel KERNEL, bool CLAMPED>
void weighed(const float *texels, Index row, Index c, Index rows, Index columns, double x, double y, const Shape &shape,
             float *out) {
    for (Index part = 0; part < c; part += LANES) {
        Float4 value = {0, 0, 0, 0}, least = load(texels + part), most = least;
        float total = 0;
        for (Index first = 0; first < columns; first += COLUMNS) {
            const Index count = min(COLUMNS, columns - first);
            const float left = float(x - double(first));
            for (Index a = 0; a < rows; a++) {
                float weights[COLUMNS];
                const RowWeights eight = RowWeights::of<KERNEL>(shape, count, left, float(a) - float(y));
                memcpy(weights, eight.part, sizeof weights);
                const float *texel = texels + a * row + first * c + part;
                for (Index b = 0; b < count; b++, texel += c) {
                    const Float4 four = load(texel);
                    value += weights[b] * four, total += weights[b];
                    least = lower(four, least), most = higher(four, most);
                }
            }
        }
        store(within<CLAMPED>(value / total, least, most), out + part);
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
    // some pixels' shapes before their values: where to read is known early then, and reading does not wait for roots;
    // none where all are magnified
    constexpr Index SOME = 64;
    Shape shapes[SOME];
    for (Index first = 0; first < count; first += SOME) {
        const Index some = min(SOME, count - first);
        bool small = true;
        for (Index n = 0; n < 4 * some; n += 4) small &= Gram(turn[n], turn[n + 1], turn[n + 2], turn[n + 3]).small();
        for (Index n = 0; n < some; n++, turn += 4)
            shapes[n] = small ? POINT : footprint(turn[0], turn[1], turn[2], turn[3]);
        for (Index n = 0; n < some; n++, xy += 2, out += c) {
            double x = xy[0], y = xy[1];
            if (repeats) x = folded(x, w, Edge::repeat), y = folded(y, h, Edge::repeat);
            // Magnified, and columns ceil(x - 2.5) .. floor(x + 1.5) are there, as are such rows and one more, since a
            // register reaches beyond the last texel's channels: the short way to the same.
            if (direct && shapes[n].longest == 1 && x > 1.5 && y > 1.5 && x + 1.5 < double(w) &&
                y + 1.5 < double(h - 1)) {
                const double j = ceil(x - 2.5), i = ceil(y - 2.5);
                magnified(texels + (Index(i) * w + Index(j)) * c, w * c, c, x - 0.5 - j, y - 0.5 - i, limited, out);
            } else {
                stretched(x, y, shapes[n], out);
            }
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
    // a row more, since COLUMNS texels are read at a time
    const bool within = i >= 0 && j >= 0 && i + rows < h && j + columns <= w && w >= COLUMNS;
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
