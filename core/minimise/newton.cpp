// Projected Newton's method for a map without folds, whose outline slides on the target's.
//
// Every accepted step keeps all triangles positive (Smith and Schaefer, Bijective Parameterization with Free Boundaries,
// ACM Transactions on Graphics 34, 2015, for the largest step) and the outline's vertices in order, and lowers the energy
// (Armijo, Minimization of Functions Having Lipschitz Continuous First Partial Derivatives, Pacific Journal of
// Mathematics 16, 1966).
//
// The first share that is tried, and what is accepted, depend on the kind of step:
//
//   descending_step  for a map without folds
//   moving_step      held vertices move to their goals: their displacement r is imposed on the step, the others take
//                    the step that is best with it (the gradient is g + H r), and the energy may grow
//   untangling_step  folds are allowed (epsilon > 0)
#include "minimise/energy.h"
#include "minimise/in_space.h"
#include "minimise/line_search.h"
#include "minimise/sliding.h"
#include "minimise/terms.h"
#include "minimise/upright.h"

namespace iccm {

namespace {

constexpr double SHARE_OF_FLIP = 0.95;      // share of the largest step without a fold
constexpr double SHARE_WHILE_MOVING = 0.9;  // while vertices move: more would leave triangles too thin to continue
constexpr double ARMIJO = 1e-5;             // share of the decrease predicted by the slope that a step must reach
constexpr double LONGEST = 0.5;             // steps are at most 1 / (1 - LONGEST) times Newton's
constexpr double GROWTH = 1.5;              // largest factor of the energy in one step while vertices move
// Vertices are stuck after CRAWLING steps in succession that cover a share of their way below CRAWL and are not longer
// than the previous step by the factor LONGER: without the second condition 9 of 60 drags beside a filled hole failed.
constexpr double CRAWL = 0.03, LONGER = 1.1;
constexpr Index CRAWLING = 5;
constexpr double REGULAR = 1e-9;           // share of the mean diagonal added to it: the Hessian may be singular
constexpr double SHORT = 0.1, LONG = 0.5;  // shares of a step in space: after a shorter one damping increases
constexpr double DAMPED = 1e-4;            // first damping, a share of the mean diagonal
// From this many vertices a factor takes several times as long as the rest of a step. It is used again after a step that
// gained less than a share SMALL_GAIN of the energy, since second derivatives have hardly changed then, as long as each
// such step gains at most a share SLOWING of the gain before. Such steps are shorter, so that they end the descent only
// if they gain less than a share STALE_TOLERANCE of what others may.
constexpr Index LARGE = 20000;
constexpr double SMALL_GAIN = 0.01, SLOWING = 0.5, STALE_TOLERANCE = 0.2;

// Add a share of the mean diagonal to the diagonal.
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

// A mesh whose vertices move: its rest triangles and constraints (iccm/balanced/minimise/newton.py).
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
    Descent(System &system, const Objective &objective, SurfaceMap *surface, Complex *u, double *tau, bool factorised,
            double reach)
        : system(system), objective(objective), surface(surface), u(u), tau(tau), factorised(factorised), reach(reach),
          space(system.workspace), n(system.pattern.n), c(system.constraints.border.count) {}

    // Steps until two in succession gain less than `tolerance` of the energy each, held vertices are stuck on their way,
    // or vertices have moved as far as `reach`.
    void run(Index steps, double tolerance) {
        bool again = factorised;  // whether the factor of an earlier step is used
        double gain_before = INFINITY;
        for (done = 0; done < steps; done++) {
            evaluate();
            moving = constrain(system.pattern, system.constraints, u, tau, space);
            if (!solve(again)) return;  // rounding has made the Hessian indefinite: no further improvement is possible
            // Gradient and step refer to the unknowns that are left when vertices slide (one for each of these), and
            // their product is the slope of the energy along the step, which is negative: -gᵀH⁻¹g. After `release`, the
            // step is one of all vertices in the plane.
            double slope = 0.0;
            for (Index v = 0; v < n; v++) slope += dot(space.gradient[v], space.step[v]);
            release(system.constraints, space);
            measure_step();
            Trial trial = objective.epsilon > 0 ? untangling_step(slope) : moving ? moving_step() : descending_step(slope);
            if (!trial.accepted) {  // the factor of an earlier step can be to blame: repeat the step with a new one
                if (factorised || !again) return;
                again = false;
                continue;
            }
            double gain = accept(trial);
            if (surface) adapt_damping(trial.share);
            bool stale = again && !factorised;
            bool ends = moving ? stuck(trial.share) : small_gains(gain, stale ? STALE_TOLERANCE * tolerance : tolerance);
            if (ends || reach == 0) {
                done++;
                return;
            }
            bool settled = gain < SMALL_GAIN * energy && !(again && gain > SLOWING * gain_before);
            again = factorised || (n >= LARGE && !surface && !moving && settled);
            gain_before = gain;
        }
    }

