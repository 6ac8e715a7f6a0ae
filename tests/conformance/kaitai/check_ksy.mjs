// SPDX-License-Identifier: MIT
// check_ksy.mjs RELIT.KSY VECTORS MODULES: compiles the grammar, reads every valid vector with it, and
// compares what it sees with the vector's "info". MODULES is a folder with node_modules in it.
import { readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { isDeepStrictEqual } from 'node:util';
import { join, resolve } from 'node:path';

const [grammarPath, vectorsPath, modulesPath] = process.argv.slice(2);
if (!modulesPath) {
  console.error('usage: node check_ksy.mjs RELIT.KSY VECTORS MODULES');
  process.exit(2);
}
const require = createRequire(join(resolve(modulesPath), 'check.cjs'));
const yaml = require('js-yaml');
const compiler = require('kaitai-struct-compiler');
const { KaitaiStream } = require('kaitai-struct');

async function compile() {
  const files = await compiler.compile('javascript', yaml.load(readFileSync(grammarPath, 'utf8')));
  // As a file, so that an error in it has a place.
  const name = join(resolve(modulesPath), 'Relit.js');
  writeFileSync(name, files['Relit.js']);
  return require(name).Relit;
}

const crcTable = Uint32Array.from({ length: 256 }, (_, n) => {
  for (let k = 0; k < 8; ++k) n = n & 1 ? (n >>> 1) ^ 0xedb88320 : n >>> 1;
  return n >>> 0;
});
function crc32(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) crc = (crc >>> 8) ^ crcTable[(crc ^ byte) & 255];
  return (crc ^ 0xffffffff) >>> 0;
}

const blob = (bytes) => ({ bytes: bytes.length, crc32: crc32(bytes) });
const rect = (r) => [r.x, r.y, r.width, r.height];
const chromaNames = { luma: 'luma', c420: '4:2:0', c444: '4:4:4' };

/** Which member of an enumeration of the grammar a value is: 'alpha_mode' of 1 is 'mask'. */
function nameOf(Relit, enumeration, value) {
  const name = Relit[enumeration][value];
  if (name === undefined) throw new Error(`no ${enumeration} ${value}`);
  return name.toLowerCase();
}

/** The records by type, with the offset of each; copies and unknown ones are passed over. */
function sort(file) {
  const sorted = { byType: {}, passedOver: [] };
  let offset = 8;
  for (const record of file.records) {
    const entry = { ...record.payload, payload: record.payload, offset };
    const known = record.payload.constructor.name !== 'Opaque' && !record.isCopy;
    if (known) {
      (sorted.byType[record.type] ??= []).push(entry);
    } else {
      sorted.passedOver.push({
        offset,
        type: record.type,
        flags: record.flags.value,
        payload_bytes: record.lenPayload,
        payload_crc: record.payloadCrc,
      });
    }
    offset += 24 + record.lenPayload + record.padding.length;
  }
  sorted.bytes = offset;
  return sorted;
}

const clipInfo = (c) => ({
  id: c.id,
  name: c.name.value,
  frames: c.frameCount,
  tick_rate: [c.tickRateNum, c.tickRateDen],
  duration_ticks: c.durationTicks,
  duration_s: (c.durationTicks * c.tickRateDen) / c.tickRateNum,
  loop: c.loop === 1,
  bounds: [c.boundsMin.v, c.boundsMax.v],
});

const imageInfo = (i) => ({
  id: i.id,
  media_type: i.mediaType.value,
  ...blob(i.image.bytes),
});

const materialInfo = (Relit) => (m) => ({
  id: m.id,
  name: m.name.value,
  base_color: m.baseColor.v,
  image: m.imageId,
  wrap: [nameOf(Relit, 'Wrap', m.wrapU), nameOf(Relit, 'Wrap', m.wrapV)],
  linear_filter: m.linearFilter === 1,
  alpha_mode: nameOf(Relit, 'AlphaMode', m.alphaMode),
  alpha_cutoff: m.alphaCutoff,
});

