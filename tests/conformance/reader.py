#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Reads .relit files as FORMAT.md says: reader.py info FILE | reader.py frames FILE

info prints the parsed structure (status 0: all was read; 1: the file cannot be used; 3: records
were lost). frames prints hashes of decoded planes, coefficients at probe texels and posed positions
(status 0 or 1). Needs only the standard library, libzstd, libmeshoptimizer and libavcodec."""
import collections, contextlib, ctypes, ctypes.util, io, itertools, json, math, pathlib, re, struct
import sys, zlib

SIGNATURE, MARKER = b"\x89RLT\r\n\x1a\n", bytes.fromhex("F3529C0BE6D17A38C41FA9650EB2875D")
# The static types behind HEAD in their order: names in INFO.md, and how many a file may have.
STATIC = {"CLIP": ("clips", 1024), "IMAG": ("images", 4096), "MATL": ("materials", 4096),
          "MESH": ("meshes", 4096), "SKEL": ("skeleton", 1), "POSE": ("poses", 1024),
          "MODL": ("models", 256), "LAYR": ("layers", 256)}
ORDER = ["HEAD", *STATIC, "SEGM", "INDX", "FEND"]
class Refuse(ValueError): """The file, or a part of it, must not be used."""
class Framing(Refuse): """The framing is lost at this place."""
def need(condition, what, error=Refuse):
    if not condition: raise error(what)

def signed(zigzag): return zigzag >> 1 ^ -(zigzag & 1)
def affine(offset, step, integers): return [o + k * i for o, k, i in zip(offset, step, integers)]
def distinct(values): return len(set(values := list(values))) == len(values)
# Payloads, section 4 ------------------------------------------------------------------------------
# A layout lists fields as name:code, the code being one of struct's, string, bytes, bool, another
# layout, or the names of enumerators, each behind a slash. Behind the code may stand
#   [n] for a list of at most n entries;   *n or *field for so many without a count before them;
#   =a..b for the least and the largest (of bytes: length);   ~regex for what a value must match;
# and bool? before it, if the field exists only where that bool is true. Line ends and "; " end one.
LAYOUTS = """
HEAD version:2H reserved:I=0..0 writer:string
CLIP id:I name:string tick_rate:2I=1..2147483647 frames:Q=1..4294967296
  duration_ticks:Q=1..4294967296 loop:bool bounds:3f*2
IMAG id:I=0..2147483647 media_type:string~image/(png|jpeg) data:bytes=1..inf
MATL id:I name:string base_color:4f=0..1 image:i=-1..2147483647 wrap:/repeat/clamp/mirror*2
  linear_filter:bool alpha_mode:/opaque/mask/blend alpha_cutoff:f=0..inf
MESH id:I name:string material:I vertices:I=1..65535 index_count:I=1..3145728 streams:stream[16]
  indices:bytes=1..inf first_morph_weight:I morph_targets:target[1024]
stream semantic:/position/normal/lightmap_uv/albedo_uv/color/joints/weights/twin stride:B
  offset:3f scale:3f=0..inf data:bytes=1..inf; target scale:3f=0..inf data:bytes=1..inf
SKEL morph_weights:I=0..65535 nodes:node[65535] palette:joint[65535]
node parent:i=-1..65534 local:12f=-1e9..1e9; joint node:I inverse_bind:12f=-1e9..1e9
POSE track:I clip:I kind:/joints/vertices rest:rest_pose[65535] channels:channel[262140]
  vertex_ranges:range[4096]
rest_pose node:I translation:3f rotation:4f scale:3f; range mesh:I offset:3f step:3f=0..inf
channel target:/translation/rotation/scale/morph_weight index:I offset:3f step:3f=0..inf
MODL id:I clip:I kind:/shlm order:B=0..3 size:2H=1..4096 prediction_plane:i=-1..255 mean:3f[16]
LAYR id:I model:I track:I codec:string~[a-z0-9_-]{1,32} codec_private:bytes=0..1048576
  coded:2H=1..16384 bit_depth:B~8|10 chroma:/luma/4:2:0/4:4:4 lossless:bool pictures:B=1..32
  has_exponents:bool has_exponents?exponents:exponents planes:plane[256]
exponents track:I codec:string~[a-z0-9_-]{1,32} codec_private:bytes=0..1048576
  coded:2H=1..16384 block:B~1|2|4|8|16|32 pictures:B=1..32
plane component:B=0..2 mantissa_rect:4H has_exponents?exponent_rect:4H scale:f matrix:BBf[48]
SEGM marker:16B index:I=0..16777215 clip:I first_frame:Q frames:I=1..65536 first_tick:Q
  chunks:announced[1024] durations:I[65536]=1..inf
