"""A GLB with everything that artists put into one, made and read by pygltflib, which iccm does not use."""

import io

import numpy as np
import pygltflib as gl
from PIL import Image

DTYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


def png(colour, size=16):
    stream = io.BytesIO()
    Image.new("RGB", (size, size), colour).save(stream, "PNG")
    return stream.getvalue()


class Builder:
    """Builds the accessors and pictures of a file."""

    def __init__(self):
        self.file, self.data = gl.GLTF2(asset=gl.Asset(version="2.0", generator="a test")), b""

    def view(self, data, **fields):
        self.data += bytes(-len(self.data) % 4)
        self.file.bufferViews.append(
            gl.BufferView(buffer=0, byteOffset=len(self.data), byteLength=len(data), **fields)
        )
        self.data += data
        return len(self.file.bufferViews) - 1

    def accessor(self, values, kind, normalized=False, plain=False):
        values = np.ascontiguousarray(values)
        code = next(code for code, dtype in DTYPES.items() if dtype == values.dtype)
        bounds = (
            {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()} if kind == "VEC3" else {}
        )
        row = values.dtype.itemsize * WIDTH[kind]
        stride = {"byteStride": row, "target": 34962} if kind.startswith("VEC") and not plain else {}
        self.file.accessors.append(
            gl.Accessor(
                bufferView=self.view(values.tobytes(), **stride),
                componentType=code,
                count=len(values),
                type=kind,
                normalized=normalized,
                **bounds,
            )
        )
        return len(self.file.accessors) - 1

    def texture(self, content, **fields):
        view = self.view(content)
        self.file.images.append(gl.Image(bufferView=view, mimeType="image/png", name=f"picture {view}"))
        self.file.textures.append(gl.Texture(source=len(self.file.images) - 1, **fields))
        return len(self.file.textures) - 1

    def bytes(self):
        self.file.buffers.append(gl.Buffer(byteLength=len(self.data)))
        self.file.set_binary_blob(self.data)
        return b"".join(self.file.save_to_bytes())


def sheet(n=6):
    """A bent sheet of triangles: positions, unit normals, coordinates with v down, faces."""
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij"))
    k = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (k[:-1, :-1].ravel(), k[1:, :-1].ravel(), k[1:, 1:].ravel(), k[:-1, 1:].ravel())
    z = 0.3 * np.cos(2 * x)
    normal = np.column_stack([0.6 * np.sin(2 * x), 0 * x, 1 + 0 * x])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    uv = np.column_stack([0.1 + 0.8 * y, 0.1 + 0.8 * x])  # rotated by 90 degrees
    return (
        np.column_stack([x, y, z]),
        normal,
        uv,
        np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]),
    )


def attributes_of(make, points, normal, uv, rng):
    """Create accessors for all attributes that a vertex may have."""
    n = len(points)
    tangent, share = np.tile([0.0, 1, 0, 1], (n, 1)), rng.uniform(0.1, 0.9, n)
    joints, weights = np.tile([0, 1, 0, 0], (n, 1)), np.column_stack([share, 1 - share, 0 * share, 0 * share])
    return gl.Attributes(
        POSITION=make.accessor(points.astype(np.float32), "VEC3"),
        NORMAL=make.accessor(normal.astype(np.float32), "VEC3"),
        TANGENT=make.accessor(tangent.astype(np.float32), "VEC4"),
        TEXCOORD_0=make.accessor(uv.astype(np.float32), "VEC2"),
        COLOR_0=make.accessor(rng.integers(0, 255, (n, 4)).astype(np.uint8), "VEC4", True),
        JOINTS_0=make.accessor(joints.astype(np.uint8), "VEC4"),
        WEIGHTS_0=make.accessor(weights.astype(np.float32), "VEC4"),
    )


