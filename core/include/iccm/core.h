// Definitions that every kernel uses: exported functions, complex numbers, and the few functions that must agree with
// Python's and NumPy's to the last bit.
#pragma once

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#define ICCM_EXPORT extern "C" __declspec(dllexport)
#else
#define ICCM_EXPORT extern "C" __attribute__((visibility("default")))
#endif

namespace iccm {

using Index = int64_t;

// Returned by functions that fail to allocate memory; the binding raises MemoryError.
constexpr Index OUT_OF_MEMORY = INT64_MIN;

// Python's min and max: the first argument unless the second one is smaller (larger), also if one is NaN.
template <typename T>
inline T min(T a, T b) {
    return b < a ? b : a;
}

template <typename T>
inline T max(T a, T b) {
    return b > a ? b : a;
}

template <typename T>
inline void swap(T &a, T &b) {
    T first = a;
    a = b;
    b = first;
}

// Python's a // b and a % b of integers: the quotient is rounded down, the remainder has the sign of b.
inline Index floor_divide(Index a, Index b) {
    Index quotient = a / b;
    return quotient - ((a % b != 0) && ((a < 0) != (b < 0)));
}

inline Index floor_remainder(Index a, Index b) { return a - b * floor_divide(a, b); }

// A complex number as NumPy stores it: a pair of doubles. A point or a vector of the plane, x + iy.
struct Complex {
    double re, im;
};

inline Complex operator+(Complex a, Complex b) { return {a.re + b.re, a.im + b.im}; }
inline Complex operator-(Complex a, Complex b) { return {a.re - b.re, a.im - b.im}; }
inline Complex operator-(Complex a) { return {-a.re, -a.im}; }
inline Complex operator*(Complex a, Complex b) { return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re}; }
inline Complex operator*(double a, Complex b) { return {a * b.re, a * b.im}; }
inline Complex operator*(Complex a, double b) { return {a.re * b, a.im * b}; }
inline Complex operator/(Complex a, double b) { return {a.re / b, a.im / b}; }
inline Complex &operator+=(Complex &a, Complex b) { return a = a + b; }
inline Complex &operator-=(Complex &a, Complex b) { return a = a - b; }
inline bool operator==(Complex a, Complex b) { return a.re == b.re && a.im == b.im; }
inline bool operator!=(Complex a, Complex b) { return !(a == b); }

// The quotient as Smith (Algorithm 116, Communications of the ACM 5, 1962) computes it, without intermediate overflow.
inline Complex operator/(Complex a, Complex b) {
    if (fabs(b.re) >= fabs(b.im)) {
        double ratio = b.im / b.re, size = b.re + b.im * ratio;
        return {(a.re + a.im * ratio) / size, (a.im - a.re * ratio) / size};
    }
    double ratio = b.re / b.im, size = b.re * ratio + b.im;
    return {(a.re * ratio + a.im) / size, (a.im * ratio - a.re) / size};
}

inline Complex conjugate(Complex a) { return {a.re, -a.im}; }
inline double size(Complex a) { return hypot(a.re, a.im); }

// The determinant and the scalar product of two vectors of the plane.
inline double cross(Complex a, Complex b) { return a.re * b.im - a.im * b.re; }
inline double dot(Complex a, Complex b) { return a.re * b.re + a.im * b.im; }

// Twice the signed area of the triangle of vertices a, b, c of z. Rounded: where the sign decides, see orientation.
inline double twice_area(const Complex *z, Index a, Index b, Index c) { return cross(z[b] - z[a], z[c] - z[a]); }

// The rows of an array (n, N) that is given by the pointer to its first number: rows<3>(faces)[t][k].
template <int N, typename T>
inline T (*rows(T *first))[N] {
    return reinterpret_cast<T(*)[N]>(first);
}

// Memory for one call of an exported function, freed when the scope ends. `data` is null if the allocation failed.
template <typename T>
class Buffer {
  public:
    explicit Buffer(Index count) : data(static_cast<T *>(malloc(sizeof(T) * (count > 0 ? count : 1)))) {}
    Buffer(Index count, T value) : Buffer(count) {
        if (data)
            for (Index i = 0; i < count; i++) data[i] = value;
    }
    ~Buffer() { free(data); }
    Buffer(const Buffer &) = delete;
    Buffer &operator=(const Buffer &) = delete;
    explicit operator bool() const { return data != nullptr; }
    T &operator[](Index i) { return data[i]; }
    const T &operator[](Index i) const { return data[i]; }

    T *data;
};

}  // namespace iccm
