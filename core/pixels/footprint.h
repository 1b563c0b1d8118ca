// The ellipse of a pixel in a texture.
#pragma once

#include "iccm/core.h"

namespace iccm {

constexpr double LONGEST = 8;  // largest ratio of a kernel's axes: beyond it the short one is lengthened

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

    // Whether no axis is longer than one texel.
    bool small() const { return (e <= 1) & (g <= 1) & ((1 - e) * (1 - g) >= f * f); }
};

// The shape of the footprint [[xx, xy], [yx, yy]]; one that is not finite counts as a point. Branch-free, so that the
// shapes of several pixels are computed in parallel.
inline Shape footprint(double xx, double xy, double yx, double yy) {
    const Gram gram(xx, xy, yx, yy);
    const double e = gram.e, f = gram.f, g = gram.g;
    const double mean = 0.5 * (e + g), half = 0.5 * (e - g);
    const double root = sqrt(half * half + f * f);
    const double longest = sqrt(max(mean + root, 1.0));
    const double shortest = max(sqrt(max(mean - root, 1.0)), longest / LONGEST);
    const bool point = gram.small() | !(longest < 1e12);
    const bool round = (root <= 1e-6 * mean) | (longest == 1);
    // cosine and sine of twice the angle of the longest axis
    const double cosine = round ? 0 : half / root, sine = round ? 0 : f / root;
    const double least = 1 / longest, most = round ? least : 1 / shortest;
    const double middle = 0.5 * (least + most), deviation = 0.5 * (least - most);
    return {point ? 1 : middle + deviation * cosine, point ? 0 : deviation * sine,
            point ? 1 : middle - deviation * cosine, point ? 1 : longest,
            point ? 1 : (round ? longest : shortest)};
}

}  // namespace iccm
