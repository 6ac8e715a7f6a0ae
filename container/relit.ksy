# SPDX-License-Identifier: MIT
# The .relit format (FORMAT.md) as a Kaitai Struct grammar. Checksums, limits and what records say of
# each other are beyond it; a reader has to check them.
meta:
  id: relit
  title: relit relightable animation
  file-extension: relit
  license: MIT
  endian: le
  encoding: UTF-8
doc: Meshes, how they move, and their precomputed light transport as video.
doc-ref: FORMAT.md
seq:
  - id: signature
    contents: [0x89, 'RLT', 0x0d, 0x0a, 0x1a, 0x0a]
  - id: records
    type: record
    repeat: eos
types:
  record:
    doc: Section 2.2. Every record starts at a multiple of 8.
    seq:
      - id: type
        type: str
        size: 4
        encoding: ASCII
      - id: flags
        type: record_flags
        size: 4
      - id: len_payload
        type: u8
        valid:
          max: 1073741824
      - id: payload_crc
        type: u4
      - id: header_crc
        type: u4
      - id: payload
        size: len_payload
        type:
          switch-on: known_type
          cases:
            '"HEAD"': head
            '"CLIP"': clip
            '"IMAG"': imag
            '"MATL"': matl
            '"MESH"': mesh
            '"SKEL"': skel
            '"POSE"': pose
            '"MODL"': modl
            '"LAYR"': layr
            '"SEGM"': segm
            '"CHNK"': chnk
            '"INDX"': indx
            '"FEND"': fend
            _: opaque
      - id: padding
        contents: [0]
        repeat: expr
        repeat-expr: (8 - len_payload % 8) % 8
    instances:
      known_type:
        doc: Copies are read like originals; records with other critical flags are of unknown type.
        value: 'flags.reserved_critical ? "" : type'
      is_copy:
        value: flags.copy
  record_flags:
    doc: Section 2.3.
    meta:
      bit-endian: le
    seq:
      - id: copy
        type: b1
      - id: critical_bits
        type: b15
      - id: ancillary_bits
        type: b16
    instances:
      reserved_critical:
        value: critical_bits != 0
      value:
        value: '(copy ? 1 : 0) + critical_bits * 2 + ancillary_bits * 65536'
  opaque:
    seq:
      - id: bytes
        size-eos: true

  # Section 4: notation.
  text:
    seq:
      - id: len
        type: u2
        valid:
          max: 4096
      - id: value
        type: str
        size: len
  blob:
    seq:
      - id: len
        type: u4
      - id: bytes
        size: len
  vec3:
    seq:
      - id: v
        type: f4
        repeat: expr
        repeat-expr: 3
  vec4:
    seq:
      - id: v
        type: f4
        repeat: expr
        repeat-expr: 4
  affine:
    doc: Row-major 3x4.
    seq:
      - id: v
        type: f4
        repeat: expr
        repeat-expr: 12
  rect:
    seq:
      - id: x
        type: u2
      - id: y
        type: u2
      - id: width
        type: u2
      - id: height
        type: u2
  varint:
    doc: |
      Unsigned LEB128. The value is right up to 2^53, above which some languages have no exact
      integers; nothing in a file within the limits comes near.
    seq:
      - id: groups
        type: varint_group
        repeat: until
        repeat-until: not _.more
    instances:
      value:
        doc: By multiplication, since shifts are of 32 bits in some languages.
        value: >-
          groups[0].bits
          + (groups.size > 1 ? groups[1].bits * 128 : 0)
          + (groups.size > 2 ? groups[2].bits * 16384 : 0)
          + (groups.size > 3 ? groups[3].bits * 2097152 : 0)
          + (groups.size > 4 ? groups[4].bits * 268435456 : 0)
          + (groups.size > 5 ? groups[5].bits * 34359738368 : 0)
          + (groups.size > 6 ? groups[6].bits * 4398046511104 : 0)
          + (groups.size > 7 ? groups[7].bits * 562949953421312 : 0)
  varint_group:
    seq:
      - id: byte
        type: u1
    instances:
      more:
        value: byte >= 128
      bits:
        value: byte % 128
  zigzag:
    seq:
      - id: raw
        type: varint
    instances:
      value:
        value: 'raw.value % 2 == 0 ? raw.value / 2 : -(raw.value + 1) / 2'

  # Section 4: payloads.
  head:
    seq:
      - id: version_major
        type: u2
      - id: version_minor
        type: u2
      - id: reserved
        type: u4
        valid: 0
      - id: writer
        type: text
  clip:
    seq:
      - id: id
        type: u4
      - id: name
        type: text
      - id: tick_rate_num
        type: u4
        valid:
          min: 1
          max: 2147483647
      - id: tick_rate_den
        type: u4
        valid:
          min: 1
          max: 2147483647
      - id: frame_count
        type: u8
      - id: duration_ticks
        type: u8
      - id: loop
        type: u1
        valid:
          max: 1
      - id: bounds_min
        type: vec3
      - id: bounds_max
        type: vec3
  imag:
    seq:
      - id: id
        type: u4
      - id: media_type
        type: text
      - id: image
        type: blob
  matl:
    seq:
      - id: id
        type: u4
      - id: name
        type: text
      - id: base_color
        type: vec4
      - id: image_id
        type: s4
      - id: wrap_u
        type: u1
        enum: wrap
      - id: wrap_v
        type: u1
        enum: wrap
      - id: linear_filter
        type: u1
        valid:
          max: 1
      - id: alpha_mode
        type: u1
        enum: alpha_mode
      - id: alpha_cutoff
        type: f4
  mesh:
    seq:
      - id: id
        type: u4
      - id: name
        type: text
      - id: material_id
        type: u4
      - id: vertex_count
        type: u4
      - id: index_count
        type: u4
      - id: num_streams
        type: u4
        valid:
          max: 16
      - id: streams
        type: stream
        repeat: expr
        repeat-expr: num_streams
      - id: indices
        type: blob
      - id: first_morph_weight
        type: u4
      - id: num_morph_targets
        type: u4
        valid:
          max: 1024
      - id: morph_targets
        type: target
        repeat: expr
        repeat-expr: num_morph_targets
    types:
      stream:
        doc: zstd around what prediction leaves of the values; section 3.6.
        seq:
          - id: semantic
            type: u1
            enum: semantic
          - id: stride
            type: u1
          - id: offset
            type: vec3
          - id: scale
            type: vec3
          - id: data
            type: blob
      target:
        seq:
          - id: scale
            type: vec3
          - id: data
            type: blob
  skel:
    seq:
      - id: morph_weight_count
        type: u4
      - id: num_nodes
        type: u4
        valid:
          max: 65535
      - id: nodes
        type: node
        repeat: expr
        repeat-expr: num_nodes
      - id: num_palette
        type: u4
        valid:
          max: 65535
      - id: palette
        type: palette_entry
        repeat: expr
        repeat-expr: num_palette
    types:
      node:
        seq:
          - id: parent
            type: s4
          - id: local
            type: affine
      palette_entry:
        seq:
          - id: node
            type: u4
          - id: inverse_bind
            type: affine
  pose:
    seq:
      - id: track_id
        type: u4
      - id: clip_id
        type: u4
      - id: kind
        type: u1
        enum: pose_kind
      - id: num_rest
        type: u4
      - id: rest
        type: rest
        repeat: expr
        repeat-expr: num_rest
      - id: num_channels
        type: u4
      - id: channels
        type: channel
        repeat: expr
        repeat-expr: num_channels
      - id: num_vertex_ranges
        type: u4
      - id: vertex_ranges
        type: vertex_range
        repeat: expr
        repeat-expr: num_vertex_ranges
    types:
      rest:
        seq:
          - id: node
            type: u4
          - id: translation
            type: vec3
          - id: rotation
            type: vec4
          - id: scale
            type: vec3
      channel:
        seq:
          - id: target
            type: u1
            enum: channel_target
          - id: index
            type: u4
          - id: offset
            type: vec3
          - id: step
            type: vec3
      vertex_range:
        seq:
          - id: mesh_id
            type: u4
          - id: offset
            type: vec3
          - id: step
            type: vec3
  modl:
    seq:
      - id: id
        type: u4
      - id: clip_id
        type: u4
      - id: kind
        type: u1
        enum: model_kind
      - id: order
        type: u1
        valid:
          max: 3
      - id: width
        type: u2
      - id: height
        type: u2
      - id: prediction_plane
        type: s4
      - id: num_mean
        type: u4
        valid: (order + 1) * (order + 1)
      - id: mean
        type: vec3
        repeat: expr
        repeat-expr: num_mean
  layr:
    seq:
      - id: id
        type: u4
      - id: model_id
        type: u4
      - id: mantissa_track
        type: u4
      - id: codec
        type: text
      - id: codec_private
        type: blob
      - id: coded_width
        type: u2
      - id: coded_height
        type: u2
      - id: bit_depth
        type: u1
        valid:
          any-of: [8, 10]
      - id: chroma
        type: u1
        enum: chroma
      - id: lossless
        type: u1
        valid:
          max: 1
      - id: mantissa_pictures
        type: u1
      - id: has_exponents
        type: u1
        valid:
          max: 1
      - id: exponents
        type: exponents
        if: has_exponents == 1
      - id: num_planes
        type: u4
        valid:
          min: 1
          max: 256
      - id: planes
        type: plane(has_exponents == 1)
        repeat: expr
        repeat-expr: num_planes
    types:
      exponents:
        seq:
          - id: track
            type: u4
          - id: codec
            type: text
          - id: codec_private
            type: blob
          - id: width
            type: u2
          - id: height
            type: u2
          - id: block
            type: u1
            valid:
              any-of: [1, 2, 4, 8, 16, 32]
          - id: pictures
            type: u1
      plane:
        params:
          - id: has_exponents
            type: bool
        seq:
          - id: component
            type: u1
            valid:
              max: 2
          - id: mantissa_rect
            type: rect
          - id: exponent_rect
            type: rect
            if: has_exponents
          - id: scale
            type: f4
          - id: num_matrix
            type: u4
            valid:
              max: 48
          - id: matrix
            type: matrix_entry
            repeat: expr
            repeat-expr: num_matrix
      matrix_entry:
        seq:
          - id: coefficient
            type: u1
          - id: channel
            type: u1
            valid:
              max: 2
          - id: value
            type: f4
  segm:
    seq:
      - id: marker
        contents: [0xf3, 0x52, 0x9c, 0x0b, 0xe6, 0xd1, 0x7a, 0x38, 0xc4, 0x1f, 0xa9, 0x65, 0x0e, 0xb2, 0x87, 0x5d]
      - id: index
        type: u4
      - id: clip_id
        type: u4
      - id: first_frame
        type: u8
      - id: frame_count
        type: u4
        valid:
          min: 1
          max: 65536
      - id: first_tick
        type: u8
      - id: num_chunks
        type: u4
        valid:
          max: 1024
      - id: chunks
        type: chunk
        repeat: expr
        repeat-expr: num_chunks
      - id: num_durations
        type: u4
        valid:
          expr: _ == 0 or _ == frame_count
      - id: durations
        type: u4
        repeat: expr
        repeat-expr: num_durations
    types:
      chunk:
        seq:
          - id: track_id
            type: u4
          - id: reserved
            type: u4
            valid: 0
          - id: chunk_bytes
            type: u8
  chnk:
    seq:
      - id: track_id
        type: u4
      - id: segment_index
        type: u4
      - id: first_pts
        type: u8
      - id: packet_count
        type: u4
        valid:
          min: 1
          max: 131072
      - id: table_bytes
        type: u4
      - id: table
        type: packet_table(packet_count)
        size: table_bytes
      - id: data
        size-eos: true
    types:
      packet_table:
        params:
          - id: packet_count
            type: u4
        seq:
          - id: packets
            type: packet
            repeat: expr
            repeat-expr: packet_count
      packet:
        seq:
          - id: size_and_key
            type: varint
          - id: pts_difference
            type: zigzag
        instances:
          size:
            value: size_and_key.value / 2
          key:
            value: size_and_key.value % 2 == 1
  indx:
    seq:
      - id: count
        type: u4
        valid:
          max: 16777216
      - id: reserved
        type: u4
        valid: 0
      - id: segments
        type: entry
        repeat: expr
        repeat-expr: count
    types:
      entry:
        seq:
          - id: segment_index
            type: u4
          - id: clip_id
            type: u4
          - id: first_frame
            type: u8
          - id: frame_count
            type: u4
          - id: reserved
            type: u4
            valid: 0
          - id: first_tick
            type: u8
          - id: offset
            type: u8
  fend:
    seq:
      - id: index_offset
        type: u8
      - id: copies_offset
        type: u8
      - id: file_bytes
        type: u8
enums:
  wrap:
    0: repeat
    1: clamp
    2: mirror
  alpha_mode:
    0: opaque
    1: mask
    2: blend
  semantic:
    0: position
    1: normal
    2: lightmap_uv
    3: albedo_uv
    4: color
    5: joints
    6: weights
    7: twin
  pose_kind:
    0: joints
    1: vertices
  channel_target:
    0: translation
    1: rotation
    2: scale
    3: morph_weight
  model_kind:
    0: shlm
  chroma:
    0: luma
    1: c420
    2: c444
