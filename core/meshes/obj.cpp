// Wavefront OBJ files: one pass counts lines, one fills arrays, and one rewrites texture indices.
//
// A line ends at \n or \r; a backslash before that continues it. Numbers of up to 15 digits are converted exactly here
// (Clinger, How to read floating point numbers accurately, PLDI 1990, the fast path: both the digits and the power of
// ten are exact as doubles, so their product or quotient is rounded once). The other numbers are listed for the caller.

#include "iccm/core.h"

namespace iccm {
namespace {

struct Text {
    const uint8_t *bytes;
    Index size;

    uint8_t operator[](Index k) const { return bytes[k]; }
};

// Kinds of lines; the same numbers as in iccm/io/meshes/obj_scan.py.
enum Kind { OTHER, VERTEX, TEXTURE, NORMAL, FACE, STATEMENT, KINDS };

// Faults of a line; the same numbers as there.
enum Fault { NONE, FEW_CORNERS, BAD_INDEX, FEW_NUMBERS };

constexpr Index ABSENT = -1;   // an index that is not given
constexpr Index OUTSIDE = -2;  // an index that reaches before the first element

// The next non-blank byte; the end of a continued line is blank.
Index skip_blanks(Text text, Index k) {
    Index n = text.size;
    while (k < n) {
        uint8_t c = text[k];
        if (c == ' ' || c == '\t')
            k += 1;
        else if (c == '\\' && k + 1 < n && text[k + 1] == '\n')
            k += 2;
        else if (c == '\\' && k + 2 < n && text[k + 1] == '\r' && text[k + 2] == '\n')
            k += 3;
        else
            break;
    }
    return k;
}

// The byte after a word.
Index word_end(Text text, Index k) {
    while (k < text.size && text[k] > ' ' && text[k] != '\\') k++;
    return k;
}

// The word after the one that begins at k and ends at `end`; always beyond k, also at a control character.
Index next_word(Text text, Index k, Index end) { return skip_blanks(text, max(end, k + 1)); }

// The byte after the logical line that contains byte k.
Index next_line(Text text, Index k) {
    while (k < text.size) {
        if (text[k] == '\\')
            k = max(skip_blanks(text, k), k + 1);
        else if (text[k] == '\n' || text[k] == '\r')
            return k + 1;
        else
            k++;
    }
    return text.size;
}

// Whether a line ends at byte k, or a comment begins.
bool at_end(Text text, Index k) { return k >= text.size || text[k] == '\n' || text[k] == '\r' || text[k] == '#'; }

// The kind of a line whose first word is from k to end.
Kind kind_of(Text text, Index k, Index end) {
    Index length = end - k;
    if (length == 0) return OTHER;
    uint8_t first = text[k];
    if (length == 1) {
        if (first == 'v') return VERTEX;
        if (first == 'f') return FACE;
        if (first == 'o' || first == 'g') return STATEMENT;
    } else if (length == 2 && first == 'v') {
        if (text[k + 1] == 't') return TEXTURE;
        if (text[k + 1] == 'n') return NORMAL;
    } else if (length == 6 && (first == 'u' || first == 'm')) {  // usemtl, mtllib
        return STATEMENT;
    }
    return OTHER;
}

// The integer from k to end. False if there is none, or if it has more than 15 characters.
bool whole_number(Text text, Index k, Index end, Index &value) {
    value = 0;
    bool negative = k < end && text[k] == '-';
    if (negative || (k < end && text[k] == '+')) k++;
    if (k == end || end - k > 15) return false;
    Index digits = 0;
    for (; k < end; k++) {
        if (text[k] < '0' || text[k] > '9') return false;
        digits = digits * 10 + (text[k] - '0');
    }
    value = negative ? -digits : digits;
    return true;
}

// 10^0 to 10^22, the powers that doubles represent exactly.
constexpr int MAX_POWER = 22;
constexpr double POWERS[MAX_POWER + 1] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                          1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

// The decimal number from k to end. False, and 0, if it has too many digits for an exact conversion or is not a number.
bool decimal_number(Text text, Index k, Index end, double &value) {
    value = 0.0;
    bool negative = k < end && text[k] == '-';
    if (negative || (k < end && text[k] == '+')) k++;
    Index mantissa = 0, digits = 0, exponent = 0, start = k;
    bool point = false;
    for (; k < end; k++) {
        uint8_t c = text[k];
        if (c >= '0' && c <= '9') {
            mantissa = mantissa * 10 + (c - '0');
            digits += mantissa > 0;
            exponent -= point;
        } else if (c == '.' && !point) {
            point = true;
        } else {
            break;
        }
        if (digits > 15) return false;
    }
    if (k <= start || (k == start + 1 && point)) return false;
    if (k < end) {
        Index shift;
        if ((text[k] != 'e' && text[k] != 'E') || !whole_number(text, k + 1, end, shift)) return false;
        exponent += shift;
    }
    if (exponent < -MAX_POWER || exponent > MAX_POWER) return false;
    double digits_value = static_cast<double>(mantissa);
    value = exponent < 0 ? digits_value / POWERS[-exponent] : digits_value * POWERS[exponent];
    if (negative) value = -value;
    return true;
}

// Numbers of one kind of line, and those that the caller must convert: their index among all, and their byte.
struct Numbers {
    double *values;  // (lines, width)
    Index width;
    Index (*slow)[2];
    Index slow_count;
};

// Read up to `width` numbers of line i from byte k on. Returns how many were read.
Index read_numbers(Text text, Index k, Index i, Numbers &numbers) {
    Index count = 0;
    while (count < numbers.width && !at_end(text, k)) {
        Index end = word_end(text, k), place = numbers.width * i + count++;
        if (!decimal_number(text, k, end, numbers.values[place])) {
            Index *listed = numbers.slow[numbers.slow_count++];
            listed[0] = place, listed[1] = k;
        }
        k = next_word(text, k, end);
    }
    return count;
}

// The zero-based index written from k to end, after `seen` elements; ABSENT if nothing is written. False if it is not a
// valid index.
bool resolve(Text text, Index k, Index end, Index seen, Index &index) {
    index = ABSENT;
    if (k == end) return true;
    bool good = whole_number(text, k, end, index) && index != 0;
    if (!good) {
        index = 0;
        return false;
    }
    if (index > 0)
        index -= 1;
    else
        index = seen + index >= 0 ? seen + index : OUTSIDE;
    return true;
}

// The next slash, or the end.
Index slash(Text text, Index k, Index end) {
    while (k < end && text[k] != '/') k++;
    return k;
}

// The text of a face's corner, `v/vt/vn`, from k to end; missing slashes have `one` and `two` at the end.
struct Corner {
    Index k, one, two, end;
};

Corner corner_at(Text text, Index k) {
    Index end = word_end(text, k), one = slash(text, k, end);
    return {k, one, slash(text, min(one + 1, end), end), end};
}

// The arrays of iccm.io.meshes.obj.Obj to fill in.
struct Arrays {
    Numbers v, vt, vn;
    Index *vt_at, *face_at, *starts, *corner_at;
    Index (*corners)[2];
    Index *normals;
    bool *relative;
    Index *statement_at;
};

// Read the corners of face i from byte k on; `seen` is the number of lines of each kind before it, c that of corners.
Fault read_face(Text text, Index k, Index i, const Index *seen, Arrays &out, Index &c) {
    while (!at_end(text, k)) {
        Corner corner = corner_at(text, k);
        Index end = corner.end;
        bool vertex = resolve(text, k, corner.one, seen[VERTEX], out.corners[c][0]);
        bool texture = resolve(text, min(corner.one + 1, end), corner.two, seen[TEXTURE], out.corners[c][1]);
        bool normal = resolve(text, min(corner.two + 1, end), end, seen[NORMAL], out.normals[c]);
        if (!normal) out.normals[c] = ABSENT;  // a bad normal is ignored, since normals are optional
        if (!(vertex && texture) || corner.one == k) return BAD_INDEX;
        out.relative[c] = corner.one + 1 < end && text[corner.one + 1] == '-';
        out.corner_at[c] = k;
        c++;
        k = next_word(text, k, end);
    }
    out.starts[i + 1] = c;
    return c - out.starts[i] < 3 ? FEW_CORNERS : NONE;
}

// Fill the arrays. If a line has a fault, `place` is its first byte.
Fault fill(Text text, Arrays &out, Index &place) {
    Index seen[KINDS] = {}, c = 0;
    out.starts[0] = 0;
    for (Index k = 0; k < text.size; k = next_line(text, k)) {
        Index line = k;
        k = skip_blanks(text, k);
        Index end = word_end(text, k);
        Kind kind = kind_of(text, k, end);
        Index i = seen[kind];
        Fault fault = NONE;
        if (kind == VERTEX) {
            if (read_numbers(text, skip_blanks(text, end), i, out.v) < 3) fault = FEW_NUMBERS;
        } else if (kind == TEXTURE) {
            out.vt_at[i] = line;
            if (read_numbers(text, skip_blanks(text, end), i, out.vt) < 1) fault = FEW_NUMBERS;
        } else if (kind == NORMAL) {
            read_numbers(text, skip_blanks(text, end), i, out.vn);  // missing ones stay 0
        } else if (kind == STATEMENT) {
            out.statement_at[i] = line;
        } else if (kind == FACE) {
            out.face_at[i] = line;
            fault = read_face(text, skip_blanks(text, end), i, seen, out, c);
        }
        if (fault != NONE) {
            place = line;
            return fault;
        }
        seen[kind]++;
    }
    return NONE;
}

// Write a number in decimal digits; returns their count.
Index write_number(Index value, uint8_t *out) {
    uint8_t digits[20];
    Index count = 0;
    for (; value > 0; value /= 10) digits[count++] = static_cast<uint8_t>('0' + value % 10);
    for (Index d = 0; d < count; d++) out[d] = digits[count - 1 - d];
    return count;
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Count the lines of an OBJ file. Returns the number of face corners.
//
//   data   (size,) bytes
//   size   number of bytes
//   lines  (6,) written: numbers of other lines, v, vt, vn, f, and statements (o, g, usemtl, mtllib)
ICCM_EXPORT int64_t iccm_meshes_count_obj(const uint8_t *data, int64_t size, int64_t *lines) {
    const Text text = {data, size};
    for (Index kind = 0; kind < KINDS; kind++) lines[kind] = 0;
    Index corners = 0;
    for (Index k = 0; k < size; k = next_line(text, k)) {
        k = skip_blanks(text, k);
        Index end = word_end(text, k);
        if (end == k) continue;
        Kind kind = kind_of(text, k, end);
        lines[kind]++;
        if (kind != FACE) continue;
        for (k = skip_blanks(text, end); !at_end(text, k); k = next_word(text, k, word_end(text, k))) corners++;
    }
    return corners;
}

// Fill the arrays of an OBJ file, whose sizes `iccm_meshes_count_obj` counts. Returns 0, or a line's fault: 1 too few
// corners, 2 a bad index, 3 too few numbers.
//
//   data          (size,) bytes
//   size          number of bytes
//   v             (lines, 3) zeros; written: vertices
//   vt            (lines, 2) zeros; written: texture coordinates
//   vn            (lines, 3) zeros; written: normals
//   vt_at         (lines,) written: the byte at which each line of vt begins
//   face_at       (lines,) written: the byte at which each face begins
//   starts        (lines + 1,) written: where the corners of each face begin
//   corner_at     (corners,) written: the byte at which each corner begins
//   corners       (corners, 2) written: zero-based vertex and texture coordinates; -1 for none, -2 before the first
//   normals       (corners,) written: zero-based normals; -1 and -2 as above
//   relative      (corners,) written: whether the index of texture coordinates is negative in the file
//   statement_at  (lines,) written: the byte at which each statement begins
//   slow_v        (numbers, 2) written: index and byte of the numbers of v that are left to convert
//   slow_vt       (numbers, 2) written: those of vt
//   slow_vn       (numbers, 2) written: those of vn
//   found         (4,) written: how many numbers of v, vt and vn are left to convert, and the first byte of the faulty
//                 line
ICCM_EXPORT int64_t iccm_meshes_fill_obj(const uint8_t *data, int64_t size, double *v, double *vt, double *vn,
                                         int64_t *vt_at, int64_t *face_at, int64_t *starts, int64_t *corner_at,
                                         int64_t *corners, int64_t *normals, bool *relative, int64_t *statement_at,
                                         int64_t *slow_v, int64_t *slow_vt, int64_t *slow_vn, int64_t *found) {
    Arrays out = {{v, 3, rows<2>(slow_v), 0},
                  {vt, 2, rows<2>(slow_vt), 0},
                  {vn, 3, rows<2>(slow_vn), 0},
                  vt_at,
                  face_at,
                  starts,
                  corner_at,
                  rows<2>(corners),
                  normals,
                  relative,
                  statement_at};
    found[3] = 0;
    Fault fault = fill({data, size}, out, found[3]);
    found[0] = out.v.slow_count, found[1] = out.vt.slow_count, found[2] = out.vn.slow_count;
    return fault;
}

// Copy a part of an OBJ file with the texture indices of some corners replaced. Returns the number of bytes written.
//
//   data       (size,) bytes
//   size       number of bytes
//   start      first byte of the part
//   stop       end of the part, exclusive
//   corner_at  (c,) bytes at which the corners begin, increasing
//   new_vt     (c,) their new zero-based texture indices
//   c          number of corners
//   out        (stop - start + 20 c,) written
ICCM_EXPORT int64_t iccm_meshes_rewrite_obj(const uint8_t *data, int64_t size, int64_t start, int64_t stop,
                                            const int64_t *corner_at, const int64_t *new_vt, int64_t c, uint8_t *out) {
    const Text text = {data, size};
    Index written = 0, k = start;
    auto copy_to = [&](Index end) {
        if (end <= k) return;
        memcpy(out + written, data + k, static_cast<size_t>(end - k));
        written += end - k, k = end;
    };
    for (Index i = 0; i < c; i++) {
        Corner corner = iccm::corner_at(text, corner_at[i]);
        copy_to(corner.one);
        out[written++] = '/';
        written += write_number(new_vt[i] + 1, out + written);
        k = corner.two;
    }
    copy_to(stop);
    return written;
}
