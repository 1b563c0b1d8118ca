// The balanced energy (see iccm/density.h), its gradient and its projected Hessian.
//
// The density depends on |a|² and |b|² only, hence its 4 × 4 Hessian has closed-form eigenvectors: a 2 × 2 block of the
// radial directions of a and b, and separately their tangential directions; negative eigenvalues are set to zero (the
// projection of Teran et al., Robust Quasistatic Finite Elements and Flesh Simulation, 2005, in the form of Smith, De
// Goes and Kim, Analytic Eigensystems for Isotropic Distortion Energies, ACM Transactions on Graphics 38, 2019).
#include "minimise/energy.h"

namespace iccm {

namespace {

constexpr double VOID_WEIGHT = 1e-3;      // weight of a virtual triangle's angles relative to the area of its image
constexpr double UNTANGLING_AREA = 0.5;  // weight of the area part while untangling

// The density of a virtual triangle: d + VOID_WEIGHT p/d, the area of its image and a barrier. If not `forward`, p and
// d are those of the inverse map, and the density per area of the image is the same quantity.
Density void_density(double p, double d, bool forward) {
    if (!forward) return {1 + VOID_WEIGHT * p, VOID_WEIGHT, 0.0, 0.0, 0.0, 0.0};
    double shape = VOID_WEIGHT / d;
    return {d + shape * p, shape, 1 - shape * p / d, 0.0, -shape / d, 2 * shape * p / (d * d)};
}

// A density that is finite for folded triangles: (p + ½ (1 + d²)) / (1 + ½), divided by χ = (d + √(ε² + d²))/2 (Garanzha
// et al., Foldover-free maps in 50 lines of code, ACM Transactions on Graphics 40, 2021).
Density untangling_density(double p, double d, double epsilon) {
    double root = sqrt(epsilon * epsilon + d * d);
    double x = d > 0 ? 0.5 * (d + root) : 0.5 * epsilon * epsilon / (root - d);
    double x1 = x / root, x2 = 0.5 * epsilon * epsilon / (root * root * root);
    double area = (d * d + 1) / (2 * x), share = 1 / (1 + UNTANGLING_AREA);
    double area1 = d / x - (d * d + 1) * x1 / (2 * x * x);
    double inverse2 = 2 * x1 * x1 / (x * x * x) - x2 / (x * x);  // second derivative of 1/x
    double area2 = 1 / x - 2 * d * x1 / (x * x) + 0.5 * (d * d + 1) * inverse2;
    return {share * (p / x + UNTANGLING_AREA * area),
            share / x,
            share * (UNTANGLING_AREA * area1 - p * x1 / (x * x)),
            0.0,
            -share * x1 / (x * x),
            share * (p * inverse2 + UNTANGLING_AREA * area2)};
}

struct Wirtinger {
    Complex a, b;  // f_z and f_z̄
};

inline Wirtinger wirtinger(const RestShapes &rest, const Complex *u, Index t) {
    Complex a{0, 0}, b{0, 0};
    for (Index k = 0; k < 3; k++) {
        Complex value = u[rest.corners[3 * t + k]], alpha = rest.gradients[3 * t + k];
        a += alpha * value;
        b += conjugate(alpha) * value;
    }
    return {a, b};
}

bool is_zero(Complex a) { return a.re == 0 && a.im == 0; }

// A symmetric 2 × 2 matrix.
struct Symmetric {
    double first, second, coupling;
};

// The matrix with negative eigenvalues set to zero.
Symmetric projected(double first, double second, double coupling) {
    double middle = 0.5 * (first + second), determinant = first * second - coupling * coupling;
    if (middle >= 0 && determinant >= 0) return {first, second, coupling};
    double radius = sqrt(max(middle * middle - determinant, 0.0));
    if (!(middle + radius > 0)) return {0.0, 0.0, 0.0};
    double share = 0.5 * (middle + radius) / radius, small = middle - radius;
    return {share * (first - small), share * (second - small), share * coupling};
}

// Add the block r aᵀ + s bᵀ + (i x)(i a)ᵀ + (i y)(i b)ᵀ of complex numbers taken as vectors.
inline void add_block(double *block, Complex r, Complex s, Complex x, Complex y, Complex a, Complex b) {
    block[0] += r.re * a.re + s.re * b.re + x.im * a.im + y.im * b.im;
    block[1] += r.re * a.im + s.re * b.im - x.im * a.re - y.im * b.re;
    block[2] += r.im * a.re + s.im * b.re - x.re * a.im - y.re * b.im;
    block[3] += r.im * a.im + s.im * b.im + x.re * a.re + y.re * b.re;
}

}  // namespace

double total(const RestShapes &rest, const Complex *u, const Objective &objective) {
    double energy = 0.0;
    for (Index t = 0; t < rest.m; t++) {
        auto [a, b] = wirtinger(rest, u, t);
        double aa = dot(a, a), bb = dot(b, b), weight = rest.weights[t];
        if (objective.epsilon > 0) {
            energy += fabs(weight) * untangling_density(aa + bb, aa - bb, objective.epsilon).value;
        } else if (!(aa > bb)) {
            return INFINITY;
        } else if (rest.aimed && !is_zero(rest.aims[t])) {
            a -= rest.aims[t];
            energy += weight * (dot(a, a) + bb);
        } else if (weight < 0) {
            energy -= weight * void_density(aa + bb, aa - bb, objective.forward).value;
        } else {
            energy += weight * density(aa + bb, aa - bb, objective.theta, objective.q, objective.share);
        }
    }
    return energy;
}

double assemble(const RestShapes &rest, const Complex *u, const Objective &objective, double *matrix, Complex *gradient,
                Index n, Index e) {
    memset(matrix, 0, sizeof(double) * 4 * e);
    memset(gradient, 0, sizeof(Complex) * n);
    double energy = 0.0;
    for (Index t = 0; t < rest.m; t++) {
        auto [a, b] = wirtinger(rest, u, t);
        bool aimed = objective.epsilon == 0 && rest.aimed && !is_zero(rest.aims[t]);
        if (aimed) a -= rest.aims[t];  // quadratic: its derivatives with respect to a - c and b are those of p
        double aa = dot(a, a), bb = dot(b, b), weight = fabs(rest.weights[t]);
        Density w;
        if (aimed)
            w = {aa + bb, 1.0, 0.0, 0.0, 0.0, 0.0};
        else if (objective.epsilon > 0)
            w = untangling_density(aa + bb, aa - bb, objective.epsilon);
        else if (rest.weights[t] < 0)
            w = void_density(aa + bb, aa - bb, objective.forward);
        else
            w = density_derivatives(aa + bb, aa - bb, objective.theta, objective.q, objective.share);
        energy += weight * w.value;
        double size_a = sqrt(aa), size_b = sqrt(bb);
        // directions of a and b; where one vanishes any direction serves, since its derivatives vanish too
        Complex unit_a = size_a > 1e-140 ? a * (1 / size_a) : Complex{1, 0};
        Complex unit_b = size_b > 1e-140 ? b * (1 / size_b) : Complex{1, 0};
        // The chain rule for p = |a|² + |b|² and d = |a|² - |b|² gives the derivatives with respect to |a| and |b|.
        // Divided by |a| and |b|, they are also the tangential eigenvalues. `radial` is the 2 × 2 block of the radial
        // directions.
        double along_a = 2 * weight * (w.p + w.d), along_b = 2 * weight * (w.p - w.d);
        Symmetric radial = projected(along_a + 4 * weight * (w.pp + 2 * w.pd + w.dd) * aa,
                                     along_b + 4 * weight * (w.pp - 2 * w.pd + w.dd) * bb,
                                     4 * weight * (w.pp - w.dd) * size_a * size_b);
        double around_a = max(along_a, 0.0), around_b = max(along_b, 0.0);
        along_a = along_a * size_a;
        along_b = along_b * size_b;
        // with respect to the values at the corners: through a = Σ α u and b = Σ ᾱ u the eigenvectors become multiples
        // of the hat functions' gradients
        Complex over_a[3], over_b[3];
        for (Index k = 0; k < 3; k++) {
            Complex alpha = rest.gradients[3 * t + k];
            over_a[k] = unit_a * conjugate(alpha);
            over_b[k] = unit_b * alpha;
        }
        const Index *slot = rest.slots + 6 * t;
        for (Index k = 0; k < 3; k++) {
            Complex ka = over_a[k], kb = over_b[k];
            gradient[rest.corners[3 * t + k]] += along_a * ka + along_b * kb;
            Complex r = radial.first * ka + radial.coupling * kb, s = radial.coupling * ka + radial.second * kb;
            Complex x = around_a * ka, y = around_b * kb;
            for (Index m = k; m < 3; m++) add_block(matrix + 4 * *slot++, r, s, x, y, over_a[m], over_b[m]);
        }
    }
    return energy;
}

}  // namespace iccm