const meshInfo = (Relit) => (m) => ({
  id: m.id,
  name: m.name.value,
  material: m.materialId,
  vertices: m.vertexCount,
  triangles: m.indexCount / 3,
  streams: m.streams.map((s) => ({
    semantic: nameOf(Relit, 'Semantic', s.semantic),
    stride: s.stride,
    offset: s.offset.v,
    scale: s.scale.v,
    data: blob(s.data.bytes),
  })),
  indices: blob(m.indices.bytes),
  first_morph_weight: m.firstMorphWeight,
  morph_targets: m.morphTargets.map((t) => ({ scale: t.scale.v, data: blob(t.data.bytes) })),
});

const skeletonInfo = (s) => ({
  morph_weights: s ? s.morphWeightCount : 0,
  nodes: s ? s.nodes.map((n) => ({ parent: n.parent, local: n.local.v })) : [],
  palette: s ? s.palette.map((p) => ({ node: p.node, inverse_bind: p.inverseBind.v })) : [],
});

const poseInfo = (Relit, trackBytes) => (p) => ({
  track: p.trackId,
  clip: p.clipId,
  kind: nameOf(Relit, 'PoseKind', p.kind),
  rest: p.rest.map((r) => ({
    node: r.node,
    translation: r.translation.v,
    rotation: r.rotation.v,
    scale: r.scale.v,
  })),
  channels: p.channels.map((c) => ({
    target: nameOf(Relit, 'ChannelTarget', c.target),
    index: c.index,
    offset: c.offset.v,
    step: c.step.v,
  })),
  vertex_ranges: p.vertexRanges.map((v) => ({ mesh: v.meshId, offset: v.offset.v, step: v.step.v })),
  bytes: trackBytes(p.trackId),
});

const planeInfo = (p) => ({
  component: p.component,
  mantissa_rect: rect(p.mantissaRect),
  ...(p.exponentRect ? { exponent_rect: rect(p.exponentRect) } : {}),
  scale: p.scale,
  matrix: p.matrix.map((m) => [m.coefficient, m.channel, m.value]),
});

const layerInfo = (Relit, trackBytes) => (l) => ({
  id: l.id,
  codec: l.codec.value,
  codec_private: blob(l.codecPrivate.bytes),
  bit_depth: l.bitDepth,
  chroma: chromaNames[nameOf(Relit, 'Chroma', l.chroma)],
  lossless: l.lossless === 1,
  coded: [l.codedWidth, l.codedHeight],
  pictures: l.mantissaPictures,
  track: l.mantissaTrack,
  bytes: trackBytes(l.mantissaTrack),
  ...(l.exponents
    ? {
        exponents: {
          codec: l.exponents.codec.value,
          codec_private: blob(l.exponents.codecPrivate.bytes),
          block: l.exponents.block,
          coded: [l.exponents.width, l.exponents.height],
          pictures: l.exponents.pictures,
          track: l.exponents.track,
          bytes: trackBytes(l.exponents.track),
        },
      }
    : {}),
  planes: l.planes.map(planeInfo),
});

const modelInfo = (Relit, layers, trackBytes) => (m) => ({
  id: m.id,
  clip: m.clipId,
  kind: nameOf(Relit, 'ModelKind', m.kind),
  order: m.order,
  size: [m.width, m.height],
  prediction_plane: m.predictionPlane,
  mean: m.mean.map((v) => v.v),
  layers: layers.filter((l) => l.modelId === m.id).map(layerInfo(Relit, trackBytes)),
});

function chunkInfo(announced, chunk) {
  if (!chunk) return { track: announced.trackId, bytes: announced.chunkBytes, packets: null, data: null };
  let pts = chunk.firstPts;
  return {
    track: announced.trackId,
    bytes: announced.chunkBytes,
    packets: chunk.table.packets.map((p) => {
      pts += p.ptsDifference.value;
      return [pts, p.key ? 1 : 0, Math.floor(p.size)];
    }),
    data: blob(chunk.data),
  };
}

