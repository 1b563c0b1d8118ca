// Triangulations of a polygon's inside in which every triangle has a good shape: Lepp-Delaunay refinement.
//
// A thin triangle leads to its neighbour across the longest side, and so on, until that side is the longest of both its
// triangles (the end of the longest-edge propagation path); that side is cut in the middle (Rivara, Hitschfeld,
// Simpson, Terminal-edges Delaunay (small-angle based) algorithm, Computer-Aided Design 33, 2001). Flips in between
// keep the triangulation Delaunay. The polygon's edges are kept, or cut in the middle.
//
// `meshing/triangulate.cpp` has the other refiner, Ruppert's, which never cuts an edge of the outline: maps slide their
// vertices along it. Here triangles beside the outline must become as small as the map between vertices requires, and
// its edges are cut where the map is inaccurate; Ruppert's rule (no circumcentre close to the outline) would leave
// these triangles coarse.

#include "iccm/core.h"
#include "iccm/flips.h"

namespace iccm {
namespace {

// The sum of a triangle's squared sides over twice its area; infinite where it is not counter-clockwise.
double roughness(const Complex *z, Index a, Index b, Index c) {
    return of_triangle(a, b, c, [&](Index first, Index second, Index third) {
        Complex u = z[second] - z[first], v = z[third] - z[first], w = v - u;
        double area = cross(u, v);
        return area > 0 ? (dot(u, u) + dot(v, v) + dot(w, w)) / area : INFINITY;
    });
}

// Flip edges, starting with the triangles on the stack, until no flip makes the triangulation less rough.
//
// The Delaunay triangulation has the least roughness of all (Musin, Properties of the Delaunay triangulation, 1997).
// Unlike the in-circle test, the sum falls with every flip, so that rounding cannot make flips alternate forever,
// however close to each other vertices lie.
void make_delaunay(const Complex *z, Triangles mesh, Stack stack) {
    constexpr double MAX_RATIO = 1 - 1e-6;  // ratio of the roughness after a flip to that before
    auto improves = [&](const Quadrilateral &q) {
        double now = roughness(z, q.a, q.b, q.c) + roughness(z, q.d, q.c, q.b);
        return roughness(z, q.a, q.b, q.d) + roughness(z, q.a, q.d, q.c) < MAX_RATIO * now;
    };
    flip_edges(mesh, stack, improves);
}

// A side, given by a triangle and the opposite corner.
struct Side {
    Index triangle;
    int corner;
};

double squared_length(const Complex *z, Triangles mesh, Side side) {
    const Index *corners = mesh.faces[side.triangle];
    Complex edge = z[corners[after(side.corner)]] - z[corners[before(side.corner)]];
    return dot(edge, edge);
}

// The longest side of a triangle, the first of equally long ones.
Side longest_side(const Complex *z, Triangles mesh, Index t, double &longest) {
    Side side = {t, 0};
    longest = -1.0;
    for (int k = 0; k < 3; k++) {
        double length = squared_length(z, mesh, {t, k});
        if (length > longest) side.corner = k, longest = length;
    }
    return side;
}

// The side to cut for a thin triangle: the last one on the path across longest sides, or an edge of the polygon.
//
// If the second longest side of either of the two triangles at the end is an edge of the polygon, that one is cut:
// otherwise inner vertices would come closer and closer to it.
Side terminal_side(const Complex *z, Triangles mesh, Index t) {
    constexpr int MAX_PATH = 1000;  // chosen by hand; lengths grow along the path, so that it is finite anyway
    double longest;
    Side side = longest_side(z, mesh, t, longest);
    for (int step = 0; step < MAX_PATH; step++) {
        Index u = mesh.across[side.triangle][side.corner];
        if (u < 0) return side;
        double other;
        Side next = longest_side(z, mesh, u, other);
        if (mesh.across[u][next.corner] == side.triangle || other <= longest) break;
        side = next, longest = other;
    }
    const Index both[2] = {side.triangle, mesh.across[side.triangle][side.corner]};
    for (Index v : both) {
        double length;
        int first = longest_side(z, mesh, v, length).corner;
        Side next = {v, after(first)}, previous = {v, before(first)};
        Side second = squared_length(z, mesh, next) > squared_length(z, mesh, previous) ? next : previous;
        if (mesh.across[v][second.corner] < 0) return second;
    }
    return side;
}

// Cut a side at vertex v. Returns the new number of triangles, which was `count`.
Index cut(const Complex *z, Index v, Triangles mesh, Side side, Index count, Stack stack) {
    Index t = side.triangle, u = mesh.across[t][side.corner];
    int k = side.corner;
    Index a = mesh.faces[t][k], b = mesh.faces[t][after(k)], c = mesh.faces[t][before(k)];
    Index beyond_ca = mesh.across[t][after(k)], beyond_ab = mesh.across[t][before(k)];
    Index t2 = count++, u2 = u >= 0 ? count++ : -1;
    relink(mesh, beyond_ca, t, t2);
    write(mesh, t, a, b, v, u, t2, beyond_ab);
    write(mesh, t2, a, v, c, u2, beyond_ca, t);
    stack.push(t);
    stack.push(t2);
    if (u >= 0) {
        int j = opposite(mesh, u, b, c);
        Index d = mesh.faces[u][j];
        Index beyond_bd = mesh.across[u][after(j)], beyond_dc = mesh.across[u][before(j)];
        relink(mesh, beyond_dc, u, u2);
        write(mesh, u, d, v, b, t, beyond_bd, u2);
        write(mesh, u2, d, c, v, t2, u, beyond_dc);
        stack.push(u);
        stack.push(u2);
    }
    make_delaunay(z, mesh, stack);
    return count;
}

// Numbers of vertices and triangles so far, and the capacities for them.
struct Counts {
    Index vertices, triangles, vertex_room, triangle_room;

