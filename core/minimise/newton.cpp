// Projected Newton for a map without folds whose outline slides on the target's.
//
// Every accepted step keeps all triangles positive (Smith and Schaefer, Bijective Parameterization with Free Boundaries,
// ACM Transactions on Graphics 34, 2015, for the largest step) and the outline's vertices in order, and lowers the energy
// (Armijo, Minimization of Functions Having Lipschitz Continuous First Partial Derivatives, Pacific Journal of
// Mathematics 16, 1966).
//
// How far a step is tried first, and what is accepted, depends on what it is for:
//
//   descending_step  of a map without folds
//   moving_step      held vertices have a way to go to their goals: it is imposed on the step, the others take the step
//                    that is best with it (the gradient is g + H r), and the energy may grow
//   untangling_step  folds are allowed (epsilon > 0)
#include "minimise/energy.h"
#include "minimise/in_space.h"
#include "minimise/line_search.h"
#include "minimise/sliding.h"
#include "minimise/terms.h"
#include "minimise/upright.h"

namespace iccm {

namespace {

constexpr double SHARE_OF_FLIP = 0.95;      // of the largest step without a fold
constexpr double SHARE_WHILE_MOVING = 0.9;  // likewise: more leaves triangles too thin to move on
constexpr double ARMIJO = 1e-5;             // share of the slope that a step must gain
constexpr double LONGEST = 0.5;             // of the energy: steps are at most 1 / (1 - LONGEST) of Newton's
constexpr double GROWTH = 1.5;              // of the energy in one step while vertices move
// vertices are stuck after CRAWLING steps of a share of their way below CRAWL, none of which is longer than the one before
// by LONGER: without that condition 9 of 60 drags beside a filled hole ended in vain
constexpr double CRAWL = 0.03, LONGER = 1.1;
constexpr Index CRAWLING = 5;
constexpr double REGULAR = 1e-9;           // of the mean diagonal, added to it: the Hessian may be singular
constexpr double SHORT = 0.1, LONG = 0.5;  // of a step in space: after a shorter share the next is damped more
constexpr double DAMPED = 1e-4;            // of the mean diagonal: the first damping

// Adds a share of the mean diagonal to it.
void regularise(const BlockPattern &pattern, double *matrix, double share) {
    double mean = 0.0;
    for (Index v = 0; v < pattern.n; v++) {
        const double *block = matrix + 4 * pattern.diagonal[v];
        mean += 0.5 * (block[0] + block[3]);
    }
    double little = share * mean / double(pattern.n) + 1e-12;
    for (Index v = 0; v < pattern.n; v++) {
        double *block = matrix + 4 * pattern.diagonal[v];
        block[0] += little;
        block[3] += little;
    }
}

// The smallest positive t at which a triangle of u + t · step has no area, a root of a quadratic polynomial for each;
// 1e9 if there is none.
double largest_step(const Index *faces, const Complex *u, const Complex *step, Index m) {
    double best = 1e9;
    for (Index t = 0; t < m; t++) {
        Index a = faces[3 * t], b = faces[3 * t + 1], c = faces[3 * t + 2];
        Complex e = u[b] - u[a], f = u[c] - u[a], de = step[b] - step[a], df = step[c] - step[a];
        double quadratic = cross(de, df), linear = cross(e, df) + cross(de, f), area = cross(e, f);
        if (quadratic >= 0 && linear >= 0) continue;
        double discriminant = linear * linear - 4 * quadratic * area;
        if (discriminant < 0) continue;
        double root = sqrt(discriminant);
        double r = -0.5 * (linear + (linear >= 0 ? root : -root));
        // infinite or NaN where a coefficient vanishes: no comparison holds then
        double first = r / quadratic, second = area / r;
        if (0 < first && first < best) best = first;
        if (0 < second && second < best) best = second;
    }
    return best;
}

}  // namespace

// A mesh whose vertices move: its triangles at rest, and what holds its vertices (iccm/balanced/minimise/newton.py).
struct System {
    BlockPattern pattern;  // of the Hessian
    const int64_t *faces;  // (m, 3) triangles, counter-clockwise
    int64_t m;
    RestShapes rest;
    Constraints constraints;
    Upright upright;
    Terms terms;
    Workspace workspace;
};

namespace {

class Descent {
  public:
    Descent(System &system, const Objective &objective, SurfaceMap *surface, Complex *u, double *tau, bool factorised)
        : system(system), objective(objective), surface(surface), u(u), tau(tau), factorised(factorised),
          space(system.workspace), n(system.pattern.n), c(system.constraints.border.count) {}

