// Shaders of the painter: the texture at a place, with grid and stretch, for patches, flat polygons and meshes.

const COLOUR = `#version 300 es
precision highp float;
uniform sampler2D texture_;
uniform vec4 box;          // of the texture: left, top, right, bottom
uniform bool bounded;      // whether nothing is beyond it
uniform float opacity, grid, step_, stretch, mean;
out vec4 colour;

float encoded(float v) { return v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1.0 / 2.4) - 0.055; }

/** The texture at a place; the metric says how long steps of a pixel are on the target. */
void paint(vec2 s, mat2 metric) {
  vec2 uv = (s - box.xy) / (box.zw - box.xy);
  bool beyond = any(lessThan(uv, vec2(0))) || any(greaterThan(uv, vec2(1)));
  vec4 c = textureGrad(texture_, bounded ? clamp(uv, 0.0, 1.0) : uv, dFdx(uv), dFdy(uv));
  if (beyond && bounded) c = vec4(0);
  vec3 rgb = c.a > 0.0 ? c.rgb / c.a : vec3(0);
  c = vec4(vec3(encoded(rgb.r), encoded(rgb.g), encoded(rgb.b)) * c.a, c.a) * opacity;
  colour = c;
  if (stretch == 0.0 && grid == 0.0) return;
  mat2 j = mat2(dFdx(s), dFdy(s)), m = j * inverse(metric) * transpose(j) / (mean * mean);
  float size = m[0][0] + m[1][1], area = sqrt(max(determinant(m), 0.0));
  float root = sqrt(max(size * size - 4.0 * area * area, 0.0));
  float most = max(sqrt(0.5 * (size + root)), 1.0 / max(sqrt(max(0.5 * (size - root), 0.0)), 1e-4));
  float heat = clamp(0.5 * log2(most), 0.0, 1.0) * stretch;
  vec3 hot = mix(vec3(1.0, 0.85, 0.2), vec3(0.65, 0.0, 0.15), heat);
  c = mix(c, vec4(hot, 1.0) * opacity, 0.85 * smoothstep(0.0, 0.35, heat));
  vec2 at = s / step_, line = abs(fract(at - 0.5) - 0.5) / max(fwidth(at), vec2(1e-9));
  float ink = grid * (1.0 - smoothstep(0.4, 1.4, min(line.x, line.y)));
  colour = mix(c, vec4(0.05, 0.1, 0.2, 1.0) * max(c.a, 0.4), 0.7 * ink);
}`;

const PLACE = `
uniform vec2 centre, reach;
vec4 placed(vec2 p) { return vec4((p - centre) * reach, 0, 1); }`;

/** Vertex and fragment shader of each program. */
export const SHADERS = {
  patches: [`#version 300 es
    ${PLACE}
    in vec2 a0, a1, a2, b0, b1, b2, d0, d1, d2;
    out vec3 l;
    flat out vec4 e, f, g;
    void main() {
      int corner = gl_VertexID % 3;
      l = vec3(corner == 0, corner == 1, corner == 2);
      e = vec4(b0, b1); f = vec4(b2, d0); g = vec4(d1, d2);
      gl_Position = placed(a0 * l.x + a1 * l.y + a2 * l.z);
    }`, `${COLOUR}
    in vec3 l;
    flat in vec4 e, f, g;
    uniform float pixel;
    void main() {
      paint(l.x * e.xy + l.y * e.zw + l.z * f.xy + 2.0 * (l.y * l.z * f.zw + l.z * l.x * g.xy + l.x * l.y * g.zw),
        mat2(pixel * pixel));
    }`],
  plane: [`#version 300 es
    ${PLACE}
    in vec2 a0;
    out vec2 at;
    void main() { at = a0; gl_Position = placed(a0); }`, `${COLOUR}
    in vec2 at;
    void main() { paint(at, mat2(1)); }`],
  /** Copies the pixels of another picture of the same size. */
  copy: [`#version 300 es
    void main() { gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1); }`, `#version 300 es
    precision highp float;
    uniform sampler2D texture_;
    out vec4 colour;
    void main() { colour = texelFetch(texture_, ivec2(gl_FragCoord.xy), 0); }`],
  mesh: [`#version 300 es
    ${PLACE}
    uniform mat3 turn;
    in vec3 place;
    in vec2 source;
    out vec3 at;
    out vec2 s;
    void main() {
      vec3 p = turn * place;
      at = place;
      s = source;
      gl_Position = vec4(placed(p.xy).xy, -0.5 * p.z, 1);
    }`, `${COLOUR}
    uniform mat3 turn;
    uniform bool lit;
    in vec3 at;
    in vec2 s;
    void main() {
      vec3 p = dFdx(at), q = dFdy(at);
      paint(s, mat2(dot(p, p), dot(p, q), dot(p, q), dot(q, q)));
      if (!lit) return;
      float facing = abs((turn * normalize(cross(p, q))).z);
      colour = vec4((colour.rgb + 0.7 * (1.0 - colour.a)) * (0.45 + 0.55 * facing), 1.0);
    }`],
};
