// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

/// What a reader accepts. Every length, dimension, count and index of a file is checked against
/// these before anything is allocated; container/FORMAT.md gives the reason for each.
namespace relit::limits {

inline constexpr std::uint64_t kRecordBytes = 1ull << 30;        ///< payload of one record
inline constexpr std::uint64_t kDecompressedBytes = 1ull << 30;  ///< of one zstd or meshopt stream
inline constexpr std::uint64_t kStaticBytes =
    1ull << 31;  ///< payloads of all records before the first segment
inline constexpr std::uint32_t kStringBytes = 4096;
inline constexpr std::uint32_t kCodecNameBytes = 32;
inline constexpr std::uint32_t kCodecPrivateBytes = 1u << 20;
inline constexpr std::uint32_t kRational = 0x7FFFFFFF;  ///< numerator and denominator
inline constexpr std::uint32_t kLightMapSide = 4096;    ///< texels
inline constexpr std::uint32_t kVideoSide = 16384;      ///< samples of a coded picture
inline constexpr std::uint32_t kImageSide = 16384;      ///< texels of an albedo image
inline constexpr std::uint64_t kImageTexels = 1ull << 26;
inline constexpr std::uint32_t kImageScans = 256;  ///< of a JPEG picture
inline constexpr std::uint32_t kShOrder = 3;
inline constexpr std::uint32_t kCoefficients = 16;
inline constexpr std::uint32_t kPlanes = 256;  ///< of one model
inline constexpr std::uint32_t kLayers = 256;  ///< of one file
inline constexpr std::uint32_t kClips = 1024;
inline constexpr std::uint32_t kMeshes = 4096;
inline constexpr std::uint32_t kMaterials = 4096;
inline constexpr std::uint32_t kImages = 4096;
/// Before the first segment: what each kind may have, a pose track for each clip, HEAD and SKEL.
inline constexpr std::uint32_t kStaticRecords =
    2 * kClips + kImages + kMaterials + kMeshes + 2 * kLayers + 2;
inline constexpr std::uint32_t kVerticesPerMesh = 65535;  ///< 16-bit indices, GLES 2
inline constexpr std::uint32_t kIndicesPerMesh = 3u * 1048576u;
inline constexpr std::uint32_t kVertexStreams = 16;  ///< of one mesh
inline constexpr std::uint32_t kMorphTargets = 1024;
inline constexpr std::uint64_t kVertices = 1ull << 22;  ///< of all meshes
inline constexpr std::uint64_t kIndices = 1ull << 25;   ///< of all meshes
inline constexpr std::uint64_t kMorphOffsets =
    1ull << 26;  ///< vertices times morph targets, of all meshes
inline constexpr std::uint32_t kNodes = 65535;
inline constexpr std::uint32_t kPalette = 65535;       ///< (node, inverse bind matrix) pairs
inline constexpr std::uint32_t kMorphWeights = 65535;  ///< of one skeleton
inline constexpr std::uint32_t kPoseChannels = 3 * kNodes + kMorphWeights;
inline constexpr std::uint64_t kFrames = 1ull << 32;  ///< of one clip
inline constexpr std::uint64_t kTicks = 1ull << 32;   ///< of one clip: times the tick rate < 2^63
inline constexpr std::uint32_t kFramesPerSegment = 65536;
inline constexpr std::uint32_t kChunksPerSegment = 1024;
inline constexpr std::uint32_t kPacketsPerChunk = 2 * kFramesPerSegment;
inline constexpr std::uint64_t kVideoSamples = 1ull << 48;  ///< of all coded pictures of a clip
inline constexpr std::uint64_t kVideoSamplesPerSecond = 1ull << 33;
inline constexpr std::uint32_t kDecoderPictures =
    32;  ///< references, reordering, the one coming out
inline constexpr std::uint32_t kSegments = 1u << 24;

}  // namespace relit::limits
