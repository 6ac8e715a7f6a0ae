// SPDX-License-Identifier: MIT
#include "decoders/npy.hpp"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "container/base/limits.hpp"

namespace relit::decoders {
namespace {

static_assert(std::endian::native == std::endian::little,
              "arrays are written as they lie in memory");

constexpr char kMagic[] = {'\x93', 'N', 'U', 'M', 'P', 'Y', 1, 0};
constexpr std::uint64_t kMaxElements = 1ull << 34;

std::span<const std::uint8_t> raw_bytes(const auto& values) {
  const auto bytes = std::as_bytes(std::span(values));
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

std::string header(const char* descr, std::span<const std::uint64_t> shape) {
  std::string text = std::string("{'descr': '") + descr + "', 'fortran_order': False, 'shape': (";
  for (const std::uint64_t side : shape) text += std::to_string(side) + ", ";
  text += "), }";
  // The format wants the data to start at a multiple of 64 bytes.
  const std::size_t unpadded = sizeof kMagic + 2 + text.size() + 1;
  text.append((64 - unpadded % 64) % 64, ' ');
  return text + '\n';
}

}  // namespace

Result<NpyWriter> NpyWriter::create(const std::filesystem::path& path, Type type,
                                    std::span<const std::uint64_t> shape) {
  NpyWriter writer;
  writer.type_ = type;
  writer.remaining_ = shape.empty() ? 0 : 1;
  for (const std::uint64_t side : shape) {
    if (side != 0 && writer.remaining_ > kMaxElements / side) {
      return fail(ErrorCode::kLimit, path.string() + ": an array of more than 2^34 elements");
    }
    writer.remaining_ *= side;
  }
  if (writer.remaining_ == 0) return fail(ErrorCode::kInvalid, path.string() + ": an empty array");
  writer.target_ = path.string();
  RELIT_ASSIGN(writer.sink_, container::FileSink::create(writer.target_));
  const std::string text = header(type == Type::kFloat32 ? "<f4" : "|u1", shape);
  const std::uint8_t length[2] = {static_cast<std::uint8_t>(text.size() & 0xff),
                                  static_cast<std::uint8_t>(text.size() >> 8)};
  RELIT_TRY(writer.sink_->write(raw_bytes(kMagic)));
  RELIT_TRY(writer.sink_->write(length));
  RELIT_TRY(writer.sink_->write(raw_bytes(text)));
  return writer;
}

Status NpyWriter::write_elements(std::span<const std::uint8_t> bytes, std::uint64_t elements,
                                 Type type) {
  if (type != type_ || elements > remaining_)
    return fail(ErrorCode::kInvalid, target_ + ": elements that its shape does not hold");
  RELIT_TRY(sink_->write(bytes));
  remaining_ -= elements;
  return {};
}

Status NpyWriter::write(std::span<const float> values) {
  return write_elements(raw_bytes(values), values.size(), Type::kFloat32);
}

Status NpyWriter::write(std::span<const std::uint8_t> values) {
  return write_elements(values, values.size(), Type::kUint8);
}

Status NpyWriter::commit() {
  if (remaining_ != 0) {
    return fail(ErrorCode::kInvalid,
                target_ + ": " + std::to_string(remaining_) + " elements are missing");
  }
  return sink_->commit();
}

namespace {

// The text of one key of the header's dictionary, up to the next comma outside parentheses.
Result<std::string> entry(const std::string& text, const std::string& key,
                          const std::string& where) {
  const std::size_t at = text.find("'" + key + "':");
  if (at == std::string::npos)
    return fail(ErrorCode::kCorrupt, where + ": no '" + key + "' in its header");
  const std::size_t begin = at + key.size() + 3;
  const std::size_t open = text.find_first_not_of(' ', begin);
  const std::size_t end =
      open != std::string::npos && text[open] == '(' ? text.find(')', open) : text.find(',', begin);
  if (end == std::string::npos) return fail(ErrorCode::kCorrupt, where + ": its header breaks off");
  return text.substr(begin, end - begin + 1);
}

Result<std::vector<std::uint64_t>> parse_shape(const std::string& text, const std::string& where) {
  std::vector<std::uint64_t> shape;
  std::uint64_t elements = 1;
  for (std::size_t i = 0; i < text.size();) {
    if (text[i] < '0' || text[i] > '9') {
      ++i;
      continue;
    }
    std::uint64_t side = 0;
    for (; i < text.size() && text[i] >= '0' && text[i] <= '9'; ++i) {
      side = side * 10 + static_cast<std::uint64_t>(text[i] - '0');
      if (side > kMaxElements) return fail(ErrorCode::kLimit, where + ": its shape is too large");
    }
    if (side == 0 || elements > kMaxElements / side) {
      return fail(ErrorCode::kLimit, where + ": its shape is empty or too large");
    }
    elements *= side;
    shape.push_back(side);
  }
  return shape;
}

}  // namespace

Unexpected NpyReader::io_error() const {
  return fail(ErrorCode::kIo, name_ + ": cannot be read: " + std::strerror(errno));
}

Result<NpyReader> NpyReader::open(const std::filesystem::path& path) {
  NpyReader reader(File(std::fopen(path.c_str(), "rb"), [](std::FILE* f) { std::fclose(f); }),
                   path.string());
  if (!reader.file_) return reader.io_error();
  RELIT_TRY(reader.read_header());
  std::error_code error;
  const std::uint64_t expected =
      reader.header_bytes_ + reader.elements_ * (reader.bytes_ ? 1 : sizeof(float));
  if (std::filesystem::file_size(path, error) != expected || error) {
    return fail(ErrorCode::kTruncated,
                reader.name_ + ": its shape needs " + std::to_string(expected) + " bytes");
  }
  return reader;
}

Status NpyReader::read_header() {
  std::uint8_t start[10];
  if (std::fread(start, sizeof start, 1, file_.get()) != 1 || std::memcmp(start, kMagic, 6) != 0 ||
      start[6] != 1) {
    return fail(ErrorCode::kCorrupt, name_ + ": not a version 1 .npy file");
  }
  std::string text(static_cast<std::size_t>(start[8] | start[9] << 8), '\0');
  if (text.empty() || std::fread(text.data(), text.size(), 1, file_.get()) != 1) {
    return fail(ErrorCode::kTruncated, name_ + ": ends in its header");
  }
  RELIT_ASSIGN(const std::string type, entry(text, "descr", name_));
  RELIT_ASSIGN(const std::string order, entry(text, "fortran_order", name_));
  RELIT_ASSIGN(const std::string shape, entry(text, "shape", name_));
  bytes_ = type.find("|u1") != std::string::npos;
  if ((!bytes_ && type.find("<f4") == std::string::npos) ||
      order.find("False") == std::string::npos) {
    return fail(ErrorCode::kUnsupported,
                name_ + ": only C-ordered float32 and uint8 arrays are read");
  }
  RELIT_ASSIGN(shape_, parse_shape(shape, name_));
  elements_ = 1;
  for (const std::uint64_t side : shape_) elements_ *= side;
  header_bytes_ = sizeof start + text.size();
  return {};
}

Status NpyReader::read(std::uint64_t first, std::span<float> out) {
  if (first > elements_ || out.size() > elements_ - first)
    return fail(ErrorCode::kInvalid, name_ + ": elements that its shape does not hold");
  const std::uint64_t at = header_bytes_ + first * (bytes_ ? 1 : sizeof(float));
  if (fseeko(file_.get(), static_cast<off_t>(at), SEEK_SET) != 0) return io_error();
  if (!bytes_) {
    if (std::fread(out.data(), sizeof(float), out.size(), file_.get()) != out.size())
      return io_error();
    return {};
  }
  std::vector<std::uint8_t> raw(out.size());
  if (std::fread(raw.data(), 1, raw.size(), file_.get()) != raw.size()) return io_error();
  std::copy(raw.begin(), raw.end(), out.begin());
  return {};
}

Result<NpyArray> read_npy(const std::filesystem::path& path) {
  RELIT_ASSIGN(NpyReader reader, NpyReader::open(path));
  NpyArray array;
  array.shape = reader.shape();
  array.values.resize(reader.elements());
  RELIT_TRY(reader.read(0, array.values));
  return array;
}

}  // namespace relit::decoders
