"""Measurements of resampling: python -m tests.bench.resampling [coordinates quality scaling command batch memory large]

Every figure is a ratio within one run, since times on a shared machine mean little alone.
"""

import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from iccm.io.pictures import image_files
from iccm.maps.approximation import triangulated
from iccm.maps.harmonic import HarmonicMap
from iccm.parallel import in_order
from iccm.pixels import preimages
from iccm.pixels.canvas import BAND_ROWS, Canvas, Diagnostics
from iccm.pixels.warp import Sampler, Texture, Warp, warp

from .goals import goal, unmeasured
from .speed import ICCM, cv2, load
from .speed import took as timed

NO_GDAL = "gdalwarp is not installed: apt-get install gdal-bin"
BOX = (-1.4 - 1.4j, 1.4 + 1.4j)
VERTICES = 300


def shape(n=VERTICES):
    """Return a rounded star that fills about half of its canvas."""
    s = 2 * np.pi * np.arange(n) / n
    return (1 + 0.3 * np.cos(5 * s)) * np.exp(1j * s)


def maps():
    """Return a conformal and a harmonic map of that star."""
    p = shape()
    return {
        "conformal": HarmonicMap(p, p + 0.2 * p**2, 0 * p),
        "harmonic": HarmonicMap(p, p + 0.1 * p**2, 0.25 * p.conj() + 0.05 * p.conj() ** 2),
    }


def best(work, times=3):
    """Return the shortest time of some runs, in seconds."""
    took = []
    for _ in range(times):
        start = time.perf_counter()
        work()
        took.append(time.perf_counter() - start)
    return min(took)


def coordinates(size=4096):
    """Measure source points of every pixel: time against cv2.remap and the dense sum, error against the dense sum."""
    picture = np.random.default_rng(0).random((size, size, 4), dtype=np.float32)
    x, y = np.meshgrid(np.arange(size, dtype=np.float32), np.arange(size, dtype=np.float32))
    print(f"## Coordinates of {size}² pixels, {VERTICES} vertices, error asked for 0.05 texel")
    print(
        "map        inside    remap s  ours s  ratio  prepare s  dense f s  /ours  dense Newton step s  /ours"
        "  error max / median, texel"
    )
    for name, map in maps().items():
        canvas = Canvas(size, size, BOX)
        texel = 2.8 / size
        places = np.zeros((size, size), dtype=np.complex64)

        def ours(map=map, canvas=canvas, texel=texel, places=places):
            fresh = HarmonicMap(map.polygon, map.phi, map.psi)  # its mesh is not known yet
            raster = preimages.of(fresh, canvas, 0.05 * texel, slopes=False)
            seen = Diagnostics()
            for band in in_order(raster, range(0, canvas.height, BAND_ROWS)):
                places[band.row : band.row + len(band.z)] = band.z
                seen.add(band.diagnostics)
            return raster, seen

        raster, seen = ours()
        remap = best(lambda: cv2.remap(picture, x + 0.3, y + 0.3, cv2.INTER_CUBIC))
        took, again = best(ours), best(lambda: cv2.remap(picture, x + 0.3, y + 0.3, cv2.INTER_CUBIC))
        remap = min(remap, again)
        prepare = best(
            lambda map=map, texel=texel: triangulated(
                HarmonicMap(map.polygon, map.phi, map.psi), 0.02 * texel, 0.05 * texel
            )
        )
        error, dense = held_against_dense(map, raster, canvas, texel)
        estimate = dense * seen.inside
        print(
            f"{name:10} {seen.inside / size**2:6.0%}  {remap:9.3f} {took:7.3f} {took / remap:6.2f} {prepare:10.3f}"
            f" {estimate[0]:10.0f} {estimate[0] / took:6.0f} {estimate[1]:20.0f} {estimate[1] / took:6.0f}"
            f"  {error.max():.4f} / {np.median(error):.1e}"
        )
    print(
        f"peak memory {peak():.2f} GB, of which the test picture and remap's maps {picture.nbytes * 1.5e-9:.2f}\n"
    )