using namespace iccm;

// Fill in the Wirtinger gradients of the hat functions of triangles, and their areas.
//
//   corners    (m, 3) triangles of either orientation
//   z          (n,) vertices
//   gradients  (m, 3) α, written: f_z = Σ α u and f_z̄ = Σ ᾱ u for values u at the corners
//   areas      (m,) written, positive
ICCM_EXPORT int64_t iccm_minimise_hat_gradients(const int64_t *corners, const Complex *z, Complex *gradients,
                                                double *areas, int64_t m) {
    for (Index t = 0; t < m; t++) {
        Complex a = z[corners[3 * t]], b = z[corners[3 * t + 1]], c = z[corners[3 * t + 2]];
        double area = 0.5 * cross(b - a, c - a);
        Complex scale{0.0, -0.25 / area};
        gradients[3 * t] = scale * conjugate(c - b);
        gradients[3 * t + 1] = scale * conjugate(a - c);
        gradients[3 * t + 2] = scale * conjugate(b - a);
        areas[t] = fabs(area);
    }
    return m;
}

ICCM_EXPORT double iccm_minimise_total(const RestShapes *rest, const Complex *u, const Objective *objective) {
    return total(*rest, u, *objective);
}

ICCM_EXPORT double iccm_minimise_assemble(const RestShapes *rest, const Complex *u, const Objective *objective,
                                          double *matrix, Complex *gradient, int64_t n, int64_t e) {
    return assemble(*rest, u, *objective, matrix, gradient, n, e);
}

// The smallest determinant |f_z|² - |f_z̄|² of all triangles.
ICCM_EXPORT double iccm_minimise_least_determinant(const RestShapes *rest, const Complex *u) {
    double least = INFINITY;
    for (Index t = 0; t < rest->m; t++) {
        auto [a, b] = wirtinger(*rest, u, t);
        least = min(least, dot(a, a) - dot(b, b));
    }
    return least;
}