    double energy = INFINITY;
    Index done = 0, small = 0;  // steps made, and how many of the last ones gained less than the tolerance

  private:
    // Fill in the energy with its derivatives. If the rotation has a cost F, the energy is the product E F, and
    // derivatives are those of the product, divided by F:
    //
    //   gradient  ∇E + E (log F)' ∇φ   with the angle φ of the rotation
    //   Hessian   ∇²E + E (log F)'' ∇φ ∇φᵀ where (log F)'' is positive: `solve` adds this part. The others are left
    //             out; those that mix ∇E and ∇φ could make the Hessian indefinite.
    void evaluate() {
        Index e = system.pattern.e;
        upright_energy = surface ? assemble_in_space(system.rest, *surface, u, objective, space.matrix, space.gradient, n, e)
                         : assemble(system.rest, u, objective, space.matrix, space.gradient, n, e);
        upright_energy += border_energy(system.constraints.border, tau);
        if (system.terms.derivatives) upright_energy += system.terms.derivatives(u, space.matrix, space.gradient);
        energy = upright_energy;
        if (!(system.upright.weight > 0)) return;
        auto [slope, second] = rotation_derivatives(system.upright, u, objective.q, space.turning, n);
        curvature = second;
        for (Index v = 0; v < n; v++) space.gradient[v] += upright_energy * slope * space.turning[v];
        factor = rotation_factor(system.upright, u, objective.q, n);
        energy = factor * upright_energy;
    }

    // Fill in the Newton step -H⁻¹ g, with the factor of an earlier step if `again`; false if H is not positive definite.
    bool solve(bool again) {
        regularise(system.pattern, space.matrix, REGULAR + damping);
        if (again)
            forward_substitute(system.pattern, space.gradient, space.factor);
        else if (!factorise(system.pattern, space.matrix, space.gradient, space.factor))
            return false;
        back_substitute(system.pattern, space.factor, space.step);
        // The rotation's second derivative couples all vertices, so it is not in the matrix: H + c ∇φ ∇φᵀ is inverted by
        // the formula of Sherman and Morrison for changes of rank one.
        if (curvature > 0) {
            project_on_directions(system.constraints, space.directions, space.turning);
            forward_substitute(system.pattern, space.turning, space.factor);
            back_substitute(system.pattern, space.factor, space.answer);
            sherman_morrison(space.turning, space.answer, upright_energy * curvature, space.step, n);
        }
        return true;
    }

    // A step of Newton's method for log E. Its Hessian is H/E - ggᵀ/E², so by the formula of Sherman and Morrison its
    // step has the direction of that for E, and is longer by 1/(1 - λ²/E), where λ² = gᵀH⁻¹g is minus the slope. If one
    // squeezed triangle dominates the energy, as x⁻⁶ does, Newton's own step widens it by a seventh only, whereas this
    // one doubles it; otherwise the two are nearly the same.
    Trial descending_step(double slope) {
        double newton_share = 1 / (1 + max(slope / upright_energy, -LONGEST));
        return armijo(largest_share(newton_share, SHARE_OF_FLIP), slope);
    }

    // The whole way of held vertices to their goals, or the part of it before a triangle folds.
    Trial moving_step() {
        double share = largest_share(1.0, SHARE_WHILE_MOVING);
        return line_search(share, [&](double part) { return energy_at(part); }, [&](double) { return GROWTH * energy; });
    }

    // Newton's own step, which may fold triangles.
    Trial untangling_step(double slope) { return armijo(1.0, slope); }

    // The line search that begins at a share and ends when the energy decreases by a share of what the slope predicts
    // (Armijo's condition).
    Trial armijo(double share, double slope) {
        slope = factor * slope;
        return line_search(
            share, [&](double part) { return energy_at(part); },
            [&](double part) { return energy + ARMIJO * part * slope; });
    }

    // Compute how far the whole step moves vertices, as the root mean square of their displacements, and the share of it
    // with which they use up their reach.
    void measure_step() {
        if (!(reach < INFINITY)) return;
        double sum = 0.0;
        for (Index v = 0; v < n; v++) sum += dot(space.step[v], space.step[v]);
        displacement = sqrt(sum / double(n));
        share_at_reach = reach / displacement;
    }