def held_against_dense(map, raster, canvas, texel, count=20_000):
    """Return errors in texels at random pixels, half of them within 8 of the outline, and seconds per pixel of the
    dense sums.
    """
    rng, z, w, at_edge = np.random.default_rng(1), [], [], []
    for band in in_order(raster, range(0, canvas.height, BAND_ROWS)):
        inner = band.coverage == 1
        edge = inner & (cv2.erode(inner.astype(np.uint8), np.ones((17, 17), np.uint8)) == 0)
        z.append(band.z[inner])
        w.append(canvas.centres(band.row, len(band.z))[inner])
        at_edge.append(edge[inner])
    z, w, at_edge = (np.concatenate(a) for a in (z, w, at_edge))
    pick = np.concatenate(
        [rng.choice(np.flatnonzero(at_edge == side), count // 2, replace=False) for side in (0, 1)]
    )
    z, w = z[pick], w[pick]
    start = time.perf_counter()
    f = map(z)
    value = time.perf_counter() - start
    a, b = map.derivatives(z)
    took = np.array([value, time.perf_counter() - start]) / count
    r = w - f
    return np.abs(a.conj() * r - b * r.conj()) / (np.abs(a) ** 2 - np.abs(b) ** 2) / texel, took


def quality():
    """Measure the PSNR against the area averages of an analytic picture pulled back through the same map."""
    print("## Quality: PSNR in dB against the exact area average of every pixel (8 or more samples a side)")
    kinds = [
        "cv2 linear",
        "cv2 cubic",
        "cv2 lanczos4",
        "skimage 1",
        "skimage 3",
        "skimage 5",
        "TextureSystem",
    ]
    kinds += ["iccm cubic", "iccm lanczos", "iccm spline"]
    print(f"{'':28}" + "".join(f"{k:>14}" for k in kinds) + "   spline is best")
    for map_name, map in maps().items():
        for row, texels, pixels, samples in (
            ("4x up", 256, 1024, 4),
            ("same", 512, 512, 8),
            ("8x down", 2048, 256, 24),
        ):
            fine = texels / 2.8
            for picture, g in pictures(
                fine * (0.4 if row != "8x down" else 0.5), fine * (0.2 if row != "8x down" else 0.03)
            ):
                result = compared(map, g, texels, pixels, samples)
                cells = "".join(f"{result[k]:14.1f}" for k in kinds)
                best_other = max(v for k, v in result.items() if not k.startswith("iccm"))
                verdict = (
                    "yes" if result["iccm spline"] > best_other - 0.005 else "NO"
                )  # to a hundredth of a decibel
                print(f"{map_name:10}{row:8} {picture:9}{cells}   {verdict}")
    print()


def pictures(fastest, slow):
    """Return a zone plate whose frequency reaches `fastest` at the boundary, and a sum of sinusoids of frequency
    `slow`.
    """
    yield "zone", lambda z: 0.5 + 0.5 * np.cos(np.pi * fastest / 1.3 * np.abs(z) ** 2)
    yield (
        "sinusoid",
        lambda z: (
            0.5
            + 0.25 * np.cos(2 * np.pi * slow * (0.8 * z.real + 0.6 * z.imag))
            + 0.25 * np.cos(2 * np.pi * slow * (0.8 * z.imag - 0.6 * z.real) + 1)
        ),
    )


def compared(map, g, texels, pixels, samples):
    """Print the PSNR of every method for one picture and one scale."""
    from skimage.transform import warp as skimage_warp

    canvas = Canvas(pixels, pixels, BOX)
    texture = g(Canvas(texels, texels, BOX).centres()).astype(np.float32)
    fine = preimages.of(map, Canvas(pixels * samples, pixels * samples, BOX), 1e-7, slopes=False)
    rows = np.concatenate(
        [
            np.nan_to_num(g(band.z)).astype(np.float32)
            for band in in_order(fine, range(0, pixels * samples, BAND_ROWS))
        ]
    )
    truth = rows.reshape(pixels, samples, pixels, samples).mean((1, 3))
    bands = list(in_order(preimages.of(map, canvas, 1e-7), range(0, pixels, BAND_ROWS)))
    z, right, down, cover = (
        np.concatenate([getattr(b, k) for b in bands]) for k in ("z", "right", "down", "coverage")
    )
    inner = cv2.erode((cover == 1).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    scale = texels / 2.8
    x, y = (np.where(inner, v, 0) for v in ((z.real + 1.4) * scale - 0.5, (1.4 - z.imag) * scale - 0.5))
    pictures = {}
    for name, flag in (
        ("linear", cv2.INTER_LINEAR),
        ("cubic", cv2.INTER_CUBIC),
        ("lanczos4", cv2.INTER_LANCZOS4),
    ):
        pictures[f"cv2 {name}"] = cv2.remap(
            texture, x.astype(np.float32), y.astype(np.float32), flag, borderMode=cv2.BORDER_REPLICATE
        )
    for order in (1, 3, 5):
        pictures[f"skimage {order}"] = skimage_warp(
            texture.astype(float), np.array([y, x]), order=order, mode="edge"
        )
    pictures["TextureSystem"] = texture_system(texture, z, right, down, inner)
    for name in ("cubic", "lanczos", "spline"):
        placed = Texture(texture[..., None], BOX, transfer="linear")
        pictures[f"iccm {name}"] = warp(map, placed, canvas, filter=name).pixels[..., 0]
    return {name: -10 * np.log10(np.mean((v[inner] - truth[inner]) ** 2)) for name, v in pictures.items()}


def texture_system(texture, z, right, down, inner):
    """Filter with OpenImageIO, point by point, from a mip-mapped file of the texture."""
    import OpenImageIO as oiio

    with tempfile.TemporaryDirectory() as folder:
        name = str(Path(folder) / "texture.exr")
        source = oiio.ImageBuf(np.ascontiguousarray(texture[..., None]))
        oiio.ImageBufAlgo.make_texture(oiio.MakeTxTexture, source, name, oiio.ImageSpec(0, 0, 0, "float"))
        system, options = oiio.TextureSystem(False), oiio.TextureOpt()
        options.swrap = options.twrap = oiio.Wrap.Clamp
        s, t = (z.real + 1.4) / 2.8, (1.4 - z.imag) / 2.8
        out = np.zeros(z.shape)
        steps = (right.real, -right.imag, down.real, -down.imag)
        for i, j in zip(*np.nonzero(inner)):
            out[i, j] = system.texture(
                name, options, float(s[i, j]), float(t[i, j]), *(float(d[i, j]) / 2.8 for d in steps), 1
            )[0]
        system.close_all()
    return out


def scaling(sizes=(1024, 2048, 4096, 8192, 16384)):
    """Measure the whole warp, streamed into a TIFF, with each size in its own process."""
    print(
        "## Warp of a 2048² 8-bit RGBA texture, streamed into a file: linear in the pixels, bounded in memory"
    )
    print("size      solve+filter+write s   ns a pixel   peak GB")
    for size in sizes:
        result = subprocess.run(
            [sys.executable, "-m", "tests.bench.resampling", "one", str(size)],
            capture_output=True,
            text=True,
            check=True,
        )
        figures = json.loads(result.stdout)
        print(
            f"{size:6}² {figures['seconds']:18.2f} {figures['seconds'] / size**2 * 1e9:16.0f} {figures['peak']:12.2f}"
        )
    print()


def run_warp(size, name=None):
    """Run one streamed warp in this process, of a file's texture or one of 2048²."""
    noise = np.random.default_rng(0)
    texture = (
        image_files.read(name).pixels if name else noise.integers(0, 256, (2048, 2048, 4), dtype=np.uint8)
    )
    map, canvas = maps()["conformal"], Canvas(size, size, BOX)
    warp(map, Texture(texture[:64, :64], BOX, 3), Canvas(64, 64, BOX))  # loads the kernels
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        work = Warp(map, Sampler(Texture(texture, BOX, 3)), canvas)
        like = image_files.Image(texture, 3)
        image_files.write_bands(Path(folder) / "out.tif", like, size, size, work.blocks())
        took = time.perf_counter() - start
    print(json.dumps({"seconds": took, "peak": peak()}))


def large(size=16384):
    """Measure a texture as large as the result, from file to file; takes minutes, and only runs when requested."""
    y, x = np.indices((256, size))
    strips = (
        np.stack(
            [((x // 64 + (y + row) // 64) % 2 * 200 + 20).astype(np.uint8)] * 3
            + [np.full(x.shape, 255, np.uint8)],
            2,
        )
        for row in range(0, size, 256)
    )
    with tempfile.TemporaryDirectory() as folder:
        name = f"{folder}/texture.tif"
        image_files.write_bands(name, image_files.Image(np.zeros((1, 1, 4), np.uint8), 3), size, size, strips)
        line = [sys.executable, "-m", "tests.bench.resampling", "one", str(size), name]
        figures = json.loads(subprocess.run(line, capture_output=True, text=True, check=True).stdout)
    print(
        f"## {size}² RGBA texture to {size}² RGBA picture: {figures['seconds']:.0f} s, peak {figures['peak']:.2f} GB\n"
    )


def command(sizes=(1024, 4096)):
    """Measure `iccm map` with a 1024² texture, including start-up, against gdalwarp -tps and ImageMagick's Shepards."""
    for size in sizes:
        took = commands(size)
        ours = took["iccm map"]
        print(f"## The whole command on a {size}² picture, start-up included; {load()}")
        for name, (wall, cpu) in took.items():
            print(
                f"{name:45} {wall:6.2f} s {wall / ours[0]:6.2f} × ours; {cpu:6.2f} CPU-s {cpu / ours[1]:6.2f} ×"
            )
        form = "-et 0" if size == 1024 else "default"
        peer = f"gdalwarp -tps {form} -multi, all threads"
        if peer in took:
            goal(f"iccm map {size}², by {peer}", ours[0] / took[peer][0], 1)
        else:
            unmeasured(f"iccm map {size}²", NO_GDAL)
        print()


def bent(z, by=0.2):
    """Return the target points of points of the source."""
    return z + by * z**2


def drawn(path, z):
    """Write an SVG file of a polygon about the middle of 1024²."""
    points = " ".join(f"{512 + 360 * v.real:.3f},{512 - 360 * v.imag:.3f}" for v in z)
    path.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1024 1024"><polygon points="{points}"/></svg>'
    )


def inputs(path, targets=(0.2,)):
    """Write a texture t.png, a source a.svg, and targets b0.svg, … bent by these amounts; return the control points."""
    noise = np.random.default_rng(0).integers(0, 256, (1024, 1024, 3), dtype=np.uint8)
    image_files.write(path / "t.png", image_files.Image(noise))
    drawn(path / "a.svg", shape(400))
    z = 360 * shape(200)
    point_pairs = []
    for k, by in enumerate(targets):
        drawn(path / f"b{k}.svg", bent(shape(400), by))
        w = 360 * bent(shape(200), by)
        point_pairs.append([(512 + a.real, 512 - a.imag, 512 + b.real, 512 - b.imag) for a, b in zip(z, w)])
    return point_pairs


def commands(size):
    """Measure the shortest wall-clock time and CPU-seconds of each command on a picture of size²."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        (pairs,) = inputs(path)
        ours = [ICCM, "map", f"{path}/a.svg", f"{path}/b0.svg", "--texture", f"{path}/t.png"]
        lines = {"iccm map": [*ours, "-o", f"{path}/o.png", "--force", "--size", f"{size}x{size}", "-q"]}
        if size > 1024:  # there the exact form takes a minute
            lines |= gdal(path, pairs, size, forms=("default",))
        else:
            lines |= gdal(path, pairs, size) | magick(path, pairs)
        return side_by_side(lines)


def batch(count=30, few=2, rounds=2):
    """Measure seconds per job of `iccm batch` beyond start-up against gdalwarp's default, both two at a time."""
    print(f"## {count} pairs at 1024², seconds a job beyond start-up, two at a time; {load()}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        points = inputs(path, np.linspace(0.02, 0.2, count))
        lines = {f"iccm batch of {n}": batched(path, n) for n in (count, few)}
        for k, pairs in enumerate(points):
            if scripts := gdal(path, pairs, 1024, f"g{k}"):
                (path / f"g{k}.sh").write_text(" ".join(scripts["gdalwarp -tps default"]))
                lines["gdalwarp"] = ["sh", "-c", f"ls {path}/g*.sh | xargs -P 2 -n 1 sh"]
        took = side_by_side(lines, rounds)
    ours = np.subtract(*(took[f"iccm batch of {n}"] for n in (count, few))) / (count - few)
    theirs = np.divide(took.get("gdalwarp", (np.nan, np.nan)), count)
    for kind, job, reference in zip(("wall clock", "CPU"), ours, theirs):
        comparison = f", gdalwarp -tps default {reference:.3f} s" if "gdalwarp" in took else ""
        print(f"{kind:10} iccm {job:.3f} s a job{comparison}")
        name = f"a job of a batch by gdalwarp's default, {kind}"
        if "gdalwarp" in took:
            goal(name, job / reference, 1)
        else:
            unmeasured(name, NO_GDAL)
    print()


def batched(path, count):
    """Return the command for the first jobs of a batch."""
    job = {"source": "a.svg", "texture": "t.png", "size": "1024x1024"}
    rows = [{**job, "target": f"b{k}.svg", "output": f"o{k}.png"} for k in range(count)]
    (path / f"{count}.jsonl").write_text("\n".join(map(json.dumps, rows)))
    return [ICCM, "batch", f"{path}/{count}.jsonl", "-j", "2", "-q", "--force"]


def memory(size=16384):
    """Measure the peak memory of `iccm map` for a picture of size²."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        inputs(path)
        line = [
            sys.executable,
            "-m",
            "tests.bench.resampling",
            "peak",
            "map",
            f"{path}/a.svg",
            f"{path}/b0.svg",
        ]
        line += ["--texture", f"{path}/t.png", "-o", f"{path}/o.png", "--size", f"{size}x{size}", "-q"]
        gigabytes = float(subprocess.run(line, capture_output=True, text=True, check=True).stdout)
    print(f"## iccm map --size {size}: {gigabytes:.2f} GB at most")
    goal(f"memory of {size}², GB", gigabytes, 1)
    print()


def side_by_side(lines, rounds=5):
    """Return the shortest wall-clock time and CPU-seconds of each command, in rounds of all of them, so that other load
    affects all equally; peers that fail are left out.
    """
    took = {name: (float("inf"), float("inf")) for name in lines}
    for _ in range(rounds):
        for name in list(took):
            try:
                latest = timed(lines[name])
            except subprocess.CalledProcessError as error:
                if name.startswith("iccm"):
                    raise
                print(
                    f"{name} fails here, and is left out: {error.stderr.decode(errors='replace')[:200].strip()}"
                )
                del took[name]
                continue
            took[name] = min(took[name][0], latest[0]), min(took[name][1], latest[1])
    return took


def gdal(path, pairs, out, name="g", forms=("default", "-et 0")):
    """Return commands for GDAL's thin-plate spline; -et 0 is its exact form, the default interpolates it. On one thread
    and on all.
    """
    if not shutil.which("gdalwarp"):
        return {}
    points = [str(v) for a, b, c, d in pairs for v in ("-gcp", a, b, c, 1024 - d)]
    subprocess.run(["gdal_translate", "-q", *points, f"{path}/t.png", f"{path}/{name}t.tif"], check=True)
    size = ["-te", "0", "0", "1024", "1024", "-ts", str(out), str(out)]
    return {
        f"gdalwarp -tps {form}{' -multi, all threads' * bool(threads)}": [
            *["gdalwarp", "-q", "-tps", "-r", "cubic", "-overwrite"],
            *form.split()[:2] * (form != "default"),
            *threads,
            *size,
            f"{path}/{name}t.tif",
            f"{path}/{name}.tif",
        ]
        for form in forms
        for threads in ([], ["-multi", "-wo", "NUM_THREADS=ALL_CPUS"])
    }


def magick(path, pairs):
    """Return commands for ImageMagick's inverse distance weights, which use all threads."""
    tool = shutil.which("magick") or shutil.which("convert")
    if not tool:
        print("ImageMagick is not installed: apt-get install imagemagick")
        return {}
    points = " ".join(f"{a:.2f},{b:.2f} {c:.2f},{d:.2f}" for a, b, c, d in pairs)
    line = [tool, f"{path}/t.png", "-distort", "Shepards", points, f"{path}/m.png"]
    return {"ImageMagick -distort Shepards, all threads": line}


def peak():
    """Return the peak memory of this process in GB; getrusage also counts that of the process it was forked from."""
    status = Path("/proc/self/status")
    if status.exists():
        return int(status.read_text().partition("VmHWM:")[2].split()[0]) * 1024e-9
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024e-9


def main(arguments):
    """Run the named parts, or all."""
    parts = {"coordinates": coordinates, "quality": quality, "scaling": scaling, "command": command}
    parts |= {"batch": batch, "memory": memory}
    if arguments[:1] == ["one"]:
        return run_warp(int(arguments[1]), *arguments[2:])
    if arguments[:1] == ["peak"]:
        from iccm import cli

        cli.run(arguments[1:])
        return print(peak())
    for name in arguments or parts:
        if cv2 is None and name in ("coordinates", "quality"):
            print(f"{name}: left out, cv2 is not installed")
            continue
        (large if name == "large" else parts[name])()
    return None


if __name__ == "__main__":
    main(sys.argv[1:])
