#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Reads .relit files as FORMAT.md says: reader.py info FILE | reader.py frames FILE

info prints the parsed structure (status 0: all was read; 1: the file cannot be used; 3: records were lost).
frames prints hashes of decoded planes, coefficients at probe texels and posed positions (status 0 or 1).
It needs nothing but the standard library, libzstd, libmeshoptimizer, and the command ffmpeg for video.
"""
import bisect, contextlib, ctypes, json, math, mmap, os, re, struct, subprocess, sys, tempfile, zlib

SIGNATURE, MARKER = b"\x89RLT\r\n\x1a\n", bytes.fromhex("F3529C0BE6D17A38C41FA9650EB2875D")
# The static types in their order, and how many records of each a file may have.
STATIC = dict(HEAD=1, CLIP=1024, IMAG=4096, MATL=4096, MESH=4096, SKEL=1, POSE=1024, MODL=256, LAYR=256)
RANK = {t: i for i, t in enumerate([*STATIC, "SEGM", "INDX", "FEND"])} | {"CHNK": 9}
# This reader's own limits, for a machine of modest memory (section 5 allows that).
MAX_SHOWN_FRAMES, MAX_POSE_BYTES = 1 << 18, 1 << 24

class Refuse(Exception):
    """The file, or a part of it, must not be used."""

class Framing(Exception):
    """The framing is lost at this place."""

def need(condition, what):
    if not condition:
        raise Refuse(what)

def distinct(values):
    values = list(values)
    return len(set(values)) == len(values)

# Payloads, section 4 ----------------------------------------------------------------------------------------
# Fields are name:code, where code is one of struct's, s (string), blob, private, an enumeration or another
# layout; [n] means a list of n entries at most, *n exactly n without a count, =a..b the least and the largest
# value. Names are those of INFO.md; what it does not show begins with _.
ENUMS = {
    "WRAP": ["repeat", "clamp", "mirror"], "ALPHA": ["opaque", "mask", "blend"],
    "SEMANTIC": ["position", "normal", "lightmap_uv", "albedo_uv", "color", "joints", "weights"],
    "TARGET": ["translation", "rotation", "scale", "morph_weight"], "MODEL": ["shlm"],
    "POSES": ["joints", "vertices"], "CHROMA": ["luma", "4:2:0", "4:4:4"], "?": [False, True]}
LAYOUTS = {
    "HEAD": "version:2H _reserved:I=0..0 writer:s",
    "CLIP": "id:I name:s tick_rate:2I=1..2147483647 frames:Q=1..4294967296 duration_ticks:Q=1..4294967296 "
            "loop:? bounds:3f*2",
    "IMAG": "id:I=0..2147483647 media_type:s _data:blob",
    "MATL": "id:I name:s base_color:4f=0..1 image:i=-1..2147483647 wrap:WRAP*2 linear_filter:? "
            "alpha_mode:ALPHA alpha_cutoff:f=0..inf",
    "MESH": "id:I name:s material:I vertices:I=1..65535 _indices:I=1..3145728 streams:stream[16] "
            "indices:blob first_morph_weight:I morph_targets:target[1024]",
    "stream": "semantic:SEMANTIC stride:B offset:3f scale:3f=0..inf data:blob",
    "target": "scale:3f=0..inf data:blob",
    "SKEL": "morph_weights:I=0..65535 nodes:node[65535] palette:joint[65535]",
    "node": "parent:i=-1..65534 local:12f",
    "joint": "node:I inverse_bind:12f",
    "POSE": "track:I clip:I kind:POSES rest:rest[65535] channels:channel[262140] vertex_ranges:range[4096]",
    "rest": "node:I translation:3f rotation:4f scale:3f",
    "channel": "target:TARGET index:I offset:3f step:3f=0..inf",
    "range": "mesh:I offset:3f step:3f=0..inf",
    "MODL": "id:I clip:I kind:MODEL order:B=0..3 size:2H=1..4096 prediction_plane:i=-1..255 mean:3f[16]",
    "LAYR": "id:I _model:I track:I codec:s codec_private:private coded:2H=1..16384 bit_depth:B chroma:CHROMA "
            "lossless:? pictures:B=1..32",
    "exponents": "track:I codec:s codec_private:private coded:2H=1..16384 block:B pictures:B=1..32",
    "planes": "planes:plane[256]", "planes with exponents": "planes:both[256]",
    "plane": "component:B=0..2 mantissa_rect:4H scale:f matrix:BBf[48]",
    "both": "component:B=0..2 mantissa_rect:4H exponent_rect:4H scale:f matrix:BBf[48]",
    "SEGM": "_marker:16B index:I=0..16777215 clip:I first_frame:Q=0..4294967295 frames:I=1..65536 "
            "first_tick:Q=0..4294967296 chunks:announced[1024] durations:I[65536]",
    "announced": "track:I _reserved:I=0..0 bytes:Q=56..1073741848",
    "CHNK": "track:I segment:I first_pts:Q count:I=1..131072 table_bytes:I",
    "INDX": "count:I=0..16777216 _reserved:I=0..0",
    "place": "index:I clip:I first_frame:Q frames:I _reserved:I=0..0 first_tick:Q offset:Q",
    "FEND": "index_offset:Q copies_offset:Q file_bytes:Q"}
FIELD = re.compile(r"(\w+):([\w?]+)(?:\[(\d+)\])?(?:\*(\d+))?(?:=(.+)\.\.(.+))?")
FIELDS = {name: [FIELD.fullmatch(word).groups() for word in text.split()] for name, text in LAYOUTS.items()}

def blob(raw):
    return {"bytes": len(raw), "crc32": zlib.crc32(raw), "_raw": raw}

class Cursor:
    def __init__(self, payload):
        self.p, self.at = payload, 0
    def take(self, n):
        need(self.at + n <= len(self.p), "shorter than its fields")
        self.at += n
        return self.p[self.at - n:self.at]
    def field(self, code):
        if code in FIELDS:
            return self.record(code)
        if code in ("blob", "private"):
            n = self.field("I")
            need(n >= 1 if code == "blob" else n <= 1 << 20, f"{n} bytes")
            return blob(self.take(n))
        if code == "s":
            n = self.field("H")
            need(n <= 4096, f"a string of {n} bytes")
            return self.take(n).decode("utf-8")
        kind = "<B" if code in ENUMS else "<" + code
        values = struct.unpack(kind, self.take(struct.calcsize(kind)))
        need(all(math.isfinite(v) for v in values), "a number that is not finite")
        if code in ENUMS:
            need(values[0] < len(ENUMS[code]), f"unsupported enumerator {values[0]}")
            return ENUMS[code][values[0]]
        return values[0] if len(values) == 1 else list(values)
    def record(self, layout, last=False):
        """The fields of a layout; last: nothing may follow."""
        d = {}
        for name, code, limit, count, low, high in FIELDS[layout]:
            n = self.field("I") if limit else int(count or 1)
            need(not limit or n <= int(limit), f"{n} {name}")
            d[name] = [self.field(code) for _ in range(n)] if limit or count else self.field(code)
            values = d[name] if isinstance(d[name], list) else [d[name]]
            need(not low or all(float(low) <= v <= float(high) for v in values), f"{name} is {d[name]}")
            need(code != "s" or "\0" not in d[name], f"U+0000 in {name}")
        need(not last or self.at == len(self.p), "longer than its fields")
        return d
    def varint(self):
        v = 0
        for shift in range(0, 70, 7):
            byte = self.take(1)[0]
            v |= (byte & 127) << shift
            if byte < 128:
                break
        need(byte < 128 and (byte or not shift) and v < 1 << 64, "varint")
        return v

# Static records: what a layout does not show ----------------------------------------------------------------
def inside(rect, size):
    return rect[0] + rect[2] <= size[0] and rect[1] + rect[3] <= size[1] and min(rect[2:]) > 0

def mesh_is_sound(d):
    streams = [(s, s["semantic"]) for s in d["streams"]]
    kinds = [kind for _, kind in streams]
    position, normal, lightmap, albedo, color, joints, weights = map(kinds.count, ENUMS["SEMANTIC"])
    return (position == lightmap == 1 and max(normal, albedo, color) <= 1 and joints == weights <= 2
            and all(s["stride"] == (8 if k in ("position", "joints") else 4) for s, k in streams)
            and d["_indices"] % 3 == 0)

def layer_is_sound(d):
    e = d.get("exponents", {"track": None, "block": 1, "codec": d["codec"]})
    if e["track"] == d["track"] or e["block"] not in (1, 2, 4, 8, 16, 32) or d["bit_depth"] not in (8, 10):
        return False
    for i, p in enumerate(d["planes"]):
        x, y, w, h = p["mantissa_rect"]
        others = [q["mantissa_rect"] for q in d["planes"][:i] if q["component"] == p["component"]]
        exponents = p.get("exponent_rect")
        if not (inside(p["mantissa_rect"], d["coded"]) and p["scale"] > 0
                and (not p["component"] or d["chroma"] == "4:4:4"
                     or d["chroma"] == "4:2:0" and not (x | y) & 1)
                and all(x >= X + W or X >= x + w or y >= Y + H or Y >= y + h for X, Y, W, H in others)
                and (not exponents or inside(exponents, e["coded"])
                     and exponents[2:] == [-(-w // e["block"]), -(-h // e["block"])])
                and all(n < 16 and c < 3 for n, c, _ in p["matrix"])
                and distinct((n, c) for n, c, _ in p["matrix"])):
            return False
    return d["planes"] and all(re.fullmatch("[a-z0-9_-]{1,32}", t["codec"]) for t in (d, e))

SOUND = {
    "HEAD": lambda d: d["version"][0] == 0 and d["version"][1] >= 2,
    "CLIP": lambda d: d["frames"] <= d["duration_ticks"] and all(a <= b for a, b in zip(*d["bounds"])),
    "IMAG": lambda d: d["media_type"] in ("image/png", "image/jpeg"),
    "MESH": mesh_is_sound,
    "SKEL": lambda d: (all(n["parent"] < i for i, n in enumerate(d["nodes"]))
                       and all(p["node"] < len(d["nodes"]) for p in d["palette"])),
    "POSE": lambda d: (all(abs(math.hypot(*r["rotation"]) - 1) <= 1e-3 for r in d["rest"])
                       and distinct(r["node"] for r in d["rest"])
                       and distinct((x["target"], x["index"]) for x in d["channels"])
                       and not (d["vertex_ranges"] if d["kind"] == "joints" else d["rest"] or d["channels"])),
    "MODL": lambda d: len(d["mean"]) == (d["order"] + 1) ** 2,
    "LAYR": layer_is_sound}

def parse_static(records):
    """Records by type, from (type, length, crc, payload)."""
    need(sum(r[1] for r in records) <= 1 << 31, "static part beyond 2^31 bytes")
    result = {t: [] for t in STATIC}
    for kind, _, _, body in records:
        try:
            c = Cursor(body)
            d = c.record(kind, last=kind != "LAYR")
            if kind == "LAYR" and c.field("?"):
                d["exponents"] = c.record("exponents")
            if kind == "LAYR":
                d.update(c.record("planes with exponents" if "exponents" in d else "planes", last=True))
            need(SOUND.get(kind, bool)(d), "contents, or a version this reader does not know")
        except (Refuse, UnicodeDecodeError) as error:
            raise Refuse(f"{kind}: {error}") from None
        result[kind].append(d)
        need(len(result[kind]) <= STATIC[kind], f"too many {kind}")
    return result

def check_references(s):
    """What section 7, step 3 asks for, and limits that concern several records. The clip of each track."""
    def exist(records, field, kind):
        need(all(r[field] in ids[kind] for r in records), f"a {kind} that is not there")
    need(s["CLIP"], "no CLIP")
    need(all(distinct(r["id"] for r in s[t] if "id" in r) for t in s), "two records of one id")
    ids = {t: {r.get("id"): r for r in s[t]} for t in ("CLIP", "IMAG", "MATL", "MODL")}
    skel = s["SKEL"] = s["SKEL"][0] if s["SKEL"] else {"morph_weights": 0, "nodes": [], "palette": []}
    nodes, weights = len(skel["nodes"]), skel["morph_weights"]
    exist([m for m in s["MATL"] if m["image"] >= 0], "image", "IMAG")
    exist(s["MESH"], "material", "MATL")
    exist(s["POSE"] + s["MODL"], "clip", "CLIP")
    exist(s["LAYR"], "_model", "MODL")
    for m in s["MESH"]:
        need(skel["palette"] or all(x["semantic"] != "joints" for x in m["streams"]), "no palette")
        targets = len(m["morph_targets"])
        need(not targets or m["first_morph_weight"] + targets <= weights, "a morph weight that is not there")
    for p in s["POSE"]:
        need(all(r["node"] < nodes for r in p["rest"]), "a node that is not there")
        top = {"morph_weight": weights}
        need(all(c["index"] < top.get(c["target"], nodes) for c in p["channels"]), "channel")
        meshes = [r["mesh"] for r in p["vertex_ranges"]]
        need(p["kind"] == "joints" or meshes == [m["id"] for m in s["MESH"]], "vertex ranges")
    need(distinct(p["clip"] for p in s["POSE"]), "two POSE of a clip")
    users, samples = [(p["track"], p["clip"]) for p in s["POSE"]], dict.fromkeys(ids["CLIP"], 0)
    for m in s["MODL"]:
        m["layers"] = [layer for layer in s["LAYR"] if layer["_model"] == m["id"]]
        planes = [p for layer in m["layers"] for p in layer["planes"]]
        need(m["prediction_plane"] < len(planes) <= 256, "planes, or prediction without its plane")
        need(all(p["mantissa_rect"][2:] == m["size"] for p in planes), "a plane of another size")
        need(all(n < len(m["mean"]) for p in planes for n, _, _ in p["matrix"]), "a coefficient")
        for user in m["layers"] + [layer["exponents"] for layer in m["layers"] if "exponents" in layer]:
            users.append((user["track"], m["clip"]))
            samples[m["clip"]] += math.prod(user["coded"]) * ids["CLIP"][m["clip"]]["frames"]
    need(distinct(t for t, _ in users), "two users of a track")
    for clip in s["CLIP"]:
        total, (num, den) = samples[clip["id"]], clip["tick_rate"]
        need(total <= 1 << 48 and total * num <= (clip["duration_ticks"] * den) << 33, "samples of video")
    return dict(users)

# The file, sections 1 and 2 ---------------------------------------------------------------------------------
class File:
    """Reads a whole file; lossy: something is gone for good."""
    def __init__(self, data):
        self.data, self.size = data, len(data)
        self.lossy, self.repaired, self.lost = False, 0, {"records": 0, "bytes": 0, "segments": 0}
        self.static, self.records = [], None    # (type, length, crc, payload or None); by type from SEGM on
        self.segments, self.passed, self.index, self.end = [], [], None, None
        self.awaited, self.suspect = [], 0      # announced chunks; a damaged record just before
        self.rank, self.index_at, self.copies_at, at = -1, 0, 0, 8
        need(data[:8] == SIGNATURE, "no .relit file")
        while at < self.size:
            try:
                at = self.step(at)
            except Framing as error:
                need(self.rank >= 0, f"no HEAD: {error}")
                at = self.find_way_back(at)
        self.drop_awaited()
        self.finish_static()
    def header(self, at):
        """Type, flags, payload length, its CRC, and where the next record is."""
        head = self.data[at:at + 24] if at >= 8 else b""
        if len(head) < 24 or zlib.crc32(head[:20]) != int.from_bytes(head[20:], "little"):
            raise Framing("no header, or a damaged one")
        kind, flags, length, crc = struct.unpack("<4sIQI", head[:20])
        following = at + 24 + (length + 7) // 8 * 8
        if (not kind.isalpha() or kind[2] >= 97 or following > self.size
                or length > (278580 if kind == b"SEGM" else 1 << 30)):
            raise Framing("type or length, or the file ends inside a record")
        return kind.decode(), flags, length, crc, following
    def payload(self, at, length, crc):
        """The payload; None if it or its padding is damaged."""
        body = self.data[at + 24:at + 24 + (length + 7) // 8 * 8]
        return body[:length] if zlib.crc32(body[:length]) == crc and not any(body[length:]) else None
    def scan(self, at):
        """Offset of the next believable SEGM from at on; the end of the file if there is none."""
        while (at := self.data.find(MARKER, at + 24) - 24) >= 0:
            with contextlib.suppress(Framing):
                kind, flags, *_ = self.header(at)
                if at % 8 == 0 and kind == "SEGM" and not flags & 0xFFFF:
                    return at
            at += 1
        return self.size
    def lose(self, count, length, lossy=True):
        self.lost["records"] += count
        self.lost["bytes"] += length
        self.lossy |= lossy
    def drop_awaited(self):
        self.lose(len(self.awaited), 0, bool(self.awaited))
        self.awaited = []
    def find_way_back(self, at):
        """Where to go on when the framing was lost at this place."""
        # A good record in the place of an announced chunk may itself be the segment to go on with.
        found = self.scan(at if self.awaited and not self.suspect else (self.suspect or at) + 8)
        lossy, before = self.records is not None, self.repaired
        self.finish_static(cut=True)
        # All was repaired if records came from copies and the first segment is there.
        lossy |= self.repaired == before or self.data[found + 40:found + 44] != bytes(4)
        self.lose(1, max(0, found - at), lossy)
        self.drop_awaited()
        self.rank, self.suspect = RANK["SEGM"], 0
        return found
    def step(self, at):
        """Reads the record at this place; where to go on."""
        kind, flags, length, crc, following = self.header(at)
        copy = flags & 1 and self.rank >= 0 and (kind in STATIC or kind == "INDX" or kind not in RANK)
        known = kind in RANK and not flags & 0xFFFE and (copy or not flags & 1)
        if not known and kind[0].isupper():
            need(self.records, f"unknown critical record {kind!r}, flags {flags:#x}")
            self.lose(1, self.size - at)
            return self.size                                # nobody knows what follows means
        need(self.rank >= 0 or known and kind == "HEAD", "does not begin with HEAD")
        if self.awaited and kind != "CHNK":
            raise Framing("not the announced CHNK")
        if copy or not known:
            self.passed.append({"offset": at, "type": kind, "flags": flags, "payload_bytes": length,
                                "payload_crc": crc})
            self.copies_at = self.copies_at or (at if copy else 0)
            self.suspect = 0
            return following
        repeated = RANK[kind] == self.rank and kind in ("HEAD", "SKEL", "INDX")
        if kind != "CHNK" and (RANK[kind] < self.rank or repeated):
            raise Framing(f"{kind} out of order")
        body = self.payload(at, length, crc)
        self.rank = max(self.rank, RANK[kind]) if kind != "CHNK" else self.rank
        self.suspect = at if body is None else 0
        if kind in STATIC:
            self.static.append((kind, length, crc, body))
            if kind == "HEAD":
                need(body is not None, "HEAD is damaged")
                parse_static(self.static)                   # its version decides before anything else is read
            self.lose(body is None, (following - at) * (body is None), False)
            return following
        if kind != "CHNK":
            self.finish_static()
        try:
            need(body is not None or kind == "CHNK", "damaged")
            {"SEGM": self.segment, "CHNK": self.chunk, "INDX": self.read_index, "FEND": self.finish}[kind](
                at, body, following)
        except Refuse:
            self.lose(1, following - at)
            following = self.scan(at + 8) if kind == "SEGM" else following
        if kind == "FEND" and following < self.size:
            self.lose(1, self.size - following)
        return self.size if kind == "FEND" else following
    def segment(self, at, body, _):
        s, last = Cursor(body).record("SEGM", last=True), self.segments[-1]["index"] if self.segments else -1
        self.copies_at = 0
        need(body[:16] == MARKER and last < s["index"], "marker or index")
        need(s["first_frame"] + s["frames"] <= 1 << 32, "frames")
        need(s["first_tick"] + max(s["frames"], sum(s["durations"])) <= 1 << 32, "ticks")
        need(len(s["durations"]) in (0, s["frames"]) and all(s["durations"]), "durations")
        need(all(a["bytes"] % 8 == 0 for a in s["chunks"]), "chunk_bytes")
        need(distinct(a["track"] for a in s["chunks"]), "a track twice")
        s.update(offset=at, chunks=[{**a, "packets": None, "data": None} for a in s["chunks"]])
        self.lost["segments"] += s["index"] - last - 1
        self.segments.append(s)
        self.awaited = list(s["chunks"])
    def chunk(self, at, body, following):
        announced = self.awaited.pop(0) if self.awaited else None
        need(announced and body is not None, "damaged, or no segment announced it")
        c, s, packets = Cursor(body), self.segments[-1], []
        d = c.record("CHNK")
        expected = [announced["track"], announced["bytes"], s["index"]]
        need([d["track"], following - at, d["segment"]] == expected, "not the announced chunk")
        table, pts = Cursor(c.take(d["table_bytes"])), d["first_pts"]
        for _ in range(d["count"]):
            size, step = table.varint(), table.varint()
            pts += -(step + 1 >> 1) if step & 1 else step >> 1
            packets.append([pts, size & 1, size >> 1])
        need(table.at == len(table.p) and packets[0][0] == d["first_pts"], "table")
        need(distinct(p[0] for p in packets) and all(0 <= p[0] < 1 << 64 for p in packets), "pts")
        raw, first, beyond = body[c.at:], s["first_frame"], s["first_frame"] + s["frames"]
        need(sum(p[2] for p in packets) == len(raw), "sizes")
        if self.tracks.get(d["track"]) == s["clip"]:
            need(packets[0][:2] == [first, 1] and all(first <= p[0] < beyond for p in packets), "packets")
        announced.update(packets=packets, data=blob(raw), _at=at + 24 + c.at)
        del announced["data"]["_raw"]
    def read_index(self, at, body, _):
        self.index_at, c = at, Cursor(body)
        index = [c.record("place") for _ in range(c.record("INDX")["count"])]
        need(c.at == len(body) and all(e["offset"] % 8 == 0 for e in index), "length or offset")
        need(all(a[k] < b[k] for a, b in zip(index, index[1:]) for k in ("index", "offset")), "order")
        self.index = index
    def finish(self, _, body, following):
        self.end = Cursor(body).record("FEND", last=True)
        need(list(self.end.values()) == [self.index_at, self.copies_at, following], "contradicts the file")
    def copies(self):
        """(type, length, crc, payload or None) of static copies but HEAD's; False: damage may hide some."""
        found = []
        try:
            kind, _, length, crc, _ = self.header(self.size - 48)
            body = self.payload(self.size - 48, length, crc)
            at = int.from_bytes(body[8:16], "little") if kind == "FEND" and body else 0
            while True:
                kind, flags, length, crc, following = self.header(at)
                if kind in RANK and flags & 0xFFFF != 1 or kind == "HEAD" and found:
                    return found, True
                if kind in STATIC and kind != "HEAD":
                    found.append((kind, length, crc, self.payload(at, length, crc)))
                at = following
        except Framing:
            return found, False
    def finish_static(self, cut=False):
        """Repairs the static part with its copies, parses and checks it. cut: framing was lost behind it."""
        if self.records is not None:
            return
        if cut or any(body is None for *_, body in self.static):
            (found, whole), n = self.copies(), len(self.static)
            for i, (own, copy) in enumerate(zip(self.static[1:], found), 1):
                if own[3] is None and own[:3] == copy[:3]:
                    self.static[i] = copy
                    self.repaired += 1
            need(not cut or whole and [r[0] for r in found[:n - 1]] == [r[0] for r in self.static[1:]], "cut")
            self.static += found[n - 1:] if cut else []
            self.repaired += len(self.static) - n
            need(all(body is not None for *_, body in self.static), "a damaged static record without a copy")
        records, self.static = parse_static(self.static), []
        self.tracks, self.records = check_references(records), records
    def info(self):
        r, size = self.records, {}
        for c in (c for s in self.segments for c in s["chunks"]):
            size[c["track"]] = size.get(c["track"], 0) + c["bytes"]
        for p in r["POSE"] + r["LAYR"] + [x["exponents"] for x in r["LAYR"] if "exponents" in x]:
            p["bytes"] = size.get(p["track"], 0)
        for clip in r["CLIP"]:
            clip["duration_s"] = clip["duration_ticks"] * clip["tick_rate"][1] / clip["tick_rate"][0]
        meshes = [{**m, "triangles": m["_indices"] // 3} for m in r["MESH"]]
        return {**r["HEAD"][0], "bytes": self.size, "complete": bool(self.end), "repaired": self.repaired,
                "lost": self.lost, "clips": r["CLIP"], "images": [{**i, **i["_data"]} for i in r["IMAG"]],
                "materials": r["MATL"], "meshes": meshes, "skeleton": r["SKEL"], "poses": r["POSE"],
                "models": r["MODL"], "segments": self.segments, "index": self.index, "end": self.end,
                "passed_over": self.passed}

# Video, sections 3.3 and 3.4 -------------------------------------------------------------------------------
MATROSKA = {"h264": b"V_MPEG4/ISO/AVC", "hevc": b"V_MPEGH/ISO/HEVC", "av1": b"V_AV1", "vp9": b"V_VP9",
            "mpeg4": b"V_MPEG4/ISO/ASP", "ffv1": b"V_FFV1"}
SHOWINFO = re.compile(rb"\] n: *\d+ pts: *(\S+) .* fmt:(\S+) .*\bs:(\d+)x(\d+) ")
COMMAND = ("ffmpeg -nostdin -hide_banner -nostats -threads 1 -err_detect crccheck+explode -ec 0 -idct simple "
           "-flags bitexact -f matroska -i FILE -map 0:v:0 -vf showinfo -fps_mode passthrough -autoscale 0 "
           "-fs 8000000000 -f rawvideo -")
FORMATS = {"gray": "luma", "yuv420p": "4:2:0", "yuvj420p": "4:2:0", "yuv444p": "4:4:4", "yuvj444p": "4:4:4",
           "gbrp": "4:4:4", "bgr0": "4:4:4"}

def matroska(track, packets):
    """A file of one video track; packets: (time in ms, bytes)."""
    def el(name, *parts):
        body = b"".join(p.to_bytes(8, "big") if isinstance(p, int) else p for p in parts)
        return bytes.fromhex(name) + (len(body) | 1 << 56).to_bytes(8, "big") + body
    private, (width, height) = track["codec_private"]["_raw"], track["coded"]
    entry = el("AE", el("D7", 1), el("73C5", 1), el("83", 1), el("9C", 0), el("86", MATROSKA[track["codec"]]),
               el("63A2", private) if private else b"", el("E0", el("B0", width), el("BA", height)))
    head = el("1A45DFA3", el("4282", b"matroska"), el("4287", 4), el("4285", 2))
    clusters = [el("1F43B675", el("E7", time), el("A3", b"\x81\0\0\x80", body)) for time, body in packets]
    return head + el("18538067", el("1549A966", el("2AD7B1", 1000000)), el("1654AE6B", entry), *clusters)

def pictures(track, packets):
    """Yields (time, kind, components as (width, height, samples), bytes a sample) of each picture."""
    need(track["codec"] in MATROSKA, f"no decoder for {track['codec']}")
    with tempfile.NamedTemporaryFile(suffix=".mkv") as f, tempfile.TemporaryFile() as out:
        f.write(matroska(track, [p for p in packets if p[1]]))
        f.flush()
        log = subprocess.run([f.name if w == "FILE" else w for w in COMMAND.split()], stdout=out, check=False,
                             stderr=subprocess.PIPE, timeout=50 + len(packets)).stderr
        need(b"opening decoder" not in log and b"Unknown decoder" not in log, "no such codec")
        out.seek(0)
        for time, pixels, w, h in SHOWINFO.findall(log):
            base, w, h = pixels.decode().removesuffix("10le"), int(w), int(h)
            if base not in FORMATS:
                break                   # a kind of picture that no layer can have
            kind, deep = FORMATS[base], 1 + pixels.endswith(b"10le")
            others = {"luma": [], "4:4:4": 2 * [(w, h)], "4:2:0": 2 * [((w + 1) // 2, (h + 1) // 2)]}[kind]
            if base == "bgr0":          # packed; components are G, B, R
                raw = out.read(4 * w * h)
                parts = [(w, h, raw[i::4]) for i in (1, 0, 2)]
            else:
                parts = [(a, b, out.read(a * b * deep)) for a, b in [(w, h), *others]]
            if time.isdigit():
                yield int(time), kind, parts, deep

def decode(file, chunk, track, chroma, depth, rects, probes):
    """The times of all packets, and by time, for each (component, x, y, w, h, shift) of rects, the hash and
    the samples at the probe texels; no entry, or None, where there is no picture."""
    at, packets, found = chunk["_at"], [], {}
    for pts, _, size in chunk["packets"]:
        packets.append((pts - chunk["packets"][0][0], file.data[at:at + size]))
        at += size
    for time, kind, parts, deep in pictures(track, packets):
        found[time] = None
        if list(parts[0][:2]) != track["coded"] or chroma not in ("luma", kind) or deep != (depth + 7) // 8:
            continue                    # not the picture that the layer announces
        found[time] = []
        for component, x, y, w, h, shift in rects:
            pitch, _, raw = parts[component]
            if component and kind == "4:2:0":
                x, y, w, h, shift = x // 2, y // 2, (w + 1) // 2, (h + 1) // 2, 2
            rows = b"".join(raw[(r * pitch + x) * deep:(r * pitch + x + w) * deep] for r in range(y, y + h))
            at = [(py // shift * w + px // shift) * deep for px, py in probes]
            samples = [int.from_bytes(rows[i:i + deep], "little") for i in at]
            found[time].append((f"{zlib.crc32(rows):08x}", samples))
    packets.sort()
    for (before, _), (time, body) in zip(packets, packets[1:]):
        not_coded = len(body) == 1 or len(body) < 16 and body[:4] == b"\0\0\1\xb6"
        if time not in found and (not body or track["codec"] == "mpeg4" and not_coded):
            found[time] = found.get(before)
    return [time for time, _ in packets], found

def latest(times, time):
    return times[bisect.bisect_right(times, time) - 1]

def show_layer(file, layer, segment, probes):
    """For each frame of the segment: for each plane (hash, values at the probe texels), or None."""
    chunks = {c["track"]: c for c in segment["chunks"] if c["packets"]}
    e, (m0, e0) = layer.get("exponents"), (128, 135) if layer["bit_depth"] == 8 else (512, 137)
    planes, result = layer["planes"], []
    if layer["track"] not in chunks or e and e["track"] not in chunks:
        return [[None] * len(planes)] * segment["frames"]
    rects = [(p["component"], *p["mantissa_rect"], 1) for p in planes]
    chunk, chroma = chunks[layer["track"]], layer["chroma"]
    times, mantissas = decode(file, chunk, layer, chroma, layer["bit_depth"], rects, probes)
    if e:
        rects = [(0, *p["exponent_rect"], e["block"]) for p in planes]
        exponent_times, exponents = decode(file, chunks[e["track"]], e, "luma", 8, rects, probes)
    for k in range(segment["frames"]):
        time = latest(times, k)
        ms = mantissas.get(time)
        xs = exponents.get(latest(exponent_times, time)) if e else [("", [e0] * len(probes))] * len(planes)
        result.append([(m[0] + ":" * bool(e) + x[0],
                        [p["scale"] * (a - m0) * 2.0 ** (b - e0) if b else 0.0 for a, b in zip(m[1], x[1])])
                       for p, m, x in zip(planes, ms, xs)] if ms and xs else [None] * len(planes))
    return result

def show_model(file, model, count):
    w, h = model["size"]
    probes, shown = [[0, 0], [w // 3, h // 2], [w // 2, h // 3], [w - 1, h - 1]], [None] * count
    matrices = [p["matrix"] for layer in model["layers"] for p in layer["planes"]]
    # A model with prediction, which this reader does not know, is refused: it has no frames.
    for s in (s for s in file.segments if s["clip"] == model["clip"] and model["prediction_plane"] < 0):
        layers = [show_layer(file, layer, s, probes) for layer in model["layers"]]
        for i in range(min(s["frames"], count - s["first_frame"])):
            planes = [p for layer in layers for p in layer[i]]
            if not any(planes):
                continue
            texels = [sum(model["mean"], []) for _ in probes] if all(planes) else None
            for matrix, (_, values) in zip(matrices, planes) if texels else []:
                for n, c, v in matrix:
                    for texel, value in zip(texels, values):
                        texel[3 * n + c] += v * value
            shown[s["first_frame"] + i] = {"planes": [p and p[0] for p in planes], "coefficients": texels}
    return {"model": model["id"], "clip": model["clip"], "probe_texels": probes, "frames": shown}

# Meshes and poses, sections 3.5 and 3.6 --------------------------------------------------------------------
def unzstd(raw, limit, exact=None):
    """The one zstd frame in raw, of a stated size of at most limit, or exactly so many bytes."""
    z, length = ctypes.CDLL("libzstd.so.1"), ctypes.c_size_t(len(raw))
    z.ZSTD_getFrameContentSize.restype = ctypes.c_ulonglong
    z.ZSTD_findFrameCompressedSize.restype = z.ZSTD_decompress.restype = ctypes.c_size_t
    size = z.ZSTD_getFrameContentSize(raw, length)
    need(raw[:4] == b"\x28\xb5\x2f\xfd" and size <= limit and exact in (None, size), "zstd: size")
    need(z.ZSTD_findFrameCompressedSize(raw, length) == len(raw), "zstd: not one frame")
    out = ctypes.create_string_buffer(max(1, size))
    need(z.ZSTD_decompress(out, ctypes.c_size_t(size), raw, length) == size, "zstd: damaged")
    return out.raw[:size]

def meshopt(data, count, layout, index=False):
    """The entries of a stream, or the indices, by struct's layout."""
    stride, n = struct.calcsize(layout), ctypes.c_size_t
    raw = unzstd(data["_raw"], 2 * count * stride + 4096)
    need(raw[:1] == (b"\xe1" if index else b"\xa0"), "meshoptimizer: format")
    lib, out = ctypes.CDLL("libmeshoptimizer.so"), ctypes.create_string_buffer(count * stride)
    call = lib.meshopt_decodeIndexBuffer if index else lib.meshopt_decodeVertexBuffer
    need(call(out, n(count), n(stride), raw, n(len(raw))) == 0, "meshoptimizer: damaged")
    return list(struct.iter_unpack(layout, out.raw))

def bounded(offset, step, axes, top=65535, limit=1e9):
    need(all(abs(o + k * top) <= limit >= abs(o) for o, k in [*zip(offset, step)][:axes]), "bounds")

def affine(offset, step, integers):
    return [o + k * i for o, k, i in zip(offset, step, integers)]

def open_mesh(mesh, palette):
    """First four vertices: (position, morph deltas, [(palette entry, weight)]); checks everything."""
    count, skins = mesh["vertices"], {"joints": [], "weights": []}
    axes = {"position": 3, "lightmap_uv": 2, "albedo_uv": 2}
    need(max(meshopt(mesh["indices"], mesh["_indices"], "<I", True))[0] < count, "an index too large")
    for s in mesh["streams"]:
        kind = s["semantic"]
        values = meshopt(s["data"], count, "<4H" if s["stride"] == 8 else "<4B")
        bounded(s["offset"], s["scale"], axes.get(kind, 0))
        skins.get(kind, []).append(values)
        if kind == "position":
            base = [affine(s["offset"], s["scale"], v) for v in values[:4]]
    need(all(max(v) < palette for s in skins["joints"] for v in s), "a joint beyond the palette")
    need(all(sum(map(sum, v)) == 255 for v in zip(*skins["weights"])), "weights do not sum to 255")
    for t in mesh["morph_targets"]:
        bounded((0, 0, 0), t["scale"], 3, 32768)
    deltas = [[affine((0, 0, 0), t["scale"], v) for v in meshopt(t["data"], count, "<4h")[:4]]
              for t in mesh["morph_targets"]]
    pairs = list(zip(skins["joints"], skins["weights"]))
    return [(base[i], [d[i] for d in deltas], [(j, w) for a, b in pairs for j, w in zip(a[i], b[i]) if w])
            for i in range(min(4, count))]

def product(a, b):
    """Of row-major 3×4 matrices."""
    return [sum(a[r + k] * b[4 * k + c] for k in range(3)) + (a[r + 3] if c == 3 else 0)
            for r in (0, 4, 8) for c in range(4)]

def trs(translation=(0, 0, 0), rotation=(0, 0, 0, 1), scale=(1, 1, 1), **_):
    length = math.hypot(*rotation) or 1
    x, y, z, w = (v / length for v in rotation)
    turn = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    return sum(([a * s for a, s in zip(row, scale)] + [t] for row, t in zip(turn, translation)), [])

def unpack_pose(raw, count, frames, vertices):
    """value[t][v] of a pose packet."""
    n, values = count * frames, []
    need(1 + 2 * n <= MAX_POSE_BYTES, "a pose packet beyond this reader's limit")
    raw = unzstd(raw, 1 << 30, 1 + 2 * n)
    need(raw[0] & 3 < 3 and raw[0] < (8 if vertices else 4), "pose: mode")
    for t in range(frames):
        order, now, guess = min(raw[0] & 3, t), [], []
        for v in range(count):
            i = 1 + (t * count + v if vertices else v * frames + t)
            p = 0 if not order else values[t - 1][v] * order - (values[t - 2][v] if order == 2 else 0)
            guess.append(p)
            if vertices and v >= 3 and (not t or raw[0] & 4):
                p += now[v - 3] - guess[v - 3]
            r = raw[i] | raw[n + i] << 8
            now.append(p + (-(r + 1 >> 1) if r & 1 else r >> 1) & 0xFFFF)
        values.append(now)
    return values

def quaternion(c, words):
    need(words[2] < 32768, "pose: the top bit of w2")
    q = affine(c["offset"], c["step"], (w & 32767 for w in words))
    q.insert((words[0] >> 15) + 2 * (words[1] >> 15), math.sqrt(max(0.0, 1 - sum(x * x for x in q))))
    return q

def pose_frame(s, pose, meshes, values):
    """Positions of the first four vertices of each mesh for one frame's values."""
    result, at, weights = [], 0, [0.0] * s["SKEL"]["morph_weights"]
    for mesh, r in zip(s["MESH"], pose["vertex_ranges"]):
        for i in range(at, at + 3 * min(4, mesh["vertices"]), 3):
            result.append(affine(r["offset"], r["step"], values[i:i + 3]))
        at += 3 * mesh["vertices"]
    if pose["kind"] == "vertices":
        return result
    parts, world = {r["node"]: dict(r) for r in pose["rest"]}, []
    for c in pose["channels"]:
        words = values[at:at + (1 if c["target"] == "morph_weight" else 3)]
        at += len(words)
        value = quaternion(c, words) if c["target"] == "rotation" else affine(c["offset"], c["step"], words)
        if c["target"] == "morph_weight":
            weights[c["index"]] = value[0]
        else:
            parts.setdefault(c["index"], {})[c["target"]] = value
    for i, node in enumerate(s["SKEL"]["nodes"]):
        local = trs(**parts[i]) if i in parts else node["local"]
        world.append(local if node["parent"] < 0 else product(world[node["parent"]], local))
    palette = [product(world[e["node"]], e["inverse_bind"]) for e in s["SKEL"]["palette"]]
    need(all(abs(x) <= 1e12 for matrix in world + palette for x in matrix), "a matrix beyond all bounds")
    for record, mesh in zip(s["MESH"], meshes):
        for p, deltas, influences in mesh:
            for d, weight in zip(deltas, weights[record["first_morph_weight"]:]):
                p = affine(p, d, [weight] * 3)
            total = [0.0] * 3 if influences else p
            for joint, weight in influences:
                moved = product(palette[joint], trs(translation=p))
                total = affine(total, moved[3::4], [weight / 255] * 3)
            result.append(total)
    return result

def show_pose(file, pose, meshes, count):
    shown, vertices, total = [None] * count, pose["kind"] == "vertices", 0
    for c in pose["channels"]:
        morph, turn = c["target"] == "morph_weight", c["target"] == "rotation"
        bounded(c["offset"], c["step"], 1 if morph else 3, 32767 if turn else 65535, 1e6 if morph else 1e9)
        total += 1 if morph else 3
    for r, mesh in zip(pose["vertex_ranges"], file.records["MESH"]):
        bounded(r["offset"], r["step"], 3)
        total += 3 * mesh["vertices"]
    chunks = [(s, c) for s in file.segments if s["clip"] == pose["clip"] for c in s["chunks"]
              if c["track"] == pose["track"] and c["packets"]]
    for s, c in chunks:
        with contextlib.suppress(Refuse):       # a packet that cannot be used: its frames stay unknown
            raw, at = file.data[c["_at"]:c["_at"] + c["packets"][0][2]], s["first_frame"]
            values = unpack_pose(raw, total, s["frames"], vertices)[:max(0, count - at)]
            for i, v in enumerate(values):
                with contextlib.suppress(Refuse):
                    shown[at + i] = pose_frame(file.records, pose, meshes, v)
    return {"clip": pose["clip"], "vertices": shown}

def frames(file):
    counts = {c["id"]: c["frames"] for c in file.records["CLIP"]}
    need(sum(counts.values()) <= MAX_SHOWN_FRAMES, "more frames than this reader shows")
    meshes = [open_mesh(m, len(file.records["SKEL"]["palette"])) for m in file.records["MESH"]]
    return {"hash": "crc32", "models": [show_model(file, m, counts[m["clip"]]) for m in file.records["MODL"]],
            "poses": [show_pose(file, p, meshes, counts[p["clip"]]) for p in file.records["POSE"]]}

def public(value):
    if isinstance(value, dict):
        return {k: public(v) for k, v in value.items() if k[0] != "_"}
    return [public(v) for v in value] if isinstance(value, list) else value

def main():
    if len(sys.argv) != 3 or sys.argv[1] not in ("info", "frames"):
        sys.exit(__doc__)
    try:
        with open(sys.argv[2], "rb") as f:
            need(os.fstat(f.fileno()).st_size, "no byte")
            file = File(mmap.mmap(f.fileno(), 0, access=mmap.ACCESS_READ))
        print(json.dumps(public(file.info() if sys.argv[1] == "info" else frames(file))))
    except (Refuse, OSError, subprocess.TimeoutExpired) as error:
        sys.exit(f"{sys.argv[2]}: {str(error)!r}")
    if file.lossy or not file.end:
        print("something was lost" if file.lossy else "incomplete: no end record", file=sys.stderr)
    return 3 if file.lossy and sys.argv[1] == "info" else 0

if __name__ == "__main__":
    sys.exit(main())
