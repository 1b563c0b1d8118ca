// The density of the balanced energy, as a function of a linear map.
//
// With Wirtinger derivatives a = f_z, b = f_z̄, p = |a|² + |b|² (half the sum of the squared singular values) and
// d = |a|² - |b|² (their product), it is
//
//     W = [ p/d · ((d + 1/d)/2)^θ ]^q · (1 - s + s d)
//
// p/d is 1 where the map is conformal, (d + 1/d)/2 is 1 where it preserves areas, and the last factor is the measure:
// the areas of source and image with weights 1 - s and s. With s = ½ a map and its inverse have the same energy.
#pragma once

#include "iccm/core.h"

namespace iccm {

// A density and its derivatives with respect to p and d.
struct Density {
    double value, p, d, pp, pd, dd;
};

// base^exponent, without a logarithm for the most common exponents.
inline double power(double base, double exponent) {
    if (exponent == 1.0) return base;
    if (exponent == 2.0) return base * base;
    if (exponent == 0.0) return 1.0;
    return pow(base, exponent);
}

// W for d > 0.
inline double density(double p, double d, double theta, double q, double share) {
    double core = p / d * power(0.5 * (d + 1 / d), theta);
    return core * power(core, q - 1) * (1 - share + share * d);
}

inline Density density_derivatives(double p, double d, double theta, double q, double share) {
    double inverse = 1 / d;
    // the area part A = (d + 1/d)/2 and its derivatives, then A^θ and its derivatives
    double area = 0.5 * (d + inverse), area1 = 0.5 * (1 - inverse * inverse), area2 = inverse * inverse * inverse;
    double grown = power(area, theta), less = 1 / area;
    double grown1 = theta * grown * less * area1;
    double grown2 = theta * grown * less * ((theta - 1) * less * area1 * area1 + area2);
    // the bracket C = p/d A^θ
    double core_p = grown * inverse;
    double core = p * core_p, core_pd = (grown1 - core_p) * inverse;
    double core_d = p * core_pd;
    double core_dd = p * inverse * (grown2 - 2 * core_pd);
    // C^q by the chain rule
    double value = core, first = 1.0, second = 0.0;
    if (q > 1) {
        double below = power(core, q - 2);
        first = q * below * core;
        second = q * (q - 1) * below;
        value = below * core * core;
    }
    double pp = second * core_p * core_p, pd = first * core_pd + second * core_p * core_d;
    double dd = first * core_dd + second * core_d * core_d;
    core_p = first * core_p;
    core_d = first * core_d;
    // times the measure, by the product rule
    double measure = 1 - share + share * d;
    return {value * measure,
            core_p * measure,
            core_d * measure + share * value,
            pp * measure,
            pd * measure + share * core_p,
            dd * measure + 2 * share * core_d};
}

}  // namespace iccm
