// The rotation of a map is the argument φ of S = ∫ f_z dA, that is, the rotation of the mean derivative, which is the
// one closest to the map. S is linear in the image. The cost of a map is its energy times (1 + w (1 - cos φ)/2)^q: if
// q = 1, an upside-down map costs 1 + w times as much as an upright one.
#include "minimise/upright.h"

namespace iccm {

namespace {

Complex moment_of(const Upright &upright, const Complex *u, Index n) {
    Complex moment{0, 0};
    for (Index v = 0; v < n; v++) moment += upright.moments[v] * u[v];
    return moment;
}

// The factor of the energy for a rotation with this cosine, at q = 1.
double rotation_cost(double weight, double cosine) { return 1 + 0.5 * weight * (1 - cosine); }

}  // namespace

double rotation_factor(const Upright &upright, const Complex *u, double q, Index n) {
    if (upright.weight == 0) return 1.0;
    Complex moment = moment_of(upright, u, n);
    double length = size(moment);
    return length > 0 ? pow(rotation_cost(upright.weight, moment.re / length), q) : INFINITY;
}

RotationSlopes rotation_derivatives(const Upright &upright, const Complex *u, double q, Complex *turning, Index n) {
    Complex moment = moment_of(upright, u, n);
    if (moment.re == 0 && moment.im == 0) {  // a map so squeezed that its rotation is lost in rounding
        memset(turning, 0, sizeof(Complex) * n);
        return {0.0, 0.0};
    }
    Complex inverse = Complex{1, 0} / moment;
    for (Index v = 0; v < n; v++) {
        Complex share = upright.moments[v] * inverse;
        turning[v] = {share.im, share.re};
    }
    double cosine = moment.re / size(moment), half = 0.5 * upright.weight;
    double factor = rotation_cost(upright.weight, cosine);
    double slope = half * moment.im / size(moment) / factor;
    return {q * slope, q * max(half * cosine / factor - slope * slope, 0.0)};
}

void sherman_morrison(const Complex *turning, const Complex *answer, double curvature, Complex *step, Index n) {
    double along = 0.0, across = 0.0;
    for (Index v = 0; v < n; v++) {
        along += dot(turning[v], step[v]);
        across += dot(turning[v], answer[v]);
    }
    double share = curvature * along / (1 - curvature * across);
    for (Index v = 0; v < n; v++) step[v] += share * answer[v];
}

}  // namespace iccm

using namespace iccm;

ICCM_EXPORT double iccm_minimise_rotation_factor(const Upright *upright, const Complex *u, double q, int64_t n) {
    return rotation_factor(*upright, u, q, n);
}

// Fill in the angle's gradient (n,), and the two slopes (2,).
ICCM_EXPORT int64_t iccm_minimise_rotation_derivatives(const Upright *upright, const Complex *u, double q,
                                                       Complex *turning, double *slopes, int64_t n) {
    auto [first, second] = rotation_derivatives(*upright, u, q, turning, n);
    slopes[0] = first;
    slopes[1] = second;
    return n;
}
