// SPDX-License-Identifier: MIT
#include "container/byte_source.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>

#include "container/base/system_failure.hpp"

namespace relit::container {
namespace {

/// What a host's callback means by a negative number.
Unexpected host_failure(const std::string& doing, std::int64_t code) {
  constexpr std::int64_t kLast = static_cast<std::int64_t>(ErrorCode::kCancelled);
  const bool known = code < 0 && code >= -kLast;
  return fail(known ? static_cast<ErrorCode>(-code) : ErrorCode::kIo,
              "the host cannot " + doing + ": its callback returned " + std::to_string(code));
}

}  // namespace

void ByteSource::expect(std::uint64_t, std::uint64_t) {}

Status ByteSource::seek(std::uint64_t) {
  return fail(ErrorCode::kUnsupported, "this source can only be read from front to back");
}

Result<std::unique_ptr<FileSource>> FileSource::open(const std::string& path) {
  if (path == "-")
    return std::unique_ptr<FileSource>(
        new FileSource(STDIN_FILENO, false, "standard input", std::nullopt));
  int descriptor = -1;
  do {
    descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  } while (descriptor < 0 && errno == EINTR);
  if (descriptor < 0) return system_failure("cannot open '" + path + "'", errno);
  std::unique_ptr<FileSource> source(new FileSource(descriptor, true, "'" + path + "'", {}));
  struct stat info {};
  if (::fstat(descriptor, &info) != 0)
    return system_failure("cannot examine '" + path + "'", errno);
  if (S_ISDIR(info.st_mode)) return system_failure("cannot read '" + path + "'", EISDIR);
  if (S_ISREG(info.st_mode)) source->size_ = static_cast<std::uint64_t>(info.st_size);
  return source;
}

FileSource::~FileSource() {
  if (owned_) ::close(descriptor_);
}

Result<std::size_t> FileSource::read(std::span<std::uint8_t> out) {
  // POSIX leaves requests beyond SSIZE_MAX open, and Linux moves less than 2 GiB at once.
  const std::size_t wanted = std::min<std::size_t>(out.size(), std::size_t{1} << 30);
  ssize_t got = 0;
  do {
    got = ::read(descriptor_, out.data(), wanted);
  } while (got < 0 && errno == EINTR);
  if (got < 0) return system_failure("cannot read " + name_, errno);
  return static_cast<std::size_t>(got);
}

Status FileSource::seek(std::uint64_t offset_bytes) {
  if (!seekable()) return ByteSource::seek(offset_bytes);
  if (offset_bytes > static_cast<std::uint64_t>(std::numeric_limits<off_t>::max()))
    return fail(ErrorCode::kIo, "cannot seek to byte " + std::to_string(offset_bytes) + " of " +
                                    name_ + ": beyond what the system can address");
  if (::lseek(descriptor_, static_cast<off_t>(offset_bytes), SEEK_SET) < 0)
    return system_failure("cannot seek in " + name_, errno);
  return {};
}

Result<std::size_t> MemorySource::read(std::span<std::uint8_t> out) {
  const std::size_t n = std::min(out.size(), bytes_.size() - position_);
  if (n > 0) std::memcpy(out.data(), bytes_.data() + position_, n);
  position_ += n;
  return n;
}

Status MemorySource::seek(std::uint64_t offset_bytes) {
  position_ = static_cast<std::size_t>(std::min<std::uint64_t>(offset_bytes, bytes_.size()));
  return {};
}

Result<std::unique_ptr<CallbackSource>> CallbackSource::open(const SourceCallbacks& callbacks) {
  std::unique_ptr<CallbackSource> source(new CallbackSource(callbacks));
  if (callbacks.read == nullptr)
    return fail(ErrorCode::kInvalid, "a source of callbacks needs at least read()");
  return source;
}

CallbackSource::~CallbackSource() {
  if (callbacks_.close != nullptr) callbacks_.close(callbacks_.user);
}

Result<std::size_t> CallbackSource::read(std::span<std::uint8_t> out) {
  const std::int64_t got = callbacks_.read(callbacks_.user, out.data(), out.size());
  if (got < 0 || static_cast<std::uint64_t>(got) > out.size())
    return host_failure("read " + std::to_string(out.size()) + " bytes", got);
  return static_cast<std::size_t>(got);
}

std::optional<std::uint64_t> CallbackSource::size() const {
  const std::int64_t bytes = callbacks_.size == nullptr ? -1 : callbacks_.size(callbacks_.user);
  if (bytes < 0) return std::nullopt;
  return static_cast<std::uint64_t>(bytes);
}

Status CallbackSource::seek(std::uint64_t offset_bytes) {
  if (!seekable()) return ByteSource::seek(offset_bytes);
  const int code = callbacks_.seek(callbacks_.user, offset_bytes);
  if (code != 0) return host_failure("go to byte " + std::to_string(offset_bytes), code);
  return {};
}

void CallbackSource::expect(std::uint64_t begin_bytes, std::uint64_t end_bytes) {
  if (callbacks_.expect != nullptr) callbacks_.expect(callbacks_.user, begin_bytes, end_bytes);
}

}  // namespace relit::container
