// Each vertex of an outline or a stroke has one unknown, its arclength τ on the polyline along which it slides. It
// slides over small bends; at a corner it stops, and stays there as long as the slopes on both sides hold it. A
// stroke's polyline is closed by running back along itself, but vertices use the forward half only: their order is
// kept, and the end vertices do not pass the stroke's ends.
#include "minimise/sliding.h"

namespace iccm {

namespace {

constexpr double SHARE_OF_GAP = 0.9;  // share of the gap by which two neighbours on a curve may approach in one step
constexpr double SAME_PLACE = 1e-8;   // relative to the length: a vertex this close to a corner is on it
constexpr double NUDGE = 1e-9;        // relative to the length: how far from a vertex its two tangents are evaluated

Rail rail_of(const Rails &rails, Index v) {
    const Index *a = rails.starts + 3 * rails.own[v], *b = a + 3;
    return {rails.knots + a[0], rails.vertices + a[1], b[1] - a[1], rails.corners + a[2], b[2] - a[2]};
}

// A place on a polyline: an edge, and the arclength from its start.
struct Place {
    Index edge;
    double along;
};

// The place at any arclength, wrapped around the curve.
Place locate(const Rail &rail, double s) {
    double length = rail.length();
    s -= floor(s / length) * length;
    Index edge = 0, end = rail.size;
    while (end - edge > 1) {
        Index middle = (edge + end) / 2;
        (rail.knots[middle] <= s ? edge : end) = middle;
    }
    return {edge, s - rail.knots[edge]};
}

Complex point_at(const Rail &rail, double s) {
    auto [edge, along] = locate(rail, s);
    double share = min(along / (rail.knots[edge + 1] - rail.knots[edge]), 1.0);
    Complex start = rail.vertices[edge], end = rail.vertices[(edge + 1) % rail.size];
    return start + share * (end - start);
}

// The unit tangent at an arclength.
Complex tangent(const Rail &rail, double s) {
    Index edge = locate(rail, s).edge;
    Complex step = rail.vertices[(edge + 1) % rail.size] - rail.vertices[edge];
    return step * (1 / size(step));
}

// The corners nearest to an arclength: whether it is on one, and the signed distances (negative, positive) to the ones
// behind and ahead.
struct CornersBeside {
    bool on;
    double behind, ahead;
};

CornersBeside corners_beside(const Rail &rail, double s) {
    double length = rail.length();
    Index count = rail.corner_count;
    if (count == 0) return {false, -length, length};
    double near = SAME_PLACE * length;
    s -= floor(s / length) * length;
    Index k = 0, end = count;
    while (k < end) {  // the first corner not before s
        Index middle = (k + end) / 2;
        if (rail.corners[middle] < s - near)
            k = middle + 1;
        else
            end = middle;
    }
    double behind = (k > 0 ? rail.corners[k - 1] : rail.corners[count - 1] - length) - s;
    bool on = k < count && rail.corners[k] <= s + near;
    k += on ? 1 : 0;
    double ahead = (k < count ? rail.corners[k] : rail.corners[k - count] + length) - s;
    return {on || behind > -near || ahead < near, behind, ahead};
}

// Arclength from constrained vertex v to the next one.
inline double gap_ahead(const Border &border, const double *tau, Index v) {
    return tau[border.following[v]] - tau[v] + border.laps[v];
}

// Fill in the derivatives of the curves' energy with respect to each τ, and the second derivatives with respect to
// each gap.
void border_derivatives(const Border &border, const double *tau, double *slope, double *curvature) {
    for (Index v = 0; v < border.count; v++) slope[v] = 0.0;
    for (Index v = 0; v < border.count; v++) {
        double gap = gap_ahead(border, tau, v), span = border.spans[v], beta = border.stiffness[v];
        double pull = 0.5 * beta * (2 * gap / span - span * span / (gap * gap));
        slope[v] -= pull;
        slope[border.following[v]] += pull;
        curvature[v] = beta * (1 / span + span * span / (gap * gap * gap));
    }
}

// Fill in the direction in which each constrained vertex may slide, a unit tangent or 0 to stay, and the limits of its
// step.
//
//   gradient    (n,) gradient of the energy in the plane
//   slope       (c,) derivatives of the curves' energy
//   directions  (c,) written
//   low         (c,) most negative step, written
//   high        (c,) largest step, written
void choose_directions(const Constraints &constraints, const double *tau, const Complex *gradient, const double *slope,
                       Complex *directions, double *low, double *high) {
    const Rails &rails = constraints.rails;
    for (Index v = 0; v < constraints.border.count; v++) {
        directions[v] = {0, 0};
        low[v] = high[v] = 0.0;
        if (constraints.kinds[v] != SLIDING) continue;
        Rail rail = rail_of(rails, v);
        double nudge = NUDGE * rail.length();
        auto [on, behind, ahead] = corners_beside(rail, tau[v]);
        Complex forward = tangent(rail, tau[v] + nudge);
        directions[v] = forward;
        low[v] = behind;
        high[v] = ahead;
        if (!on) continue;
        Complex backward = tangent(rail, tau[v] - nudge);
        double slope_ahead = dot(gradient[v], forward) + slope[v], slope_behind = dot(gradient[v], backward) + slope[v];
        double turning_point = rails.ends[rails.own[v]];
        low[v] = 0.0;
        if (tau[v] >= turning_point - nudge)
            slope_ahead = 0.0;
        else if (turning_point < INFINITY && tau[v] <= nudge)
            slope_behind = 0.0;
        if (slope_ahead >= 0 && slope_behind <= 0) {  // the energy increases on both sides
            directions[v] = {0, 0};
            high[v] = 0.0;
        } else if (slope_ahead >= 0 || (slope_behind > -slope_ahead && -slope_ahead > 0)) {
            directions[v] = backward;
            low[v] = behind;
            high[v] = 0.0;
        }
    }
}

inline bool is_zero(Complex a) { return a.re == 0 && a.im == 0; }

// Rewrites the blocks of constrained vertices: the first unknown is the step along the direction, and unused ones get a
// one on the diagonal.
void restrict_matrix(const BlockPattern &pattern, const Constraints &constraints, const Complex *directions,
                     double *matrix) {
    Index count = constraints.border.count;
    for (Index k = 0; k < pattern.n; k++) {
        Index v = pattern.order[k];
        for (Index p = pattern.starts[k]; p < pattern.starts[k + 1]; p++) {
            Index w = pattern.order[pattern.columns[p]];
            double *block = matrix + 4 * p;
            if (v < count && constraints.kinds[v] != FREE) {
                for (Index b = 0; b < 2; b++) {
                    block[b] = directions[v].re * block[b] + directions[v].im * block[2 + b];
                    block[2 + b] = 0.0;
                }
            }
            if (w < count && constraints.kinds[w] != FREE) {
                for (Index b = 0; b < 4; b += 2) {
                    block[b] = directions[w].re * block[b] + directions[w].im * block[b + 1];
                    block[b + 1] = 0.0;
                }
            }
        }
    }
    for (Index v = 0; v < count; v++) {
        if (constraints.kinds[v] == FREE) continue;
        matrix[4 * pattern.diagonal[v] + 3] = 1.0;
        if (is_zero(directions[v])) matrix[4 * pattern.diagonal[v]] = 1.0;
    }
}

// Add the second derivatives of the curves' energy to a restricted matrix.
void add_border_curvature(const BlockPattern &pattern, const Border &border, const Complex *directions,
                          const double *curvature, double *matrix) {
    for (Index v = 0; v < border.count; v++) {
        Index w = border.following[v];
        bool moves = !is_zero(directions[v]), next_moves = !is_zero(directions[w]);
        if (moves) matrix[4 * pattern.diagonal[v]] += curvature[v];
        if (next_moves) matrix[4 * pattern.diagonal[w]] += curvature[v];
        if (moves && next_moves) matrix[4 * pattern.ahead[v]] -= curvature[v];
    }
}

// Fill in the displacements (n,) of held vertices to their goals; returns whether there are any.
bool ways_to_goals(const Constraints &constraints, const Complex *u, Complex *way, Index n) {
    bool moving = false;
    memset(way, 0, sizeof(Complex) * n);
    for (Index v = 0; v < constraints.border.count; v++) {
        if (constraints.kinds[v] != HELD || constraints.goals[v] == u[v]) continue;
        way[v] = constraints.goals[v] - u[v];
        moving = true;
    }
    return moving;
}

// Add the matrix times the displacements (n,) to the gradient (n,), both x + iy for each vertex.
void add_product(const BlockPattern &pattern, const double *matrix, const Complex *way, Complex *gradient) {
    for (Index k = 0; k < pattern.n; k++) {
        Index row = pattern.order[k];
        for (Index p = pattern.starts[k]; p < pattern.starts[k + 1]; p++) {
            Index column = pattern.order[pattern.columns[p]];
            const double *block = matrix + 4 * p;
            if (!is_zero(way[column])) {
                double x = way[column].re, y = way[column].im;
                gradient[row] += Complex{block[0] * x + block[1] * y, block[2] * x + block[3] * y};
            }
            if (row != column && !is_zero(way[row])) {
                double x = way[row].re, y = way[row].im;
                gradient[column] += Complex{block[0] * x + block[2] * y, block[1] * x + block[3] * y};
            }
        }
    }
}

}  // namespace

double border_energy(const Border &border, const double *tau) {
    double energy = 0.0;
    for (Index v = 0; v < border.count; v++) {
        double gap = gap_ahead(border, tau, v), span = border.spans[v];
        if (gap <= 0) return INFINITY;
        energy += 0.5 * border.stiffness[v] * (gap * gap / span + span * span / gap);
    }
    return energy;
}

void project_on_directions(const Constraints &constraints, const Complex *directions, Complex *gradient) {
    for (Index v = 0; v < constraints.border.count; v++)
        if (constraints.kinds[v] != FREE) gradient[v] = {dot(gradient[v], directions[v]), 0.0};
}

bool constrain(const BlockPattern &pattern, const Constraints &constraints, const Complex *u, const double *tau,
               Workspace &space) {
    border_derivatives(constraints.border, tau, space.slope, space.curvature);
    choose_directions(constraints, tau, space.gradient, space.slope, space.directions, space.low, space.high);
    // the whole displacement of held vertices is imposed: the others' gradient is that after it, g + H way
    bool moving = ways_to_goals(constraints, u, space.way, pattern.n);
    if (moving) add_product(pattern, space.matrix, space.way, space.gradient);
    restrict_matrix(pattern, constraints, space.directions, space.matrix);
    add_border_curvature(pattern, constraints.border, space.directions, space.curvature, space.matrix);
    project_on_directions(constraints, space.directions, space.gradient);
    for (Index v = 0; v < constraints.border.count; v++)
        if (!is_zero(space.directions[v])) space.gradient[v].re += space.slope[v];
    return moving;
}

void release(const Constraints &constraints, Workspace &space) {
    for (Index v = 0; v < constraints.border.count; v++) {
        if (constraints.kinds[v] == FREE) {
            space.slide[v] = 0.0;
            continue;
        }
        space.slide[v] = space.step[v].re;
        if (space.low[v] == 0) space.slide[v] = max(space.slide[v], 0.0);
        if (space.high[v] == 0) space.slide[v] = min(space.slide[v], 0.0);
        space.step[v] = space.slide[v] * space.directions[v] + space.way[v];
    }
}

double gap_limit(const Border &border, const double *tau, const double *slide, double most) {
    for (Index v = 0; v < border.count; v++) {
        double closing = slide[v] - slide[border.following[v]];
        if (closing > 0) most = min(most, SHARE_OF_GAP * gap_ahead(border, tau, v) / closing);
    }
    return most;
}

void move(const Constraints &constraints, const Complex *u, const double *tau, double t, Workspace &space, Index n) {
    for (Index v = 0; v < n; v++) space.new_u[v] = u[v] + t * space.step[v];
    for (Index v = 0; v < constraints.border.count; v++) {
        double s = min(max(t * space.slide[v], space.low[v]), space.high[v]);
        space.new_tau[v] = tau[v] + s;
        if (s != 0) space.new_u[v] = point_at(rail_of(constraints.rails, v), space.new_tau[v]);
        if (t == 1.0 && constraints.kinds[v] == HELD) space.new_u[v] = constraints.goals[v];
    }
}

}  // namespace iccm