    // Steps until two of them gain less than `tolerance` of the energy each, or held vertices are stuck on their way.
    void run(Index steps, double tolerance) {
        for (done = 0; done < steps; done++) {
            evaluate();
            moving = constrain(system.pattern, system.constraints, u, tau, space);
            if (!solve()) {  // rounding has made the Hessian indefinite: what there is is the best that there will be
                energy = factor * energy;
                return;
            }
            // g and s are those of what may change, g·s the slope along the step; released, s is a step in the plane
            double slope = 0.0;
            for (Index v = 0; v < n; v++) slope += dot(space.gradient[v], space.step[v]);
            release(system.constraints, space);
            Trial trial = objective.epsilon > 0 ? untangling_step(slope) : moving ? moving_step() : descending_step(slope);
            if (!trial.accepted) return;
            double gain = accept(trial);
            if (surface) adapt_damping(trial.share);
            bool ends = moving ? stuck(trial.share) : small_gains(gain, tolerance);
            if (ends) {
                done++;
                return;
            }
        }
    }

    double energy = INFINITY;
    Index done = 0, small = 0;  // steps made, and how many of the last ones gained less than the tolerance

  private:
    // Fills in energy and derivatives, those of the product with the factor of the rotation where there is one: energy
    // stands for the first factor, `factor` for the second.
    void evaluate() {
        Index e = system.pattern.e;
        energy = surface ? assemble_in_space(system.rest, *surface, u, objective, space.matrix, space.gradient, n, e)
                         : assemble(system.rest, u, objective, space.matrix, space.gradient, n, e);
        energy += border_energy(system.constraints.border, tau);
        if (system.terms.derivatives) energy += system.terms.derivatives(u, space.matrix, space.gradient);
        if (!(system.upright.weight > 0)) return;
        auto [slope, second] = rotation_derivatives(system.upright, u, objective.q, space.turning, n);
        curvature = second;
        for (Index v = 0; v < n; v++) space.gradient[v] += energy * slope * space.turning[v];
        factor = rotation_factor(system.upright, u, objective.q, n);
    }

    // Fills in the Newton step -H⁻¹ g; false where H is not positive definite.
    bool solve() {
        regularise(system.pattern, space.matrix, REGULAR + damping);
        if (factorised)
            forward_substitute(system.pattern, space.gradient, space.factor);
        else if (!factorise(system.pattern, space.matrix, space.gradient, space.factor))
            return false;
        back_substitute(system.pattern, space.factor, space.step);
        if (curvature > 0) {  // the rotation's second derivative couples all vertices: a change of rank one
            project_on_directions(system.constraints, space.directions, space.turning);
            forward_substitute(system.pattern, space.turning, space.factor);
            back_substitute(system.pattern, space.factor, space.answer);
            sherman_morrison(space.turning, space.answer, energy * curvature, space.step, n);
        }
        return true;
    }

    // A step of Newton's method for log E: the same direction as for E, longer by 1/(1 - λ²/E) with λ² = gᵀH⁻¹g. Where one
    // squeezed triangle makes up the energy, as x⁻⁶ does, Newton's own step widens it by a seventh only, this one doubles
    // it; where none does the two are the same.
    Trial descending_step(double slope) {
        double newton = 1 / (1 + max(slope / energy, -LONGEST));
        return armijo(largest_share(newton, SHARE_OF_FLIP), slope);
    }

    // The whole way of held vertices to their goals, or as much of it as no triangle folds for.
    Trial moving_step() {
        double share = largest_share(1.0, SHARE_WHILE_MOVING);
        energy = factor * energy;
        return line_search(share, [&](double part) { return energy_at(part); }, [&](double) { return GROWTH * energy; });
    }

    // Newton's own step, which may fold triangles.
    Trial untangling_step(double slope) { return armijo(1.0, slope); }

    // The line search from a share on until the energy falls by a share of what the slope promises (Armijo's condition).
    Trial armijo(double share, double slope) {
        energy = factor * energy;
        slope = factor * slope;
        return line_search(
            share, [&](double part) { return energy_at(part); },
            [&](double part) { return energy + ARMIJO * part * slope; });
    }

    // The share, or as much of it as keeps the curves' vertices in order, and a part `most` of the one that folds a
    // triangle.
    double largest_share(double share, double most) {
        share = gap_limit(system.constraints.border, tau, space.slide, share);
        return min(share, most * largest_step(system.faces, u, space.step, system.m));
    }