CHNK track:I segment:I first_pts:Q count:I=1..131072 table_bytes:I
INDX count:I=0..16777216 reserved:I=0..0 segments:place*count
place index:I clip:I first_frame:Q frames:I reserved:I=0..0 first_tick:Q offset:Q
announced track:I reserved:I=0..0 bytes:Q=56..inf; FEND index_offset:Q copies_offset:Q file_bytes:Q
"""[1:-1].replace("\n  ", " ")
FIELD = re.compile(r"(?:(\w+)\?)?(\w+):([\w/:]+)\[?(\d*)\]?\*?(\w*)(?:=(.+)\.\.(.+))?~?(.*)")
FIELDS = {layout: [FIELD.fullmatch(field).groups() for field in fields]
          for layout, *fields in map(str.split, re.split("; |\n", LAYOUTS))}

class Payload(io.BytesIO):
    def take(self, n):
        need(len(raw := self.read(n)) == n, "shorter than its fields")
        return raw
    def field(self, code, outer=()):
        if code in FIELDS: return self.record(code, outer)
        if code == "bytes": return self.take(self.field("I"))
        if code == "string":
            need(len(raw := self.take(self.field("H"))) <= 4096 and b"\0" not in raw, "a string")
            return raw.decode("utf-8")
        if names := [False, True] if code == "bool" else code.split("/")[1:]:
            need((n := self.field("B")) < len(names), f"unsupported enumerator {n}")
            return names[n]
        values = struct.unpack("<" + code, self.take(struct.calcsize("<" + code)))
        need(all(map(math.isfinite, values)), "a number that is not finite")
        return values[0] if len(values) == 1 else list(values)
    def record(self, layout, outer=()):
        """The fields of a layout by their names; outer: those of the record that it is in."""
        d = {}
        for condition, name, code, most, count, low, high, pattern in FIELDS[layout]:
            if condition and not {**dict(outer), **d}[condition]: continue
            n = self.field("I") if most else int(d.get(count, count or 1))
            need(not most or n <= int(most), f"{layout}: {n} {name}")
            values = [self.field(code, d) for _ in range(n)]
            d[name] = values if most or count else values[0]
            need(not pattern or re.fullmatch(pattern, str(d[name])), f"{layout}: {name}")
            for v in values if low else []:
                numbers = v if isinstance(v, list) else [len(v) if code == "bytes" else v]
                need(float(low) <= min(numbers) <= max(numbers) <= float(high), f"{layout}: {name}")
        need(SOUND.get(layout, bool)(d), f"{layout}: contents, or an unknown version")
        return d

def parse(layout, raw):
    """What a payload, None being a damaged one, holds by the names of its layout."""
    d = (payload := Payload(raw)).record(layout)        # None is as if it were empty
    need(not payload.read(1), f"{layout}: longer than its fields")
    return d

def planes_are_sound(layer):
    for i, p in enumerate(layer["planes"]):
        x, y, w, h = p["mantissa_rect"]
        even = layer["chroma"] == "4:2:0" and x % 2 == y % 2 == 0
        need(p["component"] == 0 or layer["chroma"] == "4:4:4" or even, "component")
        for q in layer["planes"][:i]:
            a, b, width, height = q["mantissa_rect"]
            apart = x + w <= a or a + width <= x or y + h <= b or b + height <= y
            need(apart or p["component"] != q["component"], "planes overlap")
        need(x + w <= layer["coded"][0] and y + h <= layer["coded"][1], "mantissa_rect")
        if e := layer.get("exponents"):
            x, y, *size = p["exponent_rect"]
            need(size == [-(-w // e["block"]), -(-h // e["block"])], "exponent_rect")
            need(x + size[0] <= e["coded"][0] and y + size[1] <= e["coded"][1], "exponent_rect")
    return layer["planes"]
# What a layout does not show.
SOUND = {
    "LAYR": planes_are_sound, "HEAD": lambda d: d["version"][0] == 0 and d["version"][1] >= 2,
    "CLIP": lambda d: d["frames"] <= d["duration_ticks"] and all(map(float.__le__, *d["bounds"])),
    "MESH": lambda d: (n := collections.Counter(s["semantic"] for s in d["streams"])) and (
        d["index_count"] % 3 == 0 and n["joints"] == n["weights"] <= 2 and n["position"] == 1
        == n["lightmap_uv"] >= max(n["normal"], n["albedo_uv"], n["color"], n["twin"])),
    "stream": lambda d: d["stride"] == dict(twin=2, position=8, joints=8).get(d["semantic"], 4),
    "SKEL": lambda d: (all(n["parent"] < i for i, n in enumerate(d["nodes"]))
                       and all(joint["node"] < len(d["nodes"]) for joint in d["palette"])),
    "POSE": lambda d: distinct([r["node"] for r in d["rest"]]) and (
        distinct([(c["target"], c["index"]) for c in d["channels"]])
        and not (d["rest"] + d["channels"] if d["kind"] == "vertices" else d["vertex_ranges"])),
    "rest_pose": lambda d: abs(math.hypot(*d["rotation"]) - 1) <= 1e-3,
    "MODL": lambda d: len(d["mean"]) == (d["order"] + 1) ** 2,
    "plane": lambda d: (d["scale"] > 0 and distinct([(n, c) for n, c, _ in d["matrix"]])
                        and all(c < 3 for _, c, _ in d["matrix"])),
    "SEGM": lambda d: (bytes(d["marker"]) == MARKER and len(d["durations"]) in (0, d["frames"])
                       and d["first_tick"] + (sum(d["durations"]) or d["frames"]) <= 1 << 32
                       and distinct([c["track"] for c in d["chunks"]])),
    "INDX": lambda d: all(a["index"] < b["index"] and a["offset"] < b["offset"]
                          for a, b in itertools.pairwise(d["segments"])),
    "announced": lambda d: d["bytes"] % 8 == 0, "place": lambda d: d["offset"] % 8 == 0}

def check_references(s):
    """What section 7, step 3, asks for, and limits of several records. The clip of each track."""
    need(s["clips"] and all(len(s[name]) <= most for name, most in STATIC.values()), "records")
    need(all(distinct([r["id"] for r in s[t] if "id" in r]) for t in s), "two records of one id")
    for field in ("image", "material", "clip", "model"):
        ids = {-1} | {r["id"] for r in s[field + "s"]}      # -1: no image
        need(all(r[field] in ids for t in s for r in s[t] if field in r), f"no such {field}")
    skeleton = s["skeleton"] = [*s["skeleton"], {"morph_weights": 0, "nodes": [], "palette": []}][0]
    nodes, weights = len(skeleton["nodes"]), skeleton["morph_weights"]
    had = [(n := m["vertices"], m["index_count"], n * len(m["morph_targets"])) for m in s["meshes"]]
    need(all(sum(n) <= 1 << e for n, e in zip(zip(*had), (22, 25, 26))), "meshes")
    for m in s["meshes"]:
        m["triangles"] = m["index_count"] // 3
        joints, targets = any(x["semantic"] == "joints" for x in m["streams"]), m["morph_targets"]
        need((skeleton["palette"] or not joints) and (not targets or m["first_morph_weight"]
             + len(targets) <= weights), "no palette, or no such weight")
    for p in s["poses"]:
        need(all(r["node"] < nodes for r in p["rest"]), "a node that is not there")
        need(all(c["index"] < (weights if c["target"] == "morph_weight" else nodes)
                 for c in p["channels"]), "a channel of what is not there")
        ranges = [r["mesh"] for r in p["vertex_ranges"]]
        need(p["kind"] == "joints" or ranges == [m["id"] for m in s["meshes"]], "vertex ranges")
    for m in s["models"]:
        m["layers"] = [layer for layer in s["layers"] if layer["model"] == m["id"]]
        planes = [p for layer in m["layers"] for p in layer["planes"]]
        need(m["prediction_plane"] < len(planes) <= 256, "planes, or prediction without its plane")
        need(all(p["mantissa_rect"][2:] == m["size"] for p in planes), "a plane of another size")
        need(all(n < len(m["mean"]) for p in planes for n, _, _ in p["matrix"]), "a coefficient")
    tracks = [(p["track"], p["clip"]) for p in s["poses"]]
    for clip in s["clips"]:
        layers = [x for m in s["models"] if m["clip"] == clip["id"] for x in m["layers"]]
        users = layers + [x["exponents"] for x in layers if x["has_exponents"]]
        tracks += [(user["track"], clip["id"]) for user in users]
        total = sum(math.prod(user["coded"]) for user in users) * clip["frames"]
        num, den = clip["tick_rate"]
        clip["duration_s"] = clip["duration_ticks"] * den / num
        need(total <= 1 << 48 and total * num <= clip["duration_ticks"] * den << 33, "samples")
    need(distinct(p["clip"] for p in s["poses"]) and distinct(t for t, _ in tracks), "two users")
    return dict(tracks)
# The file, sections 1 and 2 -----------------------------------------------------------------------
Record = collections.namedtuple("Record", "offset flags type payload_bytes payload_crc body next")
def record_at(data, at):
    """The record whose header is at this place. body: None if it or the padding is damaged."""
    need(8 <= at <= len(data) - 24, "no place for a record", Framing)
    kind, flags, length, crc, header_crc = struct.unpack_from("<4sIQII", data, at)
    need(zlib.crc32(data[at:at + 20]) == header_crc, "a damaged header", Framing)
    body, end = data[at + 24:at + 24 + length], at + 24 + (length + 7) // 8 * 8
    need(kind.isalpha() and kind[2:3].isupper(), "no type of a record", Framing)
    need(length <= (278580 if kind == b"SEGM" else 1 << 30) and end <= len(data), "length", Framing)
    good = zlib.crc32(body) == crc and not any(data[at + 24 + length:end])
    return Record(at, flags, kind.decode(), length, crc, body if good else None, end)
def varints(raw):               # all numbers of a table
    codes = re.findall(rb"[\x00-\x7f]|[\x80-\xff]{1,8}[\x01-\x7f]|[\x80-\xff]{9}\x01", raw)
    need(b"".join(codes) == raw, "not the shortest form, or beyond 64 bits")
    return [sum((byte & 127) << 7 * i for i, byte in enumerate(c)) for c in codes]

class File:
    """Reads a whole file; what was lost is counted."""
    def __init__(self, data):
        self.data, self.size = data, len(data)
        self.lost, self.repaired = collections.Counter(records=0, bytes=0, segments=0), 0
        self.static, self.records = [], {}      # as they came; by name, when all are there
        self.tracks, self.packets = {}, {}      # clip of each; by segment and track, by frame
        self.segments, self.passed, self.index, self.end = [], [], None, None
        self.awaited, self.suspect = [], 0      # announced chunks; a damaged record just before
        self.rank, self.index_at, self.copies_at = 0, 0, 0
        need(data[:8] == SIGNATURE, "no .relit file")
        head = record_at(data, 8)
        need(head.type == "HEAD" and not head.flags & 0xFFFF, "does not begin with HEAD")
        self.head, at = parse("HEAD", head.body), head.next
        while at < self.size and self.rank < ORDER.index("FEND"):
            try: at = self.step(at)
            except Framing: at = self.find_way_back(at)
        self.lost.update(records=len(self.awaited) + (at < self.size), bytes=self.size - at)
        self.finish_static()
    def step(self, at):
        """Deals with the record at this place; where to go on."""
        r = record_at(self.data, at)
        copy = r.flags & 1 and r.type not in ("SEGM", "CHNK", "FEND")
        known = r.type in [*ORDER, "CHNK"] and r.flags & 0xFFFF == bool(copy)
        if not known and r.type[0].isupper():
            need(self.records, f"unknown critical record {r.type!r}, flags {r.flags:#x}")
            self.lost.update(records=1, bytes=self.size - at)
            return self.size                    # nobody knows what follows means
        need(r.type == "CHNK" or not self.awaited, "not the announced CHNK", Framing)
        self.suspect = at if r.body is None else 0
        if copy or not known:
            self.passed.append(r._asdict())
            self.copies_at = self.copies_at or (at if copy else 0)
            return r.next
        rank = self.rank if r.type == "CHNK" else ORDER.index(r.type)
        again = rank == self.rank and r.type in ("HEAD", "SKEL", "INDX")
        need(rank >= self.rank and not again, f"{r.type} out of order", Framing)
        self.rank = rank
        if r.type in ("SEGM", "INDX", "FEND"): self.finish_static()
        try:
            if r.type in STATIC: self.static.append(r)
            elif r.type == "SEGM": self.segment(r)
            elif r.type == "CHNK": self.chunk(r)
            elif r.type == "INDX":
                self.index_at, self.index = at, parse("INDX", r.body)["segments"]
            else:
                self.end = parse("FEND", r.body)
                need([*self.end.values()] == [self.index_at, self.copies_at, r.next], "elsewhere")
        except Refuse:
            self.lost.update(records=1, bytes=r.next - at)
            if r.type == "SEGM": return self.scan(at + 8)
        return r.next
    def scan(self, at):
        """Where the next believable SEGM is, from at on; the end of the file if there is none."""
        for marker in re.compile(re.escape(MARKER)).finditer(self.data, at + 24):
            with contextlib.suppress(Framing):
                r = record_at(self.data, marker.start() - 24)
                if r.type == "SEGM" and not (r.flags & 0xFFFF or r.offset % 8): return r.offset
        return self.size
    def find_way_back(self, at):
        """Where to go on when the framing was lost at this place."""
        found = self.scan(self.suspect + 8 if self.suspect else at)
        was_static = not self.records
        self.finish_static(cut=True)
        # All was repaired if records came from copies and the first segment is there.
        if not (was_static and self.repaired and self.data[found + 40:found + 44] == bytes(4)):
            self.lost.update(records=1 + len(self.awaited), bytes=max(0, found - at))
        self.awaited, self.rank, self.suspect = [], ORDER.index("SEGM"), 0
        return found
    def copies(self):           # yields those of the static records behind HEAD
        end = record_at(self.data, self.size - 48)
        need(end.type == "FEND", "no FEND leads to copies")
        r = record_at(self.data, parse("FEND", end.body)["copies_offset"])
        while r.type not in ORDER or r.flags & 0xFFFF == 1:
            if r.type in STATIC: yield r
            r = record_at(self.data, r.next)
    def finish_static(self, cut=False):
        """Repairs and checks the static part. cut: its framing was lost behind what is there."""
        if self.records: return
        own = self.static
        most = None if cut else max((i for i, r in enumerate(own, 1) if r.body is None), default=0)
        for i, copy in enumerate(itertools.islice(self.copies(), most)):
            if i == len(own) or own[i].body is None and copy[2:5] == own[i][2:5]:
                own[i:i + 1] = [copy]           # the same type, length and CRC
        self.repaired = sum(r.flags & 1 for r in own)
        need(sum(r.payload_bytes for r in own) <= 1 << 31, "static part beyond 2^31 bytes")
        records = {name: [parse(kind, r.body) for r in own if r.type == kind]
                   for kind, (name, _) in STATIC.items()}
        self.tracks, self.records = check_references(records), records
    def segment(self, r):
        s = parse("SEGM", r.body)
        gap = s["index"] - (self.segments[-1]["index"] + 1 if self.segments else 0)
        need(gap >= 0, "a number that does not rise")
        self.lost.update(segments=gap)
        s["chunks"] = [{**c, "packets": None, "data": None} for c in s["chunks"]]
        self.segments.append({"offset": r.offset, **s})
        self.awaited, self.copies_at = list(s["chunks"]), 0
    def chunk(self, r):
        need(self.awaited, "no segment announced it")
        announced, s, payload = self.awaited.pop(0), self.segments[-1], Payload(r.body)
        d = payload.record("CHNK")
        expected = [announced["track"], announced["bytes"], s["index"]]
        need([d["track"], r.next - r.offset, d["segment"]] == expected, "not the announced chunk")
        table = varints(payload.take(d["table_bytes"]))
        need(len(table) == 2 * d["count"] and table[1] == 0, "table")
        times = [*itertools.accumulate(map(signed, table[3::2]), initial=d["first_pts"])]
        sizes, keys = [v >> 1 for v in table[::2]], [v & 1 for v in table[::2]]
        packets = [payload.take(n) for n in sizes]
        need(distinct(times) and not payload.read(1), "two packets of a time, or bytes behind them")
        first, end = s["first_frame"], s["first_frame"] + s["frames"]
        if self.tracks.get(d["track"]) == s["clip"]:
            need(keys[0] and times[0] == first <= min(times) <= max(times) < end, "packets")
        announced.update(packets=[*zip(times, keys, sizes)], data=b"".join(packets))
        for t in [t for t in self.segments[:-1] if (t["index"], d["track"]) in self.packets]:
            if first == t["first_frame"]: del self.packets[t["index"], d["track"]]
            elif first < t["first_frame"] + t["frames"] and t["first_frame"] < end: return
        self.packets[s["index"], d["track"]] = {t - first: p for t, p in zip(times, packets)}
    def info(self):
        s, chunks = self.records, [c for segment in self.segments for c in segment["chunks"]]
        layers = [x for layer in s["layers"] for x in (layer, layer.get("exponents")) if x]
        for user in s["poses"] + layers:
            user["bytes"] = sum(c["bytes"] for c in chunks if c["track"] == user["track"])
        for i in s["images"]: i.update(bytes=len(i["data"]), crc32=zlib.crc32(i["data"]))
        return {**self.head, **s, "bytes": self.size, "complete": bool(self.end), "lost": self.lost,
                "repaired": self.repaired, "segments": self.segments, "index": self.index,
                "end": self.end, "passed_over": self.passed}
# Video, sections 3.3 and 3.4 ----------------------------------------------------------------------
# libavcodec decodes; fields of its structures lie, in bytes, where versions from 59 on have them.
class Pointer(ctypes.c_void_p):
    def at(self, offset, kind=ctypes.c_int): return kind.from_address(self.value + offset).value
AV, memory = ctypes.CDLL(ctypes.util.find_library("avcodec")), ctypes.create_string_buffer
for function in (AV.avcodec_descriptor_get_by_name, AV.avcodec_find_decoder, AV.av_frame_alloc,
                 AV.avcodec_alloc_context3): function.restype = Pointer
AV.av_get_pix_fmt_name.restype = ctypes.c_char_p
OPTIONS = b"threads 1, err_detect crccheck+explode, ec 0, idct simple, flags bitexact".split(b", ")
# Chroma, and of each component plane, first sample, step, and samples of component 0 for its own.
FORMATS = {b"gray": ("luma", [(0, 0, 1, 1)]), b"bgr0": ("4:4:4", [(0, i, 4, 1) for i in (1, 0, 2)]),
           b"yuv420p": ("4:2:0", [(0, 0, 1, 1), (1, 0, 1, 2), (2, 0, 1, 2)]),
           **dict.fromkeys((b"yuv444p", b"gbrp"), ("4:4:4", [(i, 0, 1, 1) for i in range(3)]))}
def open_decoder(track):
    kind = AV.avcodec_descriptor_get_by_name(track["codec"].encode())
    need(kind and (codec := AV.avcodec_find_decoder(kind.at(0))), f"no decoder: {track['codec']}")
    context, extra = AV.avcodec_alloc_context3(codec), memory(track["codec_private"] + bytes(64))
    gap = 28 if AV.avcodec_version() < 60 << 16 | 30 << 8 else 44
    fields = (0, kind.at(0), ctypes.addressof(extra), len(extra) - 65, *track["coded"], 0, 1)
    AV.avcodec_parameters_to_context(context, memory(struct.pack(f"<2i8xQi{gap}x4i", *fields), 512))
    for option in OPTIONS: AV.av_opt_set(context, *option.split(), 0)
    need(AV.avcodec_open2(context, codec, None) == 0, "codec_private")
    return context

def pictures(track, packets):
    """By time the components, as rows of samples, of the pictures that are as announced."""
    result, context, frame = {}, open_decoder(track), AV.av_frame_alloc()
    for time, body in [*((t, b) for t, b in packets.items() if b), (0, None)]:
        data = memory((body or b"") + bytes(64))        # None: the end, what was kept back comes
        packet = struct.pack("<8xqqQi", time, time, ctypes.addressof(data), len(data) - 65)
        sent = AV.avcodec_send_packet(context, body and memory(packet, 256))
        while sent == 0 and AV.avcodec_receive_frame(context, frame) == 0:
            w, h = frame.at(104), frame.at(108)
            name = (AV.av_get_pix_fmt_name(frame.at(116)) or b"").replace(b"yuvj", b"yuv")
            chroma, places = FORMATS.get(name.removesuffix(b"10le"), ("", []))
            sample, depth = ("H", 10) if name.endswith(b"10le") else ("B", 8)
            if (places and [w, h, depth] == [*track["coded"], track["bit_depth"]]
                    and track["chroma"] in ("luma", chroma)):
                result[frame.at(136, ctypes.c_int64)] = [[memoryview(ctypes.string_at(
                    frame.at(8 * plane, ctypes.c_void_p) + y * frame.at(64 + 4 * plane),
                    -(-w // n) * step * (depth + 7 >> 3))[first::step]).cast(sample)
                    for y in range(-(-h // n))] for plane, first, step, n in places]
    AV.av_frame_free(ctypes.byref(frame))
    AV.avcodec_free_context(ctypes.byref(context))
    return result

def decode(file, segment, track, areas, probes):
    """For each frame of the segment the frame that its packet is from, and for each area
    (component, x, y, width, height, texels a sample) hash and samples of the probe texels."""
    packets = file.packets.get((segment["index"], track["track"]), {})
    found = pictures(track, packets) if packets else {}
    result, time, shown = [], 0, None
    for k in range(segment["frames"]):
        time = k if k in packets else time
        if k in found:
            shown = []
            for component, x, y, w, h, step in areas:
                rows = found[k][component][y:y + h]
                crc = zlib.crc32(b"".join(row[x:x + w] for row in rows))
                shown.append((f"{crc:08x}", [rows[v // step][x + u // step] for u, v in probes]))
        elif k in packets and len(packets[k]) >= (16 if track["codec"] == "mpeg4" else 1):
            shown = None                        # an error: what repeats a picture is shorter
        result.append((time, shown))
    return result

def show_layer(file, layer, segment, probes):
    """Yields for each frame of the segment for each plane (hash, values at the texels), or None."""
    planes, areas, exponents = layer["planes"], [], None
    m0, e0 = (128, 135) if layer["bit_depth"] == 8 else (512, 137)
    for p in planes:
        step = 2 if p["component"] and layer["chroma"] == "4:2:0" else 1
        areas.append((p["component"], *(-(-v // step) for v in p["mantissa_rect"]), step))
    if layer["has_exponents"]:
        track = {**layer["exponents"], "chroma": "luma", "bit_depth": 8}
        rects = [(0, *p["exponent_rect"], track["block"]) for p in planes]
        exponents = decode(file, segment, track, rects, probes)
    for time, mantissas in decode(file, segment, layer, areas, probes):
        held = exponents[time][1] if exponents else [("", [e0] * len(probes))] * len(planes)
        shown = []
        for p, (m_hash, ms), (e_hash, es) in zip(planes, mantissas or [], held or []):
            values = [p["scale"] * (m - m0) * 2.0 ** (e - e0) if e else 0.0 for m, e in zip(ms, es)]
            shown.append((f"{m_hash}:{e_hash}" if exponents else m_hash, values))
        yield shown or [None] * len(planes)

def show_model(file, model, count):
    w, h = model["size"]
    probes, shown = [[0, 0], [w // 3, h // 2], [w // 2, h // 3], [w - 1, h - 1]], [None] * count
    matrices = [p["matrix"] for layer in model["layers"] for p in layer["planes"]]
    for s in file.segments:
        if s["clip"] != model["clip"]: continue
        layers = [show_layer(file, layer, s, probes) for layer in model["layers"]]
        for i, planes in zip(range(s["first_frame"], count), zip(*layers)):
            planes, texels = sum(planes, []), None
            if all(planes):
                texels = [sum(model["mean"], []) for _ in probes]
                for matrix, (_, values) in zip(matrices, planes):
                    for (n, c, factor), k in itertools.product(matrix, range(len(probes))):
                        texels[k][3 * n + c] += factor * values[k]
            if any(planes):
                shown[i] = {"planes": [p and p[0] for p in planes], "coefficients": texels}
    return {"model": model["id"], "clip": model["clip"], "probe_texels": probes, "frames": shown}
# Meshes and poses, sections 3.5 and 3.6 -----------------------------------------------------------
def bounded(offset, step, top=65535, limit=1e9):
    need(all(abs(o) <= limit and abs(o + k * top) <= limit for o, k in zip(offset, step)), "bounds")
def unzstd(raw, least, most):
    """The one zstd frame in raw, which states a size between these."""
    z, length = ctypes.CDLL("libzstd.so.1"), ctypes.c_size_t(len(raw))
    z.ZSTD_getFrameContentSize.restype = ctypes.c_ulonglong
    size = z.ZSTD_getFrameContentSize(raw, length)
    need(least <= size <= most and z.ZSTD_findFrameCompressedSize(raw, length) == len(raw), "zstd")
    out = memory(size)
    need(z.ZSTD_decompress(out, ctypes.c_size_t(size), raw, length) == size, "zstd: damaged")
    return out.raw
def words(raw):                 # whose low bytes stand before their high bytes
    return [low | high << 8 for low, high in zip(raw, raw[len(raw) // 2:])]

def read_triangles(raw, count):
    raw, out, size = unzstd(raw, 1, 8 * count + 4096), memory(4 * count), ctypes.c_size_t
    call = ctypes.CDLL("libmeshoptimizer.so").meshopt_decodeIndexBuffer
    need(raw[0] == 0xE1 and not call(out, size(count), size(4), raw, size(len(raw))), "indices")
    return list(struct.iter_unpack("<3I", out.raw))
def read_twins(raw, count):     # of those vertices that have one
    twins, last = {}, 0
    for v, word in enumerate(words(unzstd(raw, 2 * count, 2 * count))):
        if word: twins[v] = last = last + signed(word - 1) & 0xFFFF
        need(last < v or not word, "a twin that is not before its vertex")
    return twins
def neighbours(triangles, count):
    """Near, other and far of each vertex. Where there is none, near stands for other and other for
    far: what is predicted is near then."""
    found = {}
    for i, triangle in enumerate(triangles):
        for v in triangle:
            if v in found or v == min(triangle): continue
            other, near = ([u for u in sorted(triangle) if u < v] * 2)[:2]
            third = [sum(t) - near - other for t in triangles[max(0, i - 16):i]
                     if near in t and other in t and near != other]
            found[v] = near, other, third[-1] if third and third[-1] < v else other
    return [found.get(v, [v - 1] * 3) for v in range(count)]
# Of semantics the bits of a component, and what makes signed ones positive; else 16 and 0.
CODINGS = {"normal": (8, 128), "color": (8, 0), "weights": (8, 0), "target": (16, 32768)}
def read_stream(raw, semantic, stride, twins, links):   # the components of each vertex
    (bits, half), stored = CODINGS.get(semantic, (16, 0)), len(links) - len(twins)
    raw = unzstd(raw, stride * stored, stride * stored)
    folded, row, values = words(raw) if bits == 16 else raw, itertools.count(), []
    for v, link in enumerate(links):
        now, sources = [], [values[u] if v else itertools.repeat(0) for u in link]
        residuals = () if v in twins else folded[next(row)::stored]
        for r, near, other, far in zip(residuals, *sources):
            guess = near + other - far if bits == 16 else (near + other) // 2
            if semantic == "joints": guess = near
            if semantic == "weights" and len(now) == 3: guess = 255 - sum(now)
            now.append((guess + signed(r) + half) % (1 << bits) - half)
        values.append(now or values[twins[v]])
    return values

def open_mesh(mesh, palette):
    """First four vertices: (position, morph deltas, [(palette entry, weight)]); checks all."""
    count, streams, points = mesh["vertices"], collections.defaultdict(list), []
    triangles = read_triangles(mesh["indices"], mesh["index_count"])
    need(max(map(max, triangles)) < count, "an index too large")
    twins = [s["data"] for s in mesh["streams"] if s["semantic"] == "twin"]
    twins = read_twins(twins[0], count) if twins else {}
    for v in range(count): points.append(points[twins[v]] if v in twins else v)
    by_vertex = {}, neighbours(triangles, count)
    by_point = twins, neighbours([[points[v] for v in t] for t in triangles], count)
    for s in mesh["streams"]:
        axes = {"position": 3, "lightmap_uv": 2, "albedo_uv": 2}.get(s["semantic"], 0)
        bounded(s["offset"][:axes], s["scale"])
        if s["semantic"] != "twin":
            links = by_vertex if axes == 2 else by_point
            streams[s["semantic"]] += [read_stream(s["data"], s["semantic"], s["stride"], *links)]
        if s["semantic"] == "position":
            positions = [affine(s["offset"], s["scale"], v) for v in streams["position"][0][:4]]
    need(all(max(v) < palette for s in streams["joints"] for v in s), "joint beyond the palette")
    need(all(sum(map(sum, v)) == 255 for v in zip(*streams["weights"])), "weights are not 255")
    targets = [(t["scale"], read_stream(t["data"], "target", 8, *by_point))
               for t in mesh["morph_targets"]]
    return [(p, [affine((0, 0, 0), scale, values[i]) for scale, values in targets],
             [pair for joints, weights in zip(streams["joints"], streams["weights"])
              for pair in zip(joints[i], weights[i]) if pair[1]])
            for i, p in enumerate(positions)]

def product(a, b):              # of row-major 3×4 matrices
    return [sum(a[r + k] * b[4 * k + c] for k in range(3)) + (a[r + 3] if c == 3 else 0)
            for r in (0, 4, 8) for c in range(4)]
def trs(translation=(0, 0, 0), rotation=(0, 0, 0, 1), scale=(1, 1, 1), **_):
    x, y, z, w = (v / (math.hypot(*rotation) or 1) for v in rotation)
    turn = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    return sum(([a * s for a, s in zip(row, scale)] + [t] for row, t in zip(turn, translation)), [])

def unpack_pose(raw, count, frames, vertices):
    """Yields the values of each frame of a pose packet."""
    n = count * frames
    raw = unzstd(raw, 1 + 2 * n, min(1 + 2 * n, 1 << 30))
    order, along = raw[0] & 3, raw[0] >> 2
    need(order < 3 and along <= vertices, "pose: mode")
    residuals = [signed(word) for word in words(raw[1:])]
    last = before = [0] * count
    for t in range(frames):
        guess, now = [(0, a, 2 * a - b)[min(order, t)] for a, b in zip(last, before)], []
        for v, r in enumerate(residuals[t * count:][:count] if vertices else residuals[t::frames]):
            off = now[v - 3] - guess[v - 3] if vertices and v >= 3 and (along or t == 0) else 0
            now.append(guess[v] + off + r & 0xFFFF)
        before, last = last, now
        yield now
# Values of a channel, their largest integer, and the bound of what they stand for.
LIMITS = {"rotation": (3, 32767, 1e9), "morph_weight": (1, 65535, 1e6)}
def read_channel(c, values):
    words = list(itertools.islice(values, LIMITS.get(c["target"], (3,))[0]))
    if c["target"] != "rotation": return affine(c["offset"], c["step"], words)
    need(words[2] < 32768, "pose: the top bit of w2")
    q, omitted = affine(c["offset"], c["step"], [w & 32767 for w in words]), words[0] >> 15
    q.insert(omitted + 2 * (words[1] >> 15), math.sqrt(max(0, 1 - sum(x * x for x in q))))
    return q

def pose_frame(s, pose, meshes, values):
    """Positions of the first four vertices of each mesh for one frame's values."""
    result, values, weights = [], iter(values), [0.0] * s["skeleton"]["morph_weights"]
    for mesh, r in zip(s["meshes"], pose["vertex_ranges"]):
        own = list(itertools.islice(values, 3 * mesh["vertices"]))
        result += [affine(r["offset"], r["step"], own[i:]) for i in range(0, len(own), 3)[:4]]
    if pose["kind"] == "vertices": return result
    parts, world = {r["node"]: dict(r) for r in pose["rest"]}, []
    for c in pose["channels"]:
        value = read_channel(c, values)
        if c["target"] == "morph_weight": weights[c["index"]] = value[0]
        else: parts.setdefault(c["index"], {})[c["target"]] = value
    for i, node in enumerate(s["skeleton"]["nodes"]):
        local = trs(**parts[i]) if i in parts else node["local"]
        world.append(local if node["parent"] < 0 else product(world[node["parent"]], local))
    palette = [product(world[e["node"]], e["inverse_bind"]) for e in s["skeleton"]["palette"]]
    need(all(abs(x) <= 1e12 for matrix in world + palette for x in matrix), "matrix beyond bounds")
    for record, mesh in zip(s["meshes"], meshes):
        for p, deltas, influences in mesh:
            for d, weight in zip(deltas, weights[record["first_morph_weight"]:]):
                p = affine(p, d, [weight] * 3)
            if influences:
                skin = [sum(palette[j][k] * w / 255 for j, w in influences) for k in range(12)]
                p = product(skin, trs(translation=p))[3::4]
            result.append(p)
    return result