using namespace iccm;

// The parts of a step, exported for Python; see above.

ICCM_EXPORT double iccm_minimise_border_energy(const Border *border, const double *tau) {
    return border_energy(*border, tau);
}

ICCM_EXPORT int64_t iccm_minimise_border_derivatives(const Border *border, const double *tau, double *slope,
                                                     double *curvature) {
    border_derivatives(*border, tau, slope, curvature);
    return border->count;
}

ICCM_EXPORT int64_t iccm_minimise_choose_directions(const Constraints *constraints, const double *tau,
                                                    const Complex *gradient, const double *slope, Complex *directions,
                                                    double *low, double *high) {
    choose_directions(*constraints, tau, gradient, slope, directions, low, high);
    return constraints->border.count;
}

// Fill in the point (1,) at arclength s of a rail with `size` vertices.
ICCM_EXPORT int64_t iccm_minimise_point_at(const double *knots, const Complex *vertices, int64_t size, double s,
                                           Complex *point) {
    *point = point_at({knots, vertices, size, nullptr, 0}, s);
    return 1;
}

// Fill in the distances (2,) to the corners behind and ahead; returns whether s is on a corner.
ICCM_EXPORT int64_t iccm_minimise_corners_beside(const double *knots, int64_t size, const double *corners,
                                                 int64_t corner_count, double s, double *distances) {
    auto [on, behind, ahead] = corners_beside({knots, nullptr, size, corners, corner_count}, s);
    distances[0] = behind;
    distances[1] = ahead;
    return on;
}
