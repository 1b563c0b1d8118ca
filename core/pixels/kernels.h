// Filter kernels, evaluated at several points at a time.
#pragma once

#include "iccm/lanes.h"

namespace iccm {

enum class Kernel : Index { linear = 1, cubic = 2, lanczos = 3 };

inline double radius(Kernel kernel) {  // in texels
    return kernel == Kernel::linear ? 1.0 : kernel == Kernel::cubic ? 2.0 : 3.0;
}

// The Catmull-Rom kernel by truncated powers, without branches.
inline Floats cubic(Floats x) {
    const Floats zero = {}, negative = -x;
    x = higher(x, negative);
    const Floats a = higher(1 - x, zero), b = higher(2 - x, zero);
    return 0.5f * b * b * (b - 1) + a * a * (1 - 2 * a);
}

// The linear (tent) kernel.
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

// Catmull-Rom weights of the four texels around a point at distance t after the second one, 0 <= t <= 1.
inline Float4 catmull_rom(float t) {
    const Float4 one = {0, 1, 0, 0}, linear = {-0.5f, 0, 0.5f, 0};
    const Float4 square = {1, -2.5f, 2, -0.5f}, cube = {-0.5f, 1.5f, -1.5f, 0.5f};
    return ((cube * t + square) * t + linear) * t + one;
}

}  // namespace iccm
