"""Makes odd, damaged and camera-like pictures, and compares what a program decodes with Pillow.

usage: compare.py PROGRAM SEED
"""

import collections
import io
import random
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import tifffile
from PIL import Image, ImageDraw, ImageOps, PngImagePlugin

ODD, DAMAGED, CAMERA_LIKE = 2000, 420, 165
# Grey levels by which decoders of JPEG may differ: each rounds the transform, the interpolation and the colours.
JPEG_MOST, JPEG_MEAN = 8, 1.0


class Program:
    """A process that answers a path with pixels or a reason."""

    def __init__(self, program):
        self.process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def decode(self, path):
        self.process.stdin.write(f"{path}\n".encode())
        self.process.stdin.flush()
        words = self.process.stdout.readline().decode().split()
        if words[0] == "error":
            return " ".join(words[1:])
        width, height = map(int, words[1:])
        return np.frombuffer(self.process.stdout.read(3 * width * height), np.uint8).reshape(height, width, 3)


def scene(rng, width, height):
    """A stem and leaves before a soft background, with noise."""
    x, y = np.meshgrid(np.linspace(0, 1, width), np.linspace(0, 1, height))
    rgb = np.stack([60 + 90 * x, 40 + 120 * y, 90 * (1 - x * y)], axis=-1)
    image = Image.fromarray(rgb.astype(np.uint8))
    draw = ImageDraw.Draw(image)
    for _ in range(6):
        place = [rng.uniform(0, width), rng.uniform(0, height), rng.uniform(0, width), rng.uniform(0, height)]
        draw.line(place, fill=tuple(rng.randrange(256) for _ in range(3)), width=rng.randint(1, 6))
    noise = np.random.default_rng(rng.randrange(1 << 30)).normal(0, rng.choice([0, 3, 12]), (height, width, 3))
    return Image.fromarray(np.clip(np.asarray(image) + noise, 0, 255).astype(np.uint8))


def size(rng):
    most = rng.choice([20, 120, 400])
    return rng.randint(1, most), rng.randint(1, most)


def exif_of(orientation):
    exif = Image.Exif()
    exif[0x0112] = orientation
    return exif.tobytes()


def xmp_of(orientation):
    text = f'<x:xmpmeta><rdf:Description tiff:Orientation="{orientation}"/></x:xmpmeta>'
    return text.encode()


def turned(image, orientation):
    """The upright picture of one that a camera wrote with this orientation."""
    turn = Image.Transpose
    steps = [None, turn.FLIP_LEFT_RIGHT, turn.ROTATE_180, turn.FLIP_TOP_BOTTOM, turn.TRANSPOSE, turn.ROTATE_270,
             turn.TRANSVERSE, turn.ROTATE_90]
    step = steps[orientation - 1]
    return image if step is None else image.transpose(step)


def odd_jpeg(rng):
    image = scene(rng, *size(rng))
    mode = rng.choice(["RGB", "RGB", "RGB", "L", "CMYK"])
    options = {"quality": rng.choice([5, 30, 75, 90, 95, 100])}
    if mode == "RGB":
        options["subsampling"] = rng.choice(["4:4:4", "4:2:2", "4:2:0", "4:1:1"])
    for key, odds in [("progressive", 0.4), ("optimize", 0.3)]:
        if rng.random() < odds:
            options[key] = True
    if rng.random() < 0.3:
        options["restart_marker_blocks"] = rng.randint(1, 20)
    if mode == "RGB" and rng.random() < 0.1:
        options.pop("subsampling")
        options["keep_rgb"] = True
    turned = rng.random()
    if turned < 0.2:
        options["exif"] = exif_of(rng.randint(1, 8))
    elif turned < 0.4:
        options["xmp"] = xmp_of(rng.randint(1, 8))
    if rng.random() < 0.2:
        options["comment"] = b"c" * rng.randint(0, 3000)
    file = io.BytesIO()
    try:
        image.convert(mode).save(file, "JPEG", **options)
    except OSError:
        # Pillow's buffer is too small for a long comment before a tiny picture.
        return odd_jpeg(rng)
    return ".jpg", file.getvalue(), None, f"JPEG {mode}"


