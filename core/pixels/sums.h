// Means of texels weighed by kernels, many numbers at a time.
//
// Weights and sums are in single precision: a mean is off by less than 1e-6 of the greatest texel
// (tests/iccm/pixels/test_filters.py). Sums are split in the same way on every processor.
#pragma once

#include "pixels/footprint.h"
#include "pixels/kernels.h"

namespace iccm {

constexpr Index LANES = 4;    // channels that are weighed at a time
constexpr Index COLUMNS = 8;  // texels of a row whose weights are computed at a time

// The weights k(u) k(v), (u, v) = S⁻¹ d, of COLUMNS texels of a row, zero from column `count` on.
struct RowWeights {
    static constexpr Index PARTS = COLUMNS / WIDTH;
    Floats part[PARTS];

    // x is the kernel's centre relative to the first texel's; dy is the row's offset from the kernel's centre.
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

// Register PART of a row of texels with C channels, where number l is channel l % C of texel l / C. These functions
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

// A mean, limited to the range of its texels if CLAMPED. In either case the mean of equal texels equals them to the
// last bit.
template <bool CLAMPED>
Float4 bounded(Float4 mean, Float4 least, Float4 most) {
    if (CLAMPED) return lower(higher(mean, least), most);
    return least == most ? least : mean;
}

inline Float4 plus(Float4 a, Float4 b) { return a + b; }

// Combine four texels, stored in C registers, into one.
template <int C, typename Operation>
Float4 joined(const Float4 *four, Operation join) {
    if constexpr (C == 1) {
        const Float4 two = join(four[0], __builtin_shufflevector(four[0], four[0], 1, 0, 3, 2));
        return join(two, __builtin_shufflevector(two, two, 2, 3, 0, 1));
    } else if constexpr (C == 2) {
        const Float4 two = join(four[0], four[1]);
        return join(two, __builtin_shufflevector(two, two, 2, 3, 0, 1));
    } else if constexpr (C == 3) {
        const Float4 second = __builtin_shufflevector(four[0], four[1], 3, 4, 5, 5);
        const Float4 third = __builtin_shufflevector(four[1], four[2], 2, 3, 4, 4);
        const Float4 fourth = __builtin_shufflevector(four[2], four[2], 1, 2, 3, 3);
        return join(join(four[0], second), join(third, fourth));
    } else {
        return join(join(four[0], four[1]), join(four[2], four[3]));
    }
}

// Four numbers of several registers: those from 4 part on.
inline Float4 quarter(const Floats *registers, int part) {
#if defined(__AVX__)
    const Floats eight = registers[part / 2];
    return Float4(part % 2 ? _mm256_extractf128_ps(eight, 1) : _mm256_castps256_ps128(eight));
#else
    return registers[part];
#endif
}

// Combine COLUMNS texels into one: first those four apart.
template <int C, typename Operation>
Float4 eighth(const Floats *parts, Operation join) {
    Float4 four[C];
    for (int k = 0; k < C; k++) four[k] = join(quarter(parts, k), quarter(parts, k + C));
    return joined<C>(four, join);
}

// Sums over rows of texels, each texel times its weight, and the texels' ranges: kept by column, in the memory order of
// the numbers, so that registers are full for any number of channels.
template <int C>
class RowSums {
  public:
    explicit RowSums(const float *texel) : first(load(texel)) { begin(); }

    // Add rows of texels, `stride` numbers apart; COLUMNS texels of each are read, and those from `count` on are
    // ignored. x, y: the kernel's centre relative to the first texel's.
    template <Kernel KERNEL>
    void add(const float *texels, Index stride, Index rows, Index count, const Shape &shape, float x, float y) {
        if (count == COLUMNS)
            add<KERNEL, true>(texels, stride, rows, count, shape, x, y);
        else
            add<KERNEL, false>(texels, stride, rows, count, shape, x, y);
    }

