// Quality triangulation of polygons with holes, which preserves the outlines and given points and lines inside.
//
// The steps, in order: ear clipping of the outline; insertion of the given points, and recovery of the edges between
// them by flips (Sloan, A fast algorithm for generating constrained Delaunay triangulations, Computers & Structures
// 47(3), 1993); removal of the triangles in holes; Delaunay refinement (Ruppert, A Delaunay refinement algorithm for
// quality 2-dimensional mesh generation, J. Algorithms 18, 1995; Shewchuk, Delaunay refinement algorithms for
// triangular mesh generation, Computational Geometry 22, 2002). The outline's edges are never split: a circumcentre too
// close to one is not inserted.
//
// Absolute tolerances assume a domain with an area of about one.

#include "iccm/core.h"
#include "iccm/delaunay.h"
#include "iccm/flips.h"

namespace iccm {
namespace {

// --- Ear clipping ---

// The polygon that remains of the outline while ears are cut off: a doubly linked list of vertices. For each remaining
// edge, indexed by its first vertex, the triangle on its other side, or -1, and the edge's number among that triangle's
// sides.
struct Remaining {
    Index *next, *previous;
    Index *beyond;
    Index *side;
};

// Whether vertex i can be cut off: its corner is convex, and no other vertex lies in the triangle.
bool is_ear(const Complex *z, const Remaining &left, Index i) {
    // Area relative to the squared edges; three vertices that are collinear up to rounding have less.
    constexpr double MIN_EAR_AREA = 1e-13;
    // Vertices on an edge, within rounding, count as inside.
    constexpr double SLACK = -1e-15;
    Index first = left.previous[i], last = left.next[i];
    Complex a = z[first], b = z[i], c = z[last];
    double size = dot(b - a, b - a) + dot(c - b, c - b);
    if (cross(b - a, c - b) <= MIN_EAR_AREA * size) return false;
    for (Index j = left.next[last]; j != first; j = left.next[j]) {
        Complex p = z[j];
        if (cross(b - a, p - a) >= SLACK && cross(c - b, p - b) >= SLACK && cross(a - c, p - c) >= SLACK) return false;
    }
    return true;
}

void join(Triangles mesh, Index u, Index side, Index t) {
    if (u >= 0) mesh.across[u][side] = t;
}

// Triangulate a simple counter-clockwise polygon (Meisters, Polygons have ears, American Mathematical Monthly 82,
// 1975). Returns the number of triangles, or -1 if no ear is left.
Index clip_ears(const Complex *z, Index count, Remaining left, Triangles mesh) {
    for (Index v = 0; v < count; v++) {
        left.next[v] = v + 1 == count ? 0 : v + 1;
        left.previous[v] = v == 0 ? count - 1 : v - 1;
        left.beyond[v] = -1, left.side[v] = 0;
    }
    Index size = count, t = 0, passed = 0, i = 0;
    while (size > 3) {
        Index p = left.previous[i], q = left.next[i];
        if (!is_ear(z, left, i)) {
            i = q;
            if (++passed > size) return -1;
            continue;
        }
        write(mesh, t, p, i, q, left.beyond[i], -1, left.beyond[p]);
        join(mesh, left.beyond[p], left.side[p], t);
        join(mesh, left.beyond[i], left.side[i], t);
        left.beyond[p] = t, left.side[p] = 1;
        left.next[p] = q, left.previous[q] = p;
        --size, ++t, passed = 0, i = left.next[q];
    }
    Index a = i, b = left.next[a], c = left.next[b];
    write(mesh, t, a, b, c, left.beyond[b], left.beyond[c], left.beyond[a]);
    join(mesh, left.beyond[a], left.side[a], t);
    join(mesh, left.beyond[b], left.side[b], t);
    join(mesh, left.beyond[c], left.side[c], t);
    return t + 1;
}

// --- Insertion of vertices ---

// A mesh to which vertices and triangles are added.
struct Growing {
    Complex *z;
    Triangles mesh;
    Stack stack;
    Index vertices, triangles;  // their numbers
    Index room;                 // for vertices
};

// Insert vertex v into triangle t, and make the mesh Delaunay again. False if v lies on an edge; then nothing changes.
bool insert(Growing &grown, Index t, Index v, Index fixed, Links links) {
    // Twice the area of a new triangle below which the vertex counts as lying on an edge.
    constexpr double MIN_TWICE_AREA = 1e-11;
    Triangles mesh = grown.mesh;
    const Complex *z = grown.z;
    Index a = mesh.faces[t][0], b = mesh.faces[t][1], c = mesh.faces[t][2];
    if (min(min(twice_area(z, a, b, v), twice_area(z, b, c, v)), twice_area(z, c, a, v)) < MIN_TWICE_AREA) return false;
    Index t2 = grown.triangles, t3 = grown.triangles + 1;
    Index beyond_a = mesh.across[t][0], beyond_b = mesh.across[t][1], beyond_c = mesh.across[t][2];
    write(mesh, t, v, b, c, beyond_a, t2, t3);
    write(mesh, t2, v, c, a, beyond_b, t3, t);
    write(mesh, t3, v, a, b, beyond_c, t, t2);
    relink(mesh, beyond_b, t, t2);
    relink(mesh, beyond_c, t, t3);
    grown.triangles += 2;
    grown.stack.push(t);
    grown.stack.push(t2);
    grown.stack.push(t3);
    legalise(z, mesh, grown.stack, fixed, links);
    return true;
}

// Split the inner side k of triangle t at vertex v, which lies on it, and make the mesh Delaunay again.
void split(Growing &grown, Index v, Index t, int k, Index fixed, Links links) {
    Triangles mesh = grown.mesh;
    Index u = mesh.across[t][k];
    Index a = mesh.faces[t][k], b = mesh.faces[t][after(k)], c = mesh.faces[t][before(k)];
    int j = opposite(mesh, u, b, c);
    Index d = mesh.faces[u][j];
    Index t2 = grown.triangles, u2 = grown.triangles + 1;
    Index beyond_ca = mesh.across[t][after(k)], beyond_ab = mesh.across[t][before(k)];
    Index beyond_bd = mesh.across[u][after(j)], beyond_dc = mesh.across[u][before(j)];
    write(mesh, t, a, b, v, u, t2, beyond_ab);
    write(mesh, t2, a, v, c, u2, beyond_ca, t);
    write(mesh, u, d, v, b, t, beyond_bd, u2);
    write(mesh, u2, d, c, v, t2, u, beyond_dc);
    relink(mesh, beyond_ca, t, t2);
    relink(mesh, beyond_dc, u, u2);
    grown.triangles += 2;
    grown.stack.push(t);
    grown.stack.push(t2);
    grown.stack.push(u);
    grown.stack.push(u2);
    legalise(grown.z, mesh, grown.stack, fixed, links);
}

// --- Lines and holes ---

// The triangle that contains a point: the one whose sides it is farthest inside of.
Index holder_of(const Growing &grown, Complex point) {
    double best = -INFINITY;
    Index holder = 0;
    for (Index t = 0; t < grown.triangles; t++) {
        const Index *corners = grown.mesh.faces[t];
        double inside = INFINITY;
        for (int k = 0; k < 3; k++) {
            Complex a = grown.z[corners[k]], edge = grown.z[corners[after(k)]] - a;
            inside = min(inside, cross(edge, point - a) / size(edge));
        }
        if (inside > best) best = inside, holder = t;
    }
    return holder;
}

// The side of the line from p to q on which vertex v lies: 1 left, -1 right, 0 within rounding.
int side_of(const Complex *z, Index p, Index q, Index v) {
    constexpr double ON_LINE = 1e-15;  // distance within which a vertex counts as on a line
    Complex line = z[q] - z[p], to = z[v] - z[p];
    double area = cross(line, to);
    if (fabs(area) <= ON_LINE * (size(line) + size(to))) return 0;
    return area > 0 ? 1 : -1;
}

// Flip edges that cross the segment from v to w until it is an edge of the mesh (Sloan 1993, §5). False if that is
// impossible: it crosses an edge that was recovered before, or the flips repeat.
bool recover_edge(const Complex *z, Triangles mesh, Index triangles, Index v, Index w, Links links) {
    constexpr int MAX_SWEEPS = 60;              // drawings needed only a few
    constexpr double MIN_FLIPPED_AREA = 1e-13;  // twice the area: more than for a Delaunay flip, since the edge's
                                                // other diagonals are flipped back and forth
    for (int sweep = 0; sweep < MAX_SWEEPS; ++sweep) {
        bool crossing = false;
        for (Index t = 0; t < triangles; t++) {
            for (int k = 0; k < 3; k++) {
                Index a = mesh.faces[t][k], b = mesh.faces[t][after(k)], c = mesh.faces[t][before(k)];
                Index u = mesh.across[t][k];
                if (u < 0) continue;
                Index d = mesh.faces[u][opposite(mesh, u, b, c)];
                // Visit each edge once, from the triangle with the lower opposite vertex.
                if (a > d || v == b || v == c || w == b || w == c) continue;
                if (side_of(z, v, w, b) * side_of(z, v, w, c) >= 0 || side_of(z, b, c, v) * side_of(z, b, c, w) >= 0)
                    continue;
                if (links.join(b, c) && min(b, c) < min(v, w)) return false;
                crossing = true;
                if (min(twice_area(z, a, b, d), twice_area(z, a, d, c)) > MIN_FLIPPED_AREA) {
                    flip(mesh, t, k);
                    break;
                }
            }
        }
        if (!crossing) return true;
    }
    return false;
}

void push_all(Growing &grown) {
    for (Index t = 0; t < grown.triangles; t++) grown.stack.push(t);
}

// Insert the vertices from `border` to `given` and recover the edges between them. False if that is impossible.
bool insert_given(Growing &grown, Index border, Index given, Links links) {
    const Links none = {links.next, 0};
    push_all(grown);
    legalise(grown.z, grown.mesh, grown.stack, 0, none);
    for (Index v = border; v < given; v++) {
        Index t = holder_of(grown, grown.z[v]);
        if (insert(grown, t, v, 0, none)) continue;
        // The vertex lies on a side, or nearly so: split the side with which it spans the least area.
        double best = INFINITY;
        int side = -1;
        for (int k = 0; k < 3; k++) {
            const Index *corners = grown.mesh.faces[t];
            double area = twice_area(grown.z, corners[after(k)], corners[before(k)], v);
            if (grown.mesh.across[t][k] >= 0 && area < best) best = area, side = k;
        }
        if (side < 0) return false;
        split(grown, v, t, side, 0, none);
    }
    for (Index v = 0; v < given; v++)
        if (links.next[v] >= 0 && !recover_edge(grown.z, grown.mesh, grown.triangles, v, links.next[v], links))
            return false;
    push_all(grown);
    legalise(grown.z, grown.mesh, grown.stack, 0, links);
    return true;
}

// Remove the triangles inside holes, whose outlines are the vertices from `first` to `last`, each linked to the next
// one with the hole on the right. Returns the number of remaining triangles.
Index remove_holes(Triangles mesh, Index triangles, Index first, Index last, Links links, Stack stack) {
    constexpr Index KEPT = 0, REMOVED = -1;
    Buffer<Index> place(triangles, KEPT);  // later the new index of each remaining triangle
    if (!place) return OUT_OF_MEMORY;
    stack.entries[0] = 0;
    for (Index t = 0; t < triangles; t++)
        for (int k = 0; k < 3; k++) {
            Index a = mesh.faces[t][k], b = mesh.faces[t][after(k)];
            if (first <= b && b < last && links.next[b] == a && place[t] == KEPT) {
                place[t] = REMOVED;
                stack.push(t);
            }
        }
    while (!stack.empty()) {
        Index t = stack.pop();
        for (int k = 0; k < 3; k++) {
            Index u = mesh.across[t][k];
            if (u < 0 || place[u] == REMOVED || links.join(mesh.faces[t][after(k)], mesh.faces[t][before(k)])) continue;
            place[u] = REMOVED;
            stack.push(u);
        }
    }
    Index left = 0;
    for (Index t = 0; t < triangles; t++)
        if (place[t] != REMOVED) place[t] = left++;
    for (Index t = 0; t < triangles; t++) {
        Index to = place[t];
        if (to < 0) continue;
        for (int k = 0; k < 3; k++) {
            Index u = mesh.across[t][k];
            mesh.faces[to][k] = mesh.faces[t][k];
            mesh.across[to][k] = u < 0 ? -1 : place[u];
        }
    }
    for (Index t = left; t < triangles; t++)
        for (int k = 0; k < 3; k++) mesh.across[t][k] = -1;
    return left;
}

// --- Delaunay refinement ---

// The largest allowed area of triangles on a grid of square cells; points outside belong to the nearest cell.
struct SizeGrid {
    Complex corner;
    double side;
    Index columns, rows;
    const double *areas;  // (columns, rows)

