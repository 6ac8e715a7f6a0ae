// SPDX-License-Identifier: MIT
#include "container/byte_sink.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <utility>

#include "container/base/system_failure.hpp"

namespace relit::container {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 18;

std::string directory_of(const std::string& path) {
  const auto slash = path.find_last_of('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

/// Creates a file that was not there, named after `target`. Not mkstemp(3): its mode is 0600, and
/// the process's umask cannot be asked for without setting it, which other threads would notice.
int create_beside(const std::string& target, std::string& name) {
  for (int attempt = 0;; ++attempt) {
    name = target + "." + std::to_string(::getpid()) + "-" + std::to_string(attempt) + ".part";
    const int descriptor = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor >= 0) return descriptor;
    if (errno != EINTR && (errno != EEXIST || attempt == 1000)) return -1;
  }
}

/// The target behind a symbolic link, so that the rename replaces the file and not the link.
std::string resolve_link(const std::string& path) {
  char* resolved = ::realpath(path.c_str(), nullptr);
  if (resolved == nullptr) return path;
  std::string result(resolved);
  std::free(resolved);
  return result;
}

void sync_directory(const std::string& directory) {
  const int descriptor = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

}  // namespace

Status MemorySink::write(std::span<const std::uint8_t> bytes) {
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  return {};
}

FileSink::FileSink(int descriptor, std::string target, std::string temporary)
    : descriptor_(descriptor), target_(std::move(target)), temporary_(std::move(temporary)) {
  buffer_.reserve(kBufferBytes);
}

Result<std::unique_ptr<FileSink>> FileSink::create(const std::string& path) {
  const std::string doing = "cannot write '" + path + "'";
  struct stat info {};
  const bool exists = ::stat(path.c_str(), &info) == 0;
  if (exists && S_ISDIR(info.st_mode)) return system_failure(doing, EISDIR);
  if (exists && !S_ISREG(info.st_mode)) {
    const int descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor < 0) return system_failure(doing, errno);
    return std::unique_ptr<FileSink>(new FileSink(descriptor, path, ""));
  }
  if (exists && ::access(path.c_str(), W_OK) != 0) return system_failure(doing, errno);
  const std::string target = exists ? resolve_link(path) : path;
  std::string temporary;
  const int descriptor = create_beside(target, temporary);
  if (descriptor < 0)
    return system_failure(doing + ": no temporary file in directory '" + directory_of(target) + "'",
                          errno);
  std::unique_ptr<FileSink> sink(new FileSink(descriptor, target, temporary));
  if (exists && ::fchmod(descriptor, info.st_mode & 0777) != 0) return system_failure(doing, errno);
  return sink;
}

FileSink::~FileSink() { discard(); }

Status FileSink::write(std::span<const std::uint8_t> bytes) {
  if (buffer_.size() + bytes.size() > kBufferBytes) RELIT_TRY(flush());
  if (bytes.size() > kBufferBytes) return write_through(bytes);
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  return {};
}

Status FileSink::commit() {
  RELIT_TRY(flush());
  // Pipes and devices have nothing to wait for and say EINVAL or ENOTSUP.
  if (::fsync(descriptor_) != 0 && !temporary_.empty())
    return fail_and_discard("cannot write '" + target_ + "'", errno);
  if (::close(std::exchange(descriptor_, -1)) != 0)
    return fail_and_discard("cannot write '" + target_ + "'", errno);
  if (temporary_.empty()) return {};
  if (::rename(temporary_.c_str(), target_.c_str()) != 0)
    return fail_and_discard("cannot rename '" + temporary_ + "' to '" + target_ + "'", errno);
  temporary_.clear();
  sync_directory(directory_of(target_));
  return {};
}

Status FileSink::flush() {
  RELIT_TRY(write_through(buffer_));
  buffer_.clear();
  return {};
}

Status FileSink::write_through(std::span<const std::uint8_t> bytes) {
  if (descriptor_ < 0)
    return fail(ErrorCode::kIo, "cannot write '" + target_ + "': it is closed, or failed before");
  while (!bytes.empty()) {
    const std::size_t wanted = std::min<std::size_t>(bytes.size(), std::size_t{1} << 30);
    const ssize_t n = ::write(descriptor_, bytes.data(), wanted);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return fail_and_discard("cannot write '" + target_ + "'", errno);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return {};
}

Status FileSink::fail_and_discard(const std::string& doing, int error) {
  discard();
  return system_failure(doing, error);
}

void FileSink::discard() {
  if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
  temporary_.clear();
}

}  // namespace relit::container