const segmentInfo = (chunks) => (s) => ({
  offset: s.offset,
  index: s.index,
  clip: s.clipId,
  first_frame: s.firstFrame,
  frames: s.frameCount,
  first_tick: s.firstTick,
  durations: s.durations,
  chunks: s.chunks.map((announced) =>
    chunkInfo(
      announced,
      chunks.find((c) => c.segmentIndex === s.index && c.trackId === announced.trackId),
    ),
  ),
});

const indexInfo = (i) =>
  i.segments.map((e) => ({
    index: e.segmentIndex,
    clip: e.clipId,
    first_frame: e.firstFrame,
    frames: e.frameCount,
    first_tick: e.firstTick,
    offset: e.offset,
  }));

/** What the grammar sees, under the schema of container/INFO.md. */
function info(Relit, file) {
  const { byType, passedOver, bytes } = sort(file);
  const of = (type) => byType[type] ?? [];
  const trackBytes = (track) =>
    of('SEGM')
      .flatMap((s) => s.chunks)
      .filter((c) => c.trackId === track)
      .reduce((sum, c) => sum + c.chunkBytes, 0);
  const [head] = of('HEAD');
  const [index] = of('INDX');
  const [end] = of('FEND');
  let missing = 0;
  of('SEGM').forEach((s, i, all) => (missing += s.index - (i ? all[i - 1].index + 1 : 0)));
  return {
    version: [head.versionMajor, head.versionMinor],
    writer: head.writer.value,
    bytes,
    complete: end !== undefined,
    repaired: 0,
    lost: { records: 0, bytes: 0, segments: missing },
    clips: of('CLIP').map(clipInfo),
    images: of('IMAG').map(imageInfo),
    materials: of('MATL').map(materialInfo(Relit)),
    meshes: of('MESH').map(meshInfo(Relit)),
    skeleton: skeletonInfo(of('SKEL')[0]),
    poses: of('POSE').map(poseInfo(Relit, trackBytes)),
    models: of('MODL').map(modelInfo(Relit, of('LAYR'), trackBytes)),
    segments: of('SEGM').map(segmentInfo(of('CHNK'))),
    index: index ? indexInfo(index) : null,
    end: end
      ? {
          index_offset: end.indexOffset,
          copies_offset: end.copiesOffset,
          file_bytes: end.fileBytes,
        }
      : null,
    passed_over: passedOver,
  };
}

/** Where two values first differ. */
function difference(expected, got, where) {
  if (isDeepStrictEqual(expected, got)) return null;
  if (typeof expected === 'object' && typeof got === 'object' && expected && got) {
    for (const key of new Set([...Object.keys(expected), ...Object.keys(got)])) {
      const found = difference(expected[key], got[key], `${where}.${key}`);
      if (found) return found;
    }
  }
  return `${where} is ${JSON.stringify(got)}, not ${JSON.stringify(expected)}`;
}

const Relit = await compile();
let checked = 0;
let failed = 0;
for (const name of readdirSync(vectorsPath).filter((n) => n.endsWith('.json')).sort()) {
  const vector = JSON.parse(readFileSync(join(vectorsPath, name), 'utf8'));
  if (!vector.valid || vector.outcome !== 'whole') continue;
  ++checked;
  let problem;
  try {
    const bytes = readFileSync(join(vectorsPath, name.replace(/json$/, 'relit')));
    problem = difference(vector.info, info(Relit, new Relit(new KaitaiStream(bytes))), 'info');
  } catch (error) {
    problem = error.stack ?? String(error);
  }
  if (problem) {
    ++failed;
    console.log(`${vector.name}: ${problem}`);
  }
}
console.log(`relit.ksy: ${checked - failed} of ${checked} valid vectors read as relit info does`);
process.exit(checked > 0 && failed === 0 ? 0 : 1);
