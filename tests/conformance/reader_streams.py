# SPDX-License-Identifier: MIT
"""Vertex streams and indices as FORMAT.md, section 3.6, says; a part of reader.py."""
import ctypes, struct

class Refuse(ValueError):
    """The file, or a part of it, must not be used."""

def signed(zigzag): return zigzag >> 1 ^ -(zigzag & 1)

def need(condition, what, error=Refuse):
    if not condition: raise error(what)

def unzstd(raw, least, most):
    """The one zstd frame in raw, which states a size between these."""
    z, length = ctypes.CDLL("libzstd.so.1"), ctypes.c_size_t(len(raw))
    z.ZSTD_getFrameContentSize.restype = ctypes.c_ulonglong
    size = z.ZSTD_getFrameContentSize(raw, length)
    need(least <= size <= most and z.ZSTD_findFrameCompressedSize(raw, length) == len(raw), "zstd")
    out = ctypes.create_string_buffer(size)
    need(z.ZSTD_decompress(out, ctypes.c_size_t(size), raw, length) == size, "zstd: damaged")
    return out.raw

def meshopt_indices(raw, count):
    raw, size_t = unzstd(raw, 1, 8 * count + 4096), ctypes.c_size_t
    out, call = ctypes.create_string_buffer(4 * count), ctypes.CDLL("libmeshoptimizer.so")
    need(raw[:1] == b"\xe1" and not call.meshopt_decodeIndexBuffer(
        out, size_t(count), size_t(4), raw, size_t(len(raw))), "indices: damaged")
    return list(struct.unpack(f"<{count}I", out.raw))

def read_twins(raw, count):
    """The twin of each vertex, or None."""
    raw, twins, last = unzstd(raw, 2 * count, 2 * count), [], 0
    for v, (low, high) in enumerate(zip(raw, raw[count:])):
        word = low | high << 8
        last = last + signed(word - 1) & 0xFFFF if word else last
        need(not word or last < v, "a twin that is not before its vertex")
        twins.append(last if word else None)
    return twins

def neighbours(corners, count):
    """near, other and far of each vertex."""
    triangles, found = list(zip(*[iter(corners)] * 3)), {}
    for t, triangle in enumerate(triangles):
        for v in triangle:
            rest = list(triangle)
            rest.remove(v)
            rest = sorted((u for u in rest if u < v), reverse=True)
            if v in found or not rest: continue
            far = [sum(y) - sum(rest) for y in triangles[max(0, t - 16):t] if {*rest} <= {*y}]
            far = far[-1] if len({*rest}) == 2 and far and far[-1] < v else None
            found[v] = (*rest, None)[:2] + (far,)
    return [found.get(v, (v - 1 if v else None, None, None)) for v in range(count)]

def predict(kind, values, links, c, now):
    near, other, far = (v if v is None else values[v][c] for v in links)
    if kind == "weights" and c == 3: return 255 - sum(now)
    if near is None: return 0
    if kind in ("normal", "color", "weights"): return near if other is None else near + other >> 1
    return near if far is None or kind == "joints" else near + other - far

def read_stream(raw, kind, stride, twins, links):
    """The values of each vertex; twins: None for those that are stored."""
    wide = kind not in ("normal", "color", "weights")
    n, parts, values, at = twins.count(None), stride >> wide, [], 0
    raw, top = unzstd(raw, n * stride, n * stride), 0xFFFF if wide else 0xFF
    for v, twin in enumerate(twins):
        if twin is not None: values.append(values[twin]); continue
        now = []
        for c in range(parts):
            r = raw[c * n + at] | (raw[(parts + c) * n + at] << 8 if wide else 0)
            x = predict(kind, values, links[v], c, now) + signed(r) & top
            now.append(x - 256 if kind == "normal" and x > 127 else x)
        values.append(now)
        at += 1
    return values
