// Every vertex of the map is a point of the surface, and the image of a triangle is the flat triangle in space that
// joins three of these points. The derivative of a point in space with respect to its position in the layout is that of
// the surface's triangle that contains it. Line searches evaluate this energy. A small additional energy in the layout
// prevents folds there.
#include "minimise/in_space.h"

namespace iccm {

namespace {

// Divides a vector in space by its length, which is returned.
double normalise(double *vector) {
    double squares = vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2];
    double length = max(sqrt(squares), 1e-300);
    for (int c = 0; c < 3; c++) vector[c] /= length;
    return length;
}

double dot_in_space(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Fill in the points in space of vertices with layout positions u (n,).
void land(SurfaceMap &surface, const Complex *u) {
    const Places &places = surface.ground.places;
    for (Index v = 0; v < surface.n; v++) {
        double shares[3];
        Index t = place_on(places, u[v], shares);
        const Index *face = places.faces + 3 * t;
        // 0 unless the position is outside the layout, beyond which the surface is extended linearly
        Complex beside = u[v] - shares[0] * places.flat[face[0]] - shares[1] * places.flat[face[1]] -
                         shares[2] * places.flat[face[2]];
        const double *a = surface.ground.points + 3 * face[0], *b = surface.ground.points + 3 * face[1];
        const double *c = surface.ground.points + 3 * face[2], *slopes = surface.ground.slopes + 6 * t;
        double *point = surface.points + 3 * v;
        for (int k = 0; k < 3; k++) {
            point[k] = shares[0] * a[k] + shares[1] * b[k] + shares[2] * c[k];
            point[k] += slopes[2 * k] * beside.re + slopes[2 * k + 1] * beside.im;
        }
        surface.on[v] = t;
    }
}

// Fill in the images of triangles, moved to the plane with the first corner at 0 and the second on the x axis
// (Gram-Schmidt).
void lay(SurfaceMap &surface, const Complex *u) {
    for (Index t = 0; t < surface.layout.m; t++) {
        const Index *corner = surface.layout.corners + 3 * t;
        Complex *laid = surface.laid + 3 * t;
        if (surface.open[t]) {
            for (int k = 0; k < 3; k++) laid[k] = u[corner[k]];
            continue;
        }
        const double *a = surface.points + 3 * corner[0], *b = surface.points + 3 * corner[1];
        const double *c = surface.points + 3 * corner[2];
        double *x = surface.axes + 6 * t, *y = x + 3, orientation = surface.orientations[t];
        for (int k = 0; k < 3; k++) {
            x[k] = b[k] - a[k];
            y[k] = c[k] - a[k];
        }
        double length = normalise(x);
        double along = dot_in_space(x, y);
        for (int k = 0; k < 3; k++) y[k] -= along * x[k];
        double height = orientation * normalise(y);
        for (int k = 0; k < 3; k++) y[k] *= orientation;
        laid[0] = {0, 0};
        laid[1] = {length, 0.0};
        laid[2] = {along, height};
    }
}

// The derivatives of a triangle's flattened corners with respect to their positions in the layout.
struct Jacobians {
    double of[3][2][2];
};

Jacobians jacobians_of(const SurfaceMap &surface, Index t) {
    Jacobians jacobians;
    for (int k = 0; k < 3; k++) {
        const double *slopes = surface.ground.slopes + 6 * surface.on[surface.layout.corners[3 * t + k]];
        for (int i = 0; i < 2; i++) {
            const double *axis = surface.axes + 6 * t + 3 * i;
            for (int j = 0; j < 2; j++) {
                if (surface.open[t])
                    jacobians.of[k][i][j] = i == j ? 1.0 : 0.0;
                else
                    jacobians.of[k][i][j] = axis[0] * slopes[j] + axis[1] * slopes[2 + j] + axis[2] * slopes[4 + j];
            }
        }
    }
    return jacobians;
}

}  // namespace

double total_in_space(const RestShapes &rest, SurfaceMap &surface, const Complex *u, const Objective &objective) {
    double energy = total(surface.layout, u, surface.barrier);
    if (energy == INFINITY) return energy;
    land(surface, u);
    lay(surface, u);
    return energy + total(rest, surface.laid, objective);
}

double assemble_in_space(const RestShapes &rest, SurfaceMap &surface, const Complex *u, const Objective &objective,
                         double *matrix, Complex *gradient, Index n, Index e) {
    land(surface, u);
    lay(surface, u);
    Index m = surface.layout.m;
    double energy = assemble(surface.layout, u, surface.barrier, matrix, gradient, n, e);
    energy += assemble(rest, surface.laid, objective, surface.blocks, surface.slopes, 3 * m, 6 * m);
    for (Index t = 0; t < m; t++) {
        Jacobians jacobians = jacobians_of(surface, t);
        const Index *slot = surface.layout.slots + 6 * t;
        const double *block = surface.blocks + 24 * t;
        for (int k = 0; k < 3; k++) {
            // Jₖᵀ g for the gradient g at a flattened corner, Jₖᵀ B Jₗ for the block B of two corners
            const double(*first)[2] = jacobians.of[k];
            Complex slope = surface.slopes[3 * t + k];
            Complex x{first[0][0], first[0][1]}, y{first[1][0], first[1][1]};
            gradient[surface.layout.corners[3 * t + k]] += slope.re * x + slope.im * y;
            for (int l = k; l < 3; l++, block += 4, slot++) {
                const double(*second)[2] = jacobians.of[l];
                double *goal = matrix + 4 * *slot;
                for (int j = 0; j < 2; j++) {
                    double over_x = block[0] * second[0][j] + block[1] * second[1][j];
                    double over_y = block[2] * second[0][j] + block[3] * second[1][j];
                    goal[j] += x.re * over_x + y.re * over_y;
                    goal[2 + j] += x.im * over_x + y.im * over_y;
                }
            }
        }
    }
    return energy;
}

}  // namespace iccm

using namespace iccm;

ICCM_EXPORT double iccm_minimise_total_in_space(const RestShapes *rest, SurfaceMap *surface, const Complex *u,
                                                const Objective *objective) {
    return total_in_space(*rest, *surface, u, *objective);
}

ICCM_EXPORT double iccm_minimise_assemble_in_space(const RestShapes *rest, SurfaceMap *surface, const Complex *u,
                                                   const Objective *objective, double *matrix, Complex *gradient,
                                                   int64_t n, int64_t e) {
    return assemble_in_space(*rest, *surface, u, *objective, matrix, gradient, n, e);
}