    bool full() const { return vertices >= vertex_room || triangles + 2 > triangle_room; }
};

// Add vertices until no triangle is thin, or the arrays are full. Triangles whose squared longest side is below
// `tiniest` are left alone, since rounding decides their shape.
void refine(Complex *z, Triangles mesh, Counts &counts, Stack stack, double thin, double tiniest) {
    constexpr int MAX_SWEEPS = 30;  // over all triangles, chosen by hand
    make_delaunay(z, mesh, stack);
    for (int sweep = 0; sweep < MAX_SWEEPS; sweep++) {
        Index before_sweep = counts.vertices;
        // Triangles that arise in this sweep wait for the next one.
        for (Index t = 0, end = counts.triangles; t < end; t++)
            while (!counts.full()) {
                double longest;
                longest_side(z, mesh, t, longest);
                const Index *corners = mesh.faces[t];
                if (twice_area(z, corners[0], corners[1], corners[2]) >= thin * longest || longest < tiniest) break;
                Side side = terminal_side(z, mesh, t);
                corners = mesh.faces[side.triangle];
                z[counts.vertices] = 0.5 * (z[corners[after(side.corner)]] + z[corners[before(side.corner)]]);
                counts.triangles = cut(z, counts.vertices++, mesh, side, counts.triangles, stack);
            }
        if (counts.vertices == before_sweep) break;
    }
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Make a triangulation Delaunay, and add vertices until no triangle is thin, or the arrays are full. Returns the number
// of vertices.
//
//   z              (vertex_room,) vertices, written
//   vertices       number of vertices
//   vertex_room    capacity for vertices
//   faces          (triangle_room, 3) triangles, written
//   across         (triangle_room, 3) their neighbours, written
//   triangles      (1,) number of triangles, changed
//   triangle_room  capacity for triangles
//   stack          (stack_size,) triangles to visit first, after their number; work space
//   stack_size     capacity of the stack
//   thin           a triangle is thin if twice its area is less than this times its squared longest side
//   tiniest        squared longest side below which triangles are left alone
ICCM_EXPORT int64_t iccm_maps_refine(Complex *z, int64_t vertices, int64_t vertex_room, int64_t *faces, int64_t *across,
                                     int64_t *triangles, int64_t triangle_room, int64_t *stack, int64_t stack_size,
                                     double thin, double tiniest) {
    Counts counts = {vertices, *triangles, vertex_room, triangle_room};
    refine(z, {rows<3>(faces), rows<3>(across)}, counts, {stack, stack_size}, thin, tiniest);
    *triangles = counts.triangles;
    return counts.vertices;
}