def rich(points, normal, uv, faces, bump=None, **more):
    """Return the bytes of a file whose first mesh, `body`, is this surface; `bump` is its normal map, and further
    pictures are `colour`, `rough`, `occlusion` and `light`.
    """
    make, rng = Builder(), np.random.default_rng(3)
    file = make.file
    file.samplers.append(gl.Sampler(magFilter=9728, minFilter=9984, wrapS=33071, wrapT=33648))
    plain = {"colour": png((200, 90, 40)), "bump": bump or png((128, 128, 255)), "rough": png((0, 180, 20))}
    textures = {name: make.texture(content, sampler=0) for name, content in (plain | more).items()}
    colour, bump, rough = (textures[name] for name in plain)
    look = gl.PbrMetallicRoughness(
        baseColorFactor=[0.9, 0.8, 0.7, 1.0],
        baseColorTexture=gl.TextureInfo(index=colour),
        metallicRoughnessTexture=gl.TextureInfo(index=rough),
    )
    skin = gl.Material(
        name="skin", pbrMetallicRoughness=look, normalTexture=gl.NormalMaterialTexture(index=bump, scale=0.7)
    )
    if "occlusion" in textures:
        skin.occlusionTexture = gl.OcclusionTextureInfo(index=textures["occlusion"], strength=0.8)
    if "light" in textures:
        skin.emissiveTexture, skin.emissiveFactor = gl.TextureInfo(index=textures["light"]), [1.0, 0.5, 0.5]
    file.materials += [skin, gl.Material(name="other", extras={"by": "hand"})]
    body = gl.Primitive(
        attributes=attributes_of(make, points, normal, uv, rng),
        indices=make.accessor(faces.astype(np.uint16).reshape(-1, 1), "SCALAR"),
        material=0,
        targets=[{"POSITION": make.accessor(rng.normal(0, 0.1, points.shape).astype(np.float32), "VEC3")}],
    )
    hat = gl.Primitive(
        attributes=gl.Attributes(POSITION=make.accessor((points[:3] + 2).astype(np.float32), "VEC3")),
        indices=make.accessor(np.arange(3, dtype=np.uint8)[:, None], "SCALAR"),
        material=1,
    )
    file.meshes += [
        gl.Mesh(name="body", primitives=[body], weights=[0.5], extras={"targetNames": ["breathe"]}),
        gl.Mesh(name="hat", primitives=[hat]),
    ]
    back = np.eye(4, dtype=np.float32)
    back[3, 1] = -1  # column by column: down by the height of the hip
    poses = make.accessor(np.tile(back.ravel(), (2, 1)), "MAT4")
    file.skins.append(gl.Skin(joints=[2, 3], inverseBindMatrices=poses))
    times = make.accessor(np.array([[0], [1]], np.float32), "SCALAR")
    file.accessors[times].min, file.accessors[times].max = [0.0], [1.0]
    turns = make.accessor(np.array([[0, 0, 0, 1], [0, 0, 1, 0]], np.float32), "VEC4", plain=True)
    file.animations.append(
        gl.Animation(
            name="wave",
            samplers=[gl.AnimationSampler(input=times, output=turns)],
            channels=[
                gl.AnimationChannel(sampler=0, target=gl.AnimationChannelTarget(node=3, path="rotation"))
            ],
        )
    )
    file.nodes += [
        gl.Node(name="world", children=[2, 4]),
        gl.Node(name="person", mesh=0, skin=0),
        gl.Node(name="hip", children=[3], translation=[0, 1, 0]),
        gl.Node(name="hand", extras={"grip": 3}),
        gl.Node(name="on top", mesh=1, rotation=[0, 0.6, 0, 0.8], scale=[2, 2, 2]),
    ]
    file.scenes.append(gl.Scene(nodes=[0, 1]))
    file.scene = 0
    return make.bytes()


def values(file, number):
    """Return (n, k) the values of an accessor in a file read by pygltflib."""
    accessor = file.accessors[number]
    view, width = file.bufferViews[accessor.bufferView], WIDTH[accessor.type]
    dtype = np.dtype(DTYPES[accessor.componentType])
    stride = view.byteStride or width * dtype.itemsize
    offset = (view.byteOffset or 0) + (accessor.byteOffset or 0)
    blob = file.binary_blob()
    return np.ndarray((accessor.count, width), dtype, blob, offset, (stride, dtype.itemsize)).copy()


def picture(file, texture):
    """The picture file of a texture."""
    view = file.bufferViews[file.images[file.textures[texture].source].bufferView]
    return file.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]


def read(path):
    return gl.GLTF2().load_binary(str(path))


def read_bytes(content):
    return gl.GLTF2().load_from_bytes(content)
