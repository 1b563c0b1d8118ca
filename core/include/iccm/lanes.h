// Vectors of a few numbers in wide registers (vector extensions of GCC and Clang). The compiler splits operations that
// the processor lacks.
#pragma once

#include "iccm/core.h"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace iccm {

typedef float Float4 __attribute__((vector_size(16)));
typedef double Double4 __attribute__((vector_size(32)));
// As many single-precision numbers as a register holds.
#if defined(__AVX__)
typedef float Floats __attribute__((vector_size(32)));
constexpr Index WIDTH = 8;
constexpr Floats COUNT = {0, 1, 2, 3, 4, 5, 6, 7};
#else
typedef float Floats __attribute__((vector_size(16)));
constexpr Index WIDTH = 4;
constexpr Floats COUNT = {0, 1, 2, 3};
#endif

// Load four numbers from an unaligned address, and store them.
inline Float4 load(const float *numbers) {
    Float4 four;
    memcpy(&four, numbers, sizeof four);
    return four;
}

inline Double4 load(const double *numbers) {
    Double4 four;
    memcpy(&four, numbers, sizeof four);
    return four;
}

inline void store(Float4 four, float *numbers) { memcpy(numbers, &four, sizeof four); }

// Single as double precision, and back. (GCC 12 splits the general form even where one instruction would do.)
inline Double4 widen(Float4 four) {
#if defined(__AVX__)
    return Double4(_mm256_cvtps_pd(four));
#else
    return __builtin_convertvector(four, Double4);
#endif
}

inline Float4 narrow(Double4 four) {
#if defined(__AVX__)
    return Float4(_mm256_cvtpd_ps(four));
#else
    return __builtin_convertvector(four, Float4);
#endif
}

inline double sum(Double4 four) { return (four[0] + four[2]) + (four[1] + four[3]); }

// The lower and the higher one of each pair; `b` if either is NaN. (Where one number is zero, GCC 12 would use two
// instructions instead of one.)
template <typename Lanes>
inline Lanes lower(Lanes a, Lanes b) {
    return a < b ? a : b;
}

template <typename Lanes>
inline Lanes higher(Lanes a, Lanes b) {
    return a > b ? a : b;
}

#if defined(__SSE2__)
template <>
inline Float4 lower(Float4 a, Float4 b) {
    return Float4(_mm_min_ps(a, b));
}

template <>
inline Float4 higher(Float4 a, Float4 b) {
    return Float4(_mm_max_ps(a, b));
}
#endif

#if defined(__AVX__)
template <>
inline Floats lower(Floats a, Floats b) {
    return Floats(_mm256_min_ps(a, b));
}

template <>
inline Floats higher(Floats a, Floats b) {
    return Floats(_mm256_max_ps(a, b));
}
#endif

inline Floats load_wide(const float *numbers) {
    Floats wide;
    memcpy(&wide, numbers, sizeof wide);
    return wide;
}

}  // namespace iccm
