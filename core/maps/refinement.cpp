// Triangulations of a polygon's inside in which every triangle has a good shape: Lepp-Delaunay refinement.
//
// From a thin triangle one goes to the neighbour across the longest side, until that side is the longest of both its
// triangles (the end of the longest-edge propagation path); it is cut in the middle there (Rivara, Hitschfeld, Simpson,
// Terminal-edges Delaunay (small-angle based) algorithm, Computer-Aided Design 33, 2001). Flips in between keep the
// triangulation Delaunay. The polygon's edges stay, or are cut in the middle.
//
// `meshing/triangulate.cpp` has the other refiner, Ruppert's, which never cuts an edge of the outline: maps slide their
// vertices along it. Here triangles beside the outline have to become as small as the map between vertices asks, and
// edges are cut where it errs, so that Ruppert's rule (no circumcentre close to the outline) would leave them coarse.

#include "iccm/core.h"
#include "iccm/flips.h"

namespace iccm {
namespace {

// The sum of a triangle's squared sides over twice its area; infinite where it is not counter-clockwise.
double roughness(const Complex *z, Index a, Index b, Index c) {
    Complex u = z[b] - z[a], v = z[c] - z[a], w = v - u;
    double area = cross(u, v);
    return area > 0 ? (dot(u, u) + dot(v, v) + dot(w, w)) / area : INFINITY;
}

// Flip edges, from the triangles on the stack on, until no flip makes the triangulation less rough.
//
// The Delaunay triangulation has the least roughness of all (Musin, Properties of the Delaunay triangulation, 1997).
// Unlike the in-circle test, the sum falls with every flip, so that rounding cannot make flips alternate forever,
// however close to each other vertices lie.
void make_delaunay(const Complex *z, Triangles mesh, Stack stack) {
    constexpr double MAX_RATIO = 1 - 1e-6;  // of the roughness after and before a flip
    auto improves = [&](const Quadrilateral &q) {
        double now = roughness(z, q.a, q.b, q.c) + roughness(z, q.d, q.c, q.b);
        return roughness(z, q.a, q.b, q.d) + roughness(z, q.a, q.d, q.c) < MAX_RATIO * now;
    };
    flip_edges(mesh, stack, improves);
}

// A side, by a triangle and the corner opposite.
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

// The side to cut for a thin triangle: the last one on the path across longest sides, or the polygon's.
//
// Where the polygon has the second longest side of either of the two triangles at the end, it is that one: vertices
// inside would come closer and closer to it.
Side terminal_side(const Complex *z, Triangles mesh, Index t) {
    constexpr int MAX_PATH = 1000;  // found by hand; lengths grow along the path, so it ends by itself
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

// Cut a side at vertex v. Returns the number of triangles, `count` before.
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

// Vertices and triangles so far, and how many of them there is room for.
struct Counts {
    Index vertices, triangles, vertex_room, triangle_room;

    bool full() const { return vertices >= vertex_room || triangles + 2 > triangle_room; }
};

// Add vertices until no triangle is thin, or there is no room. Triangles whose squared longest side is below `tiniest`
// stay as they are, since rounding decides their shape.
void refine(Complex *z, Triangles mesh, Counts &counts, Stack stack, double thin, double tiniest) {
    constexpr int MAX_SWEEPS = 30;  // over all triangles, found by hand
    make_delaunay(z, mesh, stack);
    for (int sweep = 0; sweep < MAX_SWEEPS; sweep++) {
        Index before_sweep = counts.vertices;
        // Triangles that come to be in this sweep wait for the next one.
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

// Make a triangulation Delaunay, and add vertices until no triangle is thin, or there is no room. Returns the number of
// vertices.
//
//   z              (vertex_room,) vertices, written
//   vertices       how many there are
//   vertex_room    how many there is room for
//   faces          (triangle_room, 3) triangles, written
//   across         (triangle_room, 3) their neighbours, written
//   triangles      (1,) how many there are, written
//   triangle_room  how many there is room for
//   stack          (stack_size,) triangles to begin with, after their number; work space
//   stack_size     of the stack
//   thin           twice a triangle's area relative to its squared longest side: with less it is thin
//   tiniest        squared longest side of triangles that stay as they are
ICCM_EXPORT int64_t iccm_maps_refine(Complex *z, int64_t vertices, int64_t vertex_room, int64_t *faces, int64_t *across,
                                     int64_t *triangles, int64_t triangle_room, int64_t *stack, int64_t stack_size,
                                     double thin, double tiniest) {
    Counts counts = {vertices, *triangles, vertex_room, triangle_room};
    refine(z, {rows<3>(faces), rows<3>(across)}, counts, {stack, stack_size}, thin, tiniest);
    *triangles = counts.triangles;
    return counts.vertices;
}