def show_pose(file, pose, meshes, count):
    parts = [(c, *LIMITS.get(c["target"], (3, 65535, 1e9))) for c in pose["channels"]]
    parts += [(r, 3 * m["vertices"], 65535, 1e9)
              for r, m in zip(pose["vertex_ranges"], file.records["meshes"])]
    for c, n, top, limit in parts: bounded(c["offset"][:n], c["step"], top, limit)
    shown, total = [None] * count, sum(n for _, n, _, _ in parts)
    for s in (s for s in file.segments if s["clip"] == pose["clip"]):
        packet, at = file.packets.get((s["index"], pose["track"]), {0: b""})[0], s["first_frame"]
        with contextlib.suppress(Refuse):       # a packet that cannot be used: frames stay unknown
            values = unpack_pose(packet, total, s["frames"], pose["kind"] == "vertices")
            for i, value in zip(range(at, count), values):
                with contextlib.suppress(Refuse):
                    shown[i] = pose_frame(file.records, pose, meshes, value)
    return {"clip": pose["clip"], "vertices": shown}

def show(file):
    s, count = file.records, {c["id"]: c["frames"] for c in file.records["clips"]}
    meshes = [open_mesh(m, len(s["skeleton"]["palette"])) for m in s["meshes"]]
    return {"hash": "crc32", "models": [show_model(file, m, count[m["clip"]]) for m in s["models"]],
            "poses": [show_pose(file, p, meshes, count[p["clip"]]) for p in s["poses"]]}

def main():
    if len(sys.argv) != 3 or sys.argv[1] not in ("info", "frames"): sys.exit(__doc__)
    try:
        file = File(pathlib.Path(sys.argv[2]).read_bytes())
        result = file.info() if sys.argv[1] == "info" else show(file)
        print(json.dumps(result, default=lambda raw: {"bytes": len(raw), "crc32": zlib.crc32(raw)}))
    except (ValueError, OSError) as error:
        sys.exit(f"{sys.argv[2]}: {str(error)!r}")
    return 3 if file.lost["records"] and sys.argv[1] == "info" else 0
if __name__ == "__main__": sys.exit(main())