    // The largest share, up to a given one, that stays within the reach, keeps the curves' vertices in order and is at
    // most `most` times the share at which a triangle folds.
    double largest_share(double share, double most) {
        share = min(share, share_at_reach);
        share = gap_limit(system.constraints.border, tau, space.slide, share);
        return min(share, most * largest_step(system.faces, u, space.step, system.m));
    }

    // The energy after a share of the step; fills in the positions there.
    double energy_at(double share) {
        move(system.constraints, u, tau, share, space, n);
        double found = border_energy(system.constraints.border, space.new_tau);
        if (!(found < INFINITY)) return found;
        found += surface ? total_in_space(system.rest, *surface, space.new_u, objective)
                         : total(system.rest, space.new_u, objective);
        if (system.terms.total && found < INFINITY) found += system.terms.total(space.new_u);
        return found * rotation_factor(system.upright, space.new_u, objective.q, n);
    }

    // Accepts the last trial of the line search; returns the decrease in energy.
    double accept(const Trial &trial) {
        double gain = energy - trial.energy;
        memcpy(u, space.new_u, sizeof(Complex) * n);
        memcpy(tau, space.new_tau, sizeof(double) * c);
        energy -= gain;
        if (reach < INFINITY) reach = trial.share < share_at_reach ? reach - trial.share * displacement : 0.0;
        return gain;
    }

    // Levenberg-Marquardt damping: between the triangles of a surface the energy is not smooth, which its derivatives
    // do not show; after a step that was cut short the next one is damped more, after a long one less.
    void adapt_damping(double share) {
        if (share < SHORT)
            damping = max(10 * damping, DAMPED);
        else if (share > LONG)
            damping *= 0.1;
    }

    // Whether vertices on the way to their goals hardly advance.
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
    double reach;  // how far vertices may still move
    double displacement = 0.0, share_at_reach = INFINITY;  // of the present step, see `measure_step`
    Workspace &space;
    Index n, c, crawling = 0;
    double before = INFINITY, damping = 0.0;
    double upright_energy = INFINITY, factor = 1.0, curvature = 0.0;  // of the product that `evaluate` describes
    bool moving = false;
};

Index descend(System &system, const Objective &objective, SurfaceMap *surface, Complex *u, double *tau, bool factorised,
              Index steps, double tolerance, double reach, double *energy, Index *counts) {
    Descent descent(system, objective, surface, u, tau, factorised, reach);
    descent.run(steps, tolerance);
    *energy = descent.energy;
    counts[0] = descent.done;
    counts[1] = descent.small;
    return descent.done;
}

}  // namespace

}  // namespace iccm

using namespace iccm;

// Exported for `largest_step` of newton.py; see above.
ICCM_EXPORT double iccm_minimise_largest_step(const int64_t *faces, const Complex *u, const Complex *step, int64_t m) {
    return largest_step(faces, u, step, m);
}

// Take the one step that minimises a quadratic energy, whose derivatives are in the workspace. Returns 1, or 0 if the
// matrix is not positive definite.
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

// Minimise the energy of a map in the plane.
//
//   u           (n,) positions on the side that moves, changed; they must have no folds unless epsilon > 0, and
//               sliding vertices must lie at arclengths tau of their curves
//   tau         (c,) arclengths of the constrained vertices, increasing along each curve, changed
//   factorised  whether all steps use the present factor, which saves time near the end, where little changes
//   steps       largest number of steps
//   tolerance   relative decrease below which a step counts as small; after two such steps the descent ends
//   reach       how far vertices may move, as the sum over all steps of the root mean square of their displacements;
//               infinite if that is not bounded
//   energy      (1,) final energy, written
//   counts      (2,) steps made, and how many of the last ones gained less than the tolerance, written
ICCM_EXPORT int64_t iccm_minimise_descend(System *system, const Objective *objective, Complex *u, double *tau,
                                          bool factorised, int64_t steps, double tolerance, double reach,
                                          double *energy, int64_t *counts) {
    return descend(*system, *objective, nullptr, u, tau, factorised, steps, tolerance, reach, energy, counts);
}

// The same for a map onto a surface in space.
ICCM_EXPORT int64_t iccm_minimise_descend_in_space(System *system, const Objective *objective, SurfaceMap *surface,
                                                   Complex *u, double *tau, bool factorised, int64_t steps,
                                                   double tolerance, double *energy, int64_t *counts) {
    return descend(*system, *objective, surface, u, tau, factorised, steps, tolerance, INFINITY, energy, counts);
}