def odd_png(rng):
    image = scene(rng, *size(rng))
    kind = rng.choice(["1", "L", "LA", "P", "RGB", "RGBA", "16", "10 in 16", "12 in 16", "16 RGB"])
    file = io.BytesIO()
    wanted = None
    info = PngImagePlugin.PngInfo()
    options = {"pnginfo": info}
    grey = np.asarray(image.convert("L"))
    if kind == "16 RGB":
        # Pillow writes none, so by hand: without a filter.
        deep = np.asarray(image).astype(">u2") * 257
        return ".png", png(deep), np.asarray(image), "PNG 16 RGB"
    if kind.endswith("16"):
        bits = int(kind.split()[0])
        deep = (grey.astype(np.uint32) * ((1 << bits) - 1) // 255).astype(np.uint16)
        deep[0, 0] = (1 << bits) - 1
        wanted = np.repeat((deep >> (bits - 8)).astype(np.uint8)[:, :, None], 3, axis=2)
        Image.fromarray(deep).save(file, "PNG")
        return ".png", file.getvalue(), wanted, f"PNG {kind}"
    if rng.random() < 0.3:
        options["exif"] = exif_of(rng.randint(1, 8))
    elif rng.random() < 0.3:
        info.add_itxt("XML:com.adobe.xmp", xmp_of(rng.randint(1, 8)).decode())
    if kind == "P":
        image = image.quantize(rng.choice([2, 4, 16, 250]))
        if rng.random() < 0.3:
            options["transparency"] = 0
    elif kind == "RGB" and rng.random() < 0.3:
        options["transparency"] = (0, 0, 0)
    else:
        image = image.convert(kind)
    image.save(file, "PNG", **options)
    return ".png", file.getvalue(), None, f"PNG {kind}"


def png(deep):
    """A PNG file of colours of 16 bits."""
    import zlib

    height, width, _ = deep.shape
    rows = b"".join(b"\0" + row.tobytes() for row in deep)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 16, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def odd_tiff(rng):
    image = scene(rng, *size(rng))
    file = io.BytesIO()
    if rng.random() < 0.5:
        mode = rng.choice(["1", "L", "LA", "P", "RGB", "RGBA", "CMYK", "YCbCr"])
        packing = rng.choice([None, "tiff_lzw", "tiff_adobe_deflate", "packbits", "jpeg", "group4", "zstd"])
        if packing == "jpeg" and mode not in ("L", "RGB", "YCbCr"):
            packing = "tiff_lzw"
        if packing == "group4":
            mode = "1"
        if packing and mode == "YCbCr" and packing != "jpeg":
            packing = None
        image = image.quantize(200) if mode == "P" else image.convert(mode)
        options = {"compression": packing} if packing else {}
        wanted = None
        if packing != "jpeg" and rng.random() < 0.3:
            # Pillow turns some TIFF pictures twice, so they are turned here.
            orientation = rng.randint(1, 8)
            options["tiffinfo"] = {274: orientation}
            wanted = np.asarray(turned(image.convert("RGB"), orientation))
        image.save(file, "TIFF", **options)
        return ".tif", file.getvalue(), wanted, f"TIFF {mode} {packing}"
    kind = rng.choice(["planar", "tiles", "16", "12 in 16", "palette", "white is zero", "predictor", "BigTIFF"])
    rgb, grey = np.asarray(image), np.asarray(image.convert("L"))
    packing = rng.choice([None, "zlib", "lzw", "packbits"])
    order = rng.choice("<>")
    options = {"byteorder": order, "compression": packing, "photometric": "rgb", "metadata": None}
    data, wanted = rgb, rgb
    big = kind == "BigTIFF"
    if kind == "planar":
        data, options["planarconfig"] = np.moveaxis(rgb, -1, 0).copy(), "separate"
    elif kind == "tiles":
        options["tile"] = (16 * rng.randint(1, 4), 16 * rng.randint(1, 4))
    elif kind.endswith("16"):
        bits = int(kind.split()[0])
        data = (rgb.astype(np.uint32) * ((1 << bits) - 1) // 255).astype(np.uint16)
        data[0, 0, 0] = (1 << bits) - 1
        wanted = (data >> (bits - 8)).astype(np.uint8)
        if rng.random() < 0.5 and packing != "packbits":
            options["predictor"] = packing is not None
    elif kind == "palette":
        colours = np.random.default_rng(rng.randrange(1 << 30)).integers(0, 256, (3, 256), dtype=np.uint16)
        data, wanted = grey, np.moveaxis(colours, 0, -1).astype(np.uint8)[grey]
        options |= {"photometric": "palette", "colormap": colours * 257}
    elif kind == "white is zero":
        data, wanted = grey, np.repeat((255 - grey)[:, :, None], 3, axis=2)
        options["photometric"] = "miniswhite"
    elif kind == "predictor":
        options |= {"compression": rng.choice(["zlib", "lzw"]), "predictor": True, "rowsperstrip": rng.randint(1, 30)}
    tifffile.imwrite(file, data, bigtiff=big, **options)
    return ".tif", file.getvalue(), wanted, f"TIFF {kind}"


def foreign(rng):
    image = scene(rng, 40, 30)
    kind = rng.choice(["WEBP", "AVIF", "GIF", "BMP", "JPEG2000"])
    file = io.BytesIO()
    image.save(file, kind)
    # Under a name that promises something else.
    return rng.choice([".jpg", ".png", ".tif"]), file.getvalue(), None, kind


def compare_odd(program, rng, folder):
    makers = [odd_jpeg] * 8 + [odd_png] * 5 + [odd_tiff] * 6 + [foreign]
    same, reasons, failures = collections.Counter(), collections.Counter(), []
    for index in range(ODD):
        ending, data, wanted, label = rng.choice(makers)(rng)
        path = folder / f"odd{ending}"
        path.write_bytes(data)
        found = program.decode(path)
        if isinstance(found, str):
            # A reason is clear if it says what the file is and what to do.
            if "`magick FILE" in found and label.split()[0].replace("JPEG2000", "JPEG 2000").lower() in found.lower():
                reasons[label] += 1
            else:
                failures.append((index, label, found))
            continue
        if wanted is None:
            wanted = np.asarray(ImageOps.exif_transpose(Image.open(path)).convert("RGB"))
        apart = np.abs(found.astype(int) - wanted.astype(int)) if found.shape == wanted.shape else None
        is_lossy = "JPEG" in label or "jpeg" in label
        most, mean = (JPEG_MOST, JPEG_MEAN) if is_lossy else (1, 1)
        if apart is None:
            failures.append((index, label, f"{found.shape}, wanted {wanted.shape}"))
        elif apart.max() > most or apart.mean() > mean:
            failures.append((index, label, f"off by {apart.max()}, {apart.mean():.2f} on average"))
        else:
            same[label.split()[0]] += 1
    print(f"{ODD} odd pictures: {sum(same.values())} the same {dict(same)}, {sum(reasons.values())} with a clear reason, "
          f"{len(failures)} otherwise")
    print("  reasons:", dict(reasons))
    for failure in failures[:20]:
        print("  ", *failure)
    return len(failures)


def damaged(program, rng, folder):
    missed, count = collections.Counter(), collections.Counter()
    for index in range(DAMAGED):
        file = io.BytesIO()
        options = {"progressive": True} if rng.random() < 0.3 else {}
        if rng.random() < 0.2:
            options["restart_marker_blocks"] = rng.randint(1, 20)
        sampling = rng.choice(["4:4:4", "4:2:2", "4:2:0"])
        scene(rng, rng.randint(60, 400), rng.randint(60, 300)).save(
            file, "JPEG", quality=rng.choice([50, 75, 90, 95]), subsampling=sampling, **options
        )
        data = file.getvalue()
        start = data.index(b"\xff\xda") + 20
        at = rng.randrange(start, len(data) - 60)
        length = rng.randint(20, min(1460, len(data) - at - 10))
        kind = ["cut", "cut, end marker put back", "packet lost", "zeros", "other bytes", "packet twice"][index % 6]
        data = {
            "cut": data[:at],
            "cut, end marker put back": data[:at] + b"\xff\xd9",
            "packet lost": data[:at] + data[at + length :],
            "zeros": data[:at] + bytes(length) + data[at + length :],
            "other bytes": data[:at] + rng.randbytes(length) + data[at + length :],
            "packet twice": data[:at] + data[max(start, at - length) :],
        }[kind]
        path = folder / "damaged.jpg"
        path.write_bytes(data)
        count[kind] += 1
        missed[kind] += not isinstance(program.decode(path), str)
    detected = DAMAGED - sum(missed.values())
    print(f"{DAMAGED} damaged JPEG files: {detected} called damaged ({100 * detected / DAMAGED:.1f} %); missed: {dict(missed)}")


def camera_like(program, rng, folder):
    """Whole files as cameras, phones and recorders write them: what libjpeg reads must be read."""
    refused = []
    for index in range(CAMERA_LIKE):
        file = io.BytesIO()
        image = scene(rng, rng.randint(100, 640), rng.randint(80, 480))
        options = {"progressive": True} if rng.random() < 0.2 else {}
        image.save(file, "JPEG", quality=rng.randint(60, 98), subsampling=rng.choice(["4:2:0", "4:2:2"]), **options)
        data = file.getvalue()
        kind = [
            lambda: data + b"\n",
            lambda: data + b"\r\n--boundary--\r\n",
            lambda: data + bytes(rng.randint(1, 5000)),
            lambda: data + b"\xff" * rng.randint(1, 600),
            lambda: data + b"\0\0\0\x18ftypmp42" + rng.randbytes(4000),
            lambda: data + data,
            lambda: data + b"SEFH" + rng.randbytes(60) + b"SEFT",
            lambda: data[:-2] + b"\xff" * rng.randint(1, 9) + data[-2:],
            lambda: data[:2] + b"\xff\xff\xff" + data[2:],
            lambda: data[:2] + b"\xff\xe1\x10\0" + rng.randbytes(4094) + data[2:],
            lambda: data,
        ][index % 11]()
        path = folder / "camera.jpg"
        path.write_bytes(kind)
        found = program.decode(path)
        wanted = np.asarray(Image.open(path).convert("RGB"))
        if isinstance(found, str) or np.abs(found.astype(int) - wanted).max() > JPEG_MOST:
            refused.append((index % 11, found if isinstance(found, str) else "other pixels"))
    print(f"{CAMERA_LIKE} camera-like JPEG files: {len(refused)} refused {refused[:5]}")


def main():
    rng = random.Random(int(sys.argv[2]))
    program = Program(sys.argv[1])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        failures = compare_odd(program, rng, folder)
        damaged(program, rng, folder)
        camera_like(program, rng, folder)
    sys.exit(failures > 0)


main()