    template <bool CLAMPED>
    Float4 mean() const {
        const Float4 mean = eighth<C>(sums, plus) / eighth<1>(totals, plus);
        return bounded<CLAMPED>(mean, eighth<C>(least, lower<Float4>), eighth<C>(most, higher<Float4>));
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

    Float4 first;
    Floats totals[RowWeights::PARTS] = {}, sums[PARTS], least[PARTS], most[PARTS];
};

// The mean of rows × columns texels weighed by a kernel, in single precision; `row` numbers are one row of texels.
//
// Reads COLUMNS texels at a time, and writes LANES numbers even if there are fewer channels. If CLAMPED, each channel
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
        Float4 even = {0, 0, 0, 0}, odd = even, least = load(texels + part), most = least;
        Floats totals[RowWeights::PARTS] = {};
        for (Index first = 0; first < columns; first += COLUMNS) {
            const Index count = min(COLUMNS, columns - first);
            const float left = float(x - double(first));
            for (Index a = 0; a < rows; a++) {
                float weights[COLUMNS];
                const RowWeights eight = RowWeights::of<KERNEL>(shape, count, left, float(a) - float(y));
                memcpy(weights, eight.part, sizeof weights);
                for (Index k = 0; k < RowWeights::PARTS; k++) totals[k] += eight.part[k];
                const float *texel = texels + a * row + first * c + part;
                for (Index b = 0; b < count; b++, texel += c) {
                    const Float4 four = load(texel);
                    (b % 2 ? odd : even) += weights[b] * four;
                    least = lower(four, least), most = higher(four, most);
                }
            }
        }
        const Float4 mean = (even + odd) / eighth<1>(totals, plus);
        store(bounded<CLAMPED>(mean, least, most), out + part);
    }
}

// Register PART of four texels of C channels: each weight for the channels of its texel.
template <int C, int PART>
Float4 for_each_channel(Float4 weights) {
    constexpr int L = 4 * PART;
    return __builtin_shufflevector(weights, weights, L / C, (L + 1) / C, (L + 2) / C, (L + 3) / C);
}

// The mean of 4 × 4 texels weighed by the plain cubic kernel, with x and y relative to the first texel; other arguments
// are those of `weighed`. Columns are summed first, in the memory order of the numbers.
template <int C, bool CLAMPED>
void magnified(const float *texels, Index row, double x, double y, float *out) {
    const Float4 across = catmull_rom(float(x - 1)), down = catmull_rom(float(y - 1));
    Float4 sums[C], least[C], most[C];
    for (int k = 0; k < C; k++, texels += 4) {
        const Float4 r0 = load(texels), r1 = load(texels + row), r2 = load(texels + 2 * row),
                     r3 = load(texels + 3 * row);
        sums[k] = (down[0] * r0 + down[1] * r1) + (down[2] * r2 + down[3] * r3);
        least[k] = lower(lower(r0, r1), lower(r2, r3)), most[k] = higher(higher(r0, r1), higher(r2, r3));
    }
    sums[0] *= for_each_channel<C, 0>(across);
    if constexpr (C > 1) sums[1] *= for_each_channel<C, 1>(across);
    if constexpr (C > 2) sums[2] *= for_each_channel<C, 2>(across);
    if constexpr (C > 3) sums[3] *= for_each_channel<C, 3>(across);
    const Float4 mean = joined<C>(sums, plus);
    store(bounded<CLAMPED>(mean, joined<C>(least, lower<Float4>), joined<C>(most, higher<Float4>)), out);
}

// The same for any number of channels, LANES of them at a time.
template <bool CLAMPED>
void magnified(const float *texels, Index row, Index c, double x, double y, float *out) {
    const Float4 across = catmull_rom(float(x - 1)), down = catmull_rom(float(y - 1));
    for (Index part = 0; part < c; part += LANES) {
        const float *texel = texels + part;
        Float4 value = {0, 0, 0, 0}, least = load(texel), most = least;
        for (int a = 0; a < 4; a++, texel += row) {
            const Float4 t0 = load(texel), t1 = load(texel + c), t2 = load(texel + 2 * c), t3 = load(texel + 3 * c);
            value += down[a] * ((across[0] * t0 + across[1] * t1) + (across[2] * t2 + across[3] * t3));
            least = lower(lower(lower(t0, t1), lower(t2, t3)), least);
            most = higher(higher(higher(t0, t1), higher(t2, t3)), most);
        }
        store(bounded<CLAMPED>(value, least, most), out + part);
    }
}

}  // namespace iccm