    // The energy where a share of the step leads, which is filled in.
    double energy_at(double share) {
        move(system.constraints, u, tau, share, space, n);
        double found = border_energy(system.constraints.border, space.new_tau);
        if (!(found < INFINITY)) return found;
        found += surface ? total_in_space(system.rest, *surface, space.new_u, objective)
                         : total(system.rest, space.new_u, objective);
        if (system.terms.total && found < INFINITY) found += system.terms.total(space.new_u);
        return found * rotation_factor(system.upright, space.new_u, objective.q, n);
    }

    // Goes where the line search came to last; what was gained.
    double accept(const Trial &trial) {
        double gain = energy - trial.energy;
        memcpy(u, space.new_u, sizeof(Complex) * n);
        memcpy(tau, space.new_tau, sizeof(double) * c);
        energy -= gain;
        return gain;
    }

    // Levenberg and Marquardt: between the triangles of a surface the energy has corners, of which its derivatives know
    // nothing; after a step that was cut short the next is damped more, after a long one less.
    void adapt_damping(double share) {
        if (share < SHORT)
            damping = max(10 * damping, DAMPED);
        else if (share > LONG)
            damping *= 0.1;
    }

    // Whether vertices on the way to their goals hardly get ahead.
    bool stuck(double share) {
        crawling = share < min(CRAWL, LONGER * before) ? crawling + 1 : 0;
        before = share;
        return crawling == CRAWLING;
    }

    bool small_gains(double gain, double tolerance) {
        small = gain < tolerance * (energy + gain) ? small + 1 : 0;
        return small == 2;
    }

    System &system;
    const Objective &objective;
    SurfaceMap *surface;
    Complex *u;
    double *tau;
    bool factorised;
    Workspace &space;
    Index n, c, crawling = 0;
    double before = INFINITY, damping = 0.0, factor = 1.0, curvature = 0.0;
    bool moving = false;
};

Index descend(System &system, const Objective &objective, SurfaceMap *surface, Complex *u, double *tau, bool factorised,
              Index steps, double tolerance, double *energy, Index *counts) {
    Descent descent(system, objective, surface, u, tau, factorised);
    descent.run(steps, tolerance);
    *energy = descent.energy;
    counts[0] = descent.done;
    counts[1] = descent.small;
    return descent.done;
}

}  // namespace

}  // namespace iccm

using namespace iccm;

// See above, and `largest_step` of newton.py.
ICCM_EXPORT double iccm_minimise_largest_step(const int64_t *faces, const Complex *u, const Complex *step, int64_t m) {
    return largest_step(faces, u, step, m);
}

// The one step that leads to the least of a quadratic energy, whose derivatives are in the workspace. Returns 1, or 0
// where the matrix is not positive definite.
//
//   u    (n,) positions, changed
//   tau  (c,) arclengths of the constrained vertices, changed
ICCM_EXPORT int64_t iccm_minimise_quadratic_step(System *system, Complex *u, double *tau) {
    Workspace &space = system->workspace;
    const BlockPattern &pattern = system->pattern;
    constrain(pattern, system->constraints, u, tau, space);
    regularise(pattern, space.matrix, REGULAR);
    if (!factorise(pattern, space.matrix, space.gradient, space.factor)) return 0;
    back_substitute(pattern, space.factor, space.step);
    release(system->constraints, space);
    move(system->constraints, u, tau, 1.0, space, pattern.n);
    memcpy(u, space.new_u, sizeof(Complex) * pattern.n);
    memcpy(tau, space.new_tau, sizeof(double) * system->constraints.border.count);
    return 1;
}

// A descent of a map in the plane.
//
//   u           (n,) positions on the side that moves, changed; without folds unless epsilon > 0, sliding vertices on
//               their rails at tau
//   tau         (c,) arclengths of the constrained vertices, increasing along each curve, changed
//   factorised  whether the factor that is there serves for all steps: near the end little changes
//   steps       the most there may be
//   tolerance   relative decrease that counts as none; after two such steps the descent ends
//   energy      (1,) written
//   counts      (2,) steps made, and how many of the last ones gained less than the tolerance, written
ICCM_EXPORT int64_t iccm_minimise_descend(System *system, const Objective *objective, Complex *u, double *tau,
                                          bool factorised, int64_t steps, double tolerance, double *energy,
                                          int64_t *counts) {
    return descend(*system, *objective, nullptr, u, tau, factorised, steps, tolerance, energy, counts);
}

// The same of a map onto a surface in space.
ICCM_EXPORT int64_t iccm_minimise_descend_in_space(System *system, const Objective *objective, SurfaceMap *surface,
                                                   Complex *u, double *tau, bool factorised, int64_t steps,
                                                   double tolerance, double *energy, int64_t *counts) {
    return descend(*system, *objective, surface, u, tau, factorised, steps, tolerance, energy, counts);
}