    double limit(double x, double y) const {
        double column = min(max((x - corner.re) / side, 0.0), static_cast<double>(columns - 1));
        double row = min(max((y - corner.im) / side, 0.0), static_cast<double>(rows - 1));
        return areas[static_cast<Index>(column) * rows + static_cast<Index>(row)];
    }
};

// Work space of refinement: marks of the triangles whose circumcircles contain the newest point, and a list of them.
struct Cavity {
    Index *mark;  // (capacity for triangles,) initially zeros
    Index *members;
    Index room;
};

// The circumcentre of a triangle, relative to its third corner.
Complex circumcentre(Complex a, Complex b, Complex c) {
    Complex u = a - c, v = b - c;
    double uu = dot(u, u), vv = dot(v, v), half = 0.5 / cross(u, v);
    return {(v.im * uu - u.im * vv) * half, (u.re * vv - v.re * uu) * half};
}

// Whether triangle t is too large or too thin, and its circumcentre, whose insertion would remove it.
bool is_bad(const Growing &grown, Index t, const SizeGrid &sizes, bool only_large, Complex &centre) {
    // The least angle follows from the shortest side and the circumradius, sin α = l / 2r (Ruppert 1995, §1). Above 28°
    // refinement does not terminate in practice.
    constexpr double MIN_SQUARED_SINE = 0.17860619515673035;  // of 25°
    const Index *corners = grown.mesh.faces[t];
    Complex a = grown.z[corners[0]], b = grown.z[corners[1]], c = grown.z[corners[2]];
    Complex offset = circumcentre(a, b, c);
    centre = c + offset;
    Complex sum = a + b + c;
    bool large = 0.5 * cross(b - a, c - a) > sizes.limit(sum.re / 3, sum.im / 3);
    double shortest = min(min(dot(b - a, b - a), dot(c - b, c - b)), dot(a - c, a - c));
    bool thin = shortest < 4 * dot(offset, offset) * MIN_SQUARED_SINE;
    return large || (thin && !only_large);
}

// The triangle that contains a point, found by walking there from t; -1 if the path leaves the polygon, crosses a line,
// or is too long.
Index walk(const Growing &grown, Index t, Complex point, Links links) {
    constexpr int MAX_STEPS = 200;
    for (int step = 0; step < MAX_STEPS; ++step) {
        const Index *corners = grown.mesh.faces[t];
        int out = -1;
        for (int k = 0; k < 3 && out < 0; k++) {
            Complex a = grown.z[corners[after(k)]], b = grown.z[corners[before(k)]];
            if (cross(b - a, point - a) < 0) out = k;
        }
        if (out < 0) return t;
        if (links.join(corners[after(out)], corners[before(out)])) return -1;
        Index next = grown.mesh.across[t][out];
        if (next < 0 || next == t) return next;
        t = next;
    }
    return -1;
}

// Whether vertex v, inside triangle t, sees an edge of the outline or of a line in its cavity (the triangles whose
// circumcircles contain it) under too wide an angle.
bool encroaches(const Growing &grown, Index t, Index v, Cavity cavity, Index stamp, Links links) {
    constexpr double MIN_COSINE = -0.3;  // chosen by hand; Ruppert's diametral circle would be 0
    cavity.members[0] = t, cavity.mark[t] = stamp;
    Index count = 1;
    for (Index at = 0; at < count; ++at) {
        t = cavity.members[at];
        const Index *corners = grown.mesh.faces[t];
        for (int k = 0; k < 3; k++) {
            Index u = grown.mesh.across[t][k];
            if (u < 0 || links.join(corners[after(k)], corners[before(k)])) {
                Complex a = grown.z[corners[after(k)]] - grown.z[v], b = grown.z[corners[before(k)]] - grown.z[v];
                if (dot(a, b) < MIN_COSINE * size(a) * size(b)) return true;
            } else if (cavity.mark[u] != stamp && count < cavity.room) {
                const Index *other = grown.mesh.faces[u];
                if (in_circle(grown.z, other[0], other[1], other[2], v))
                    cavity.members[count++] = u, cavity.mark[u] = stamp;
            }
        }
    }
    return false;
}

constexpr int MAX_ROUNDS = 60;  // of refinement; icons needed at most 8

// Insert circumcentres, at first those of large triangles only, until no triangle can be improved.
void refine(Growing &grown, Index fixed, Links links, Cavity cavity, const SizeGrid &sizes) {
    push_all(grown);
    legalise(grown.z, grown.mesh, grown.stack, fixed, links);
    Index stamp = 0;
    for (int round = 0; round < MAX_ROUNDS; ++round) {
        Index before_round = grown.vertices;
        // Triangles that arise in this round wait for the next one.
        for (Index t = 0, end = grown.triangles; t < end; t++) {
            Complex centre;
            if (!is_bad(grown, t, sizes, round == 0, centre) || grown.vertices + 1 >= grown.room) continue;
            Index holder = walk(grown, t, centre, links);
            if (holder < 0) continue;
            grown.z[grown.vertices] = centre;
            if (encroaches(grown, holder, grown.vertices, cavity, ++stamp, links)) continue;
            if (insert(grown, holder, grown.vertices, fixed, links)) ++grown.vertices;
        }
        if (grown.vertices == before_round && round > 0) break;
    }
}

// Split all inner edges that join two of the first `given` vertices, except edges of lines: while these vertices slide
// along an outline, such an edge could fold triangles.
void split_chords(Growing &grown, Index given, Links links) {
    for (int round = 0; round < MAX_ROUNDS; ++round) {
        Index before_round = grown.vertices;
        for (Index t = 0, end = grown.triangles; t < end; t++) {
            for (int k = 0; k < 3; k++) {
                Index b = grown.mesh.faces[t][after(k)], c = grown.mesh.faces[t][before(k)];
                if (grown.mesh.across[t][k] < 0 || b >= given || c >= given || grown.vertices >= grown.room ||
                    links.join(b, c))
                    continue;
                grown.z[grown.vertices] = 0.5 * (grown.z[b] + grown.z[c]);
                split(grown, grown.vertices, t, k, given, links);
                ++grown.vertices;
                break;
            }
        }
        if (grown.vertices == before_round) break;
    }
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Triangulate a simple counter-clockwise polygon by ear clipping. Returns the number of triangles, -1 on failure.
//
//   z       (n,) vertices
//   n       number of vertices
//   faces   (at least n - 2, 3) written: triangles
//   across  (at least n - 2, 3) written: their neighbours
ICCM_EXPORT int64_t iccm_meshing_clip_ears(const Complex *z, int64_t n, int64_t *faces, int64_t *across) {
    Buffer<Index> lists(4 * n);
    if (!lists) return OUT_OF_MEMORY;
    Index *first = lists.data;
    return clip_ears(z, n, {first, first + n, first + 2 * n, first + 3 * n}, {rows<3>(faces), rows<3>(across)});
}

// Insert vertices into a triangulation and recover the edges between them. Returns the number of triangles, or -1 if an
// edge cannot be recovered.
//
//   z           (given,) vertices
//   border      number of vertices in the triangulation
//   given       number of given vertices
//   faces       (at least 2 given, 3) triangles, changed
//   across      (at least 2 given, 3) their neighbours, changed
//   triangles   number of triangles
//   links       (given,) for each vertex the one to which it must be joined by an edge, -1 for none
//   stack       (stack_size,) work space
//   stack_size  capacity of the stack
ICCM_EXPORT int64_t iccm_meshing_insert(Complex *z, int64_t border, int64_t given, int64_t *faces, int64_t *across,
                                        int64_t triangles, const int64_t *links, int64_t *stack, int64_t stack_size) {
    stack[0] = 0;
    Growing grown = {z, {rows<3>(faces), rows<3>(across)}, {stack, stack_size}, given, triangles, given};
    return insert_given(grown, border, given, {links, given}) ? grown.triangles : -1;
}

// Remove the triangles inside holes. Returns the number of remaining triangles.
//
//   faces       (triangles, 3) triangles, changed
//   across      (triangles, 3) their neighbours, changed
//   triangles   number of triangles
//   first       first vertex of the holes' outlines
//   last        end of these vertices, exclusive: each is linked to the next one, with the hole on the right
//   links       (given,) for each vertex the one to which it must be joined by an edge, -1 for none
//   given       number of vertices with links
//   stack       (stack_size,) work space
//   stack_size  capacity of the stack
ICCM_EXPORT int64_t iccm_meshing_remove_holes(int64_t *faces, int64_t *across, int64_t triangles, int64_t first,
                                              int64_t last, const int64_t *links, int64_t given, int64_t *stack,
                                              int64_t stack_size) {
    Triangles mesh = {rows<3>(faces), rows<3>(across)};
    return remove_holes(mesh, triangles, first, last, {links, given}, {stack, stack_size});
}

// Refine a triangulation until its triangles are small and round enough, and no inner edge joins two of the given
// vertices but for those linked. Returns the number of vertices.
//
//   z           (room,) vertices, written
//   given       number of given vertices
//   room        capacity for vertices
//   faces       (2 room, 3) triangles, written
//   across      (2 room, 3) their neighbours, written
//   triangles   (1,) number of triangles, changed
//   links       (given,) for each vertex the one to which it must be joined by an edge, -1 for none
//   stack       (stack_size,) work space
//   stack_size  capacity of the stack
//   corner_x    x of the lower left corner of a grid of square cells
//   corner_y    y of that corner
//   side        side of a cell
//   areas       (columns, row_count) largest allowed area of triangles in each cell; points outside belong to the
//               nearest one
//   columns     number of columns
//   row_count   number of rows
ICCM_EXPORT int64_t iccm_meshing_refine(Complex *z, int64_t given, int64_t room, int64_t *faces, int64_t *across,
                                        int64_t *triangles, const int64_t *links, int64_t *stack, int64_t stack_size,
                                        double corner_x, double corner_y, double side, const double *areas,
                                        int64_t columns, int64_t row_count) {
    constexpr Index MAX_CAVITY = 4000;  // most triangles that a vertex may replace
    Buffer<Index> mark(2 * room, 0), members(MAX_CAVITY);
    if (!mark || !members) return OUT_OF_MEMORY;
    stack[0] = 0;
    Growing grown = {z, {rows<3>(faces), rows<3>(across)}, {stack, stack_size}, given, *triangles, room};
    const Links kept = {links, given};
    const SizeGrid sizes = {{corner_x, corner_y}, side, columns, row_count, areas};
    refine(grown, 0, kept, {mark.data, members.data, MAX_CAVITY}, sizes);
    split_chords(grown, given, kept);
    *triangles = grown.triangles;
    return grown.vertices;
}

// Flip edges that cross the segment from vertex v to w until it is an edge of the mesh. Returns 1, or 0 if that is
// impossible.
//
//   z          (n,) vertices
//   faces      (triangles, 3) triangles, changed
//   across     (triangles, 3) their neighbours, changed
//   triangles  number of triangles
//   v          start of the segment
//   w          its end
//   links      (linked,) the vertex to which each of the first vertices must be joined, -1 for none; links from
//              vertices below both v and w are edges of the mesh already
//   linked     number of vertices with links
ICCM_EXPORT int64_t iccm_meshing_recover(const Complex *z, int64_t *faces, int64_t *across, int64_t triangles,
                                         int64_t v, int64_t w, const int64_t *links, int64_t linked) {
    return recover_edge(z, {rows<3>(faces), rows<3>(across)}, triangles, v, w, {links, linked});
}

// Flip edges, starting with the triangles on the stack, until all but the linked ones are Delaunay. Returns 0.
//
//   z           (n,) vertices
//   faces       (t, 3) triangles, changed
//   across      (t, 3) their neighbours, changed
//   links       (linked,) edges that stay
//   linked      number of vertices with links
//   stack       (stack_size,) triangles to visit, after their number; emptied
//   stack_size  capacity of the stack
ICCM_EXPORT int64_t iccm_meshing_legalise(const Complex *z, int64_t *faces, int64_t *across, const int64_t *links,
                                          int64_t linked, int64_t *stack, int64_t stack_size) {
    legalise(z, {rows<3>(faces), rows<3>(across)}, {stack, stack_size}, 0, {links, linked});
    return 0;
}
