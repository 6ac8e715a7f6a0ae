// SPDX-License-Identifier: MIT
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <thread>

#include "container/byte_sink.hpp"
#include "container/byte_source.hpp"
#include "tests/container/sample.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::container;
using sample::Bytes;
using sample::TemporaryDirectory;

namespace {

Bytes contents(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void put(const std::string& path, const Bytes& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

using Names = std::vector<std::string>;

}  // namespace

TEST_CASE("a file appears when it is committed, and not before") {
  TemporaryDirectory directory;
  const auto path = directory.path("out.relit");
  const Bytes bytes(1000000, 7);
  auto sink = FileSink::create(path);
  REQUIRE(sink);
  REQUIRE((*sink)->write(bytes));
  REQUIRE((*sink)->write(Bytes{1, 2, 3}));
  CHECK_FALSE(std::filesystem::exists(path));
  REQUIRE((*sink)->commit());
  CHECK(directory.names() == Names{"out.relit"});
  CHECK(contents(path).size() == 1000003);
  CHECK_FALSE((*sink)->commit());
  CHECK_FALSE((*sink)->write(Bytes(1 << 20)));
  CHECK(contents(path).size() == 1000003);
}

TEST_CASE("a file that is not committed leaves nothing, and the old one as it was") {
  TemporaryDirectory directory;
  const auto path = directory.path("out.relit");
  put(path, {1, 2, 3});
  {
    auto sink = FileSink::create(path);
    REQUIRE(sink);
    REQUIRE((*sink)->write(Bytes(1 << 20)));
    CHECK(directory.names().size() == 2);
  }
  CHECK(directory.names() == Names{"out.relit"});
  CHECK(contents(path) == Bytes{1, 2, 3});
}

TEST_CASE("a writer that fails leaves nothing behind") {
  TemporaryDirectory directory;
  {
    auto sink = FileSink::create(directory.path("out.relit")).value();
    auto writer = Writer::create(*sink, "test").value();
    REQUIRE(writer.add(sample::clip()));
    CHECK_FALSE(writer.add(sample::clip()));
  }
  CHECK(directory.names().empty());
}

TEST_CASE("a replaced file keeps its permissions, a new one has the usual ones") {
  TemporaryDirectory directory;
  const auto path = directory.path("out.relit");
  const auto mode_of = [&] {
    struct stat info {};
    REQUIRE(::stat(path.c_str(), &info) == 0);
    return info.st_mode & 0777;
  };
  const mode_t mask = ::umask(027);
  auto sink = FileSink::create(path).value();
  REQUIRE(sink->commit());
  ::umask(mask);
  CHECK(mode_of() == 0640);
  REQUIRE(::chmod(path.c_str(), 0604) == 0);
  sink = FileSink::create(path).value();
  REQUIRE(sink->commit());
  CHECK(mode_of() == 0604);
}

TEST_CASE("writing through a symbolic link keeps the link") {
  TemporaryDirectory directory;
  put(directory.path("real"), {1});
  std::filesystem::create_symlink("real", directory.path("link"));
  auto sink = FileSink::create(directory.path("link")).value();
  REQUIRE(sink->write(Bytes{2, 2}));
  REQUIRE(sink->commit());
  CHECK(std::filesystem::is_symlink(directory.path("link")));
  CHECK(contents(directory.path("real")) == Bytes{2, 2});
  CHECK(directory.names() == Names{"link", "real"});
}

TEST_CASE("a full disk is an error that says so") {
  if (!std::filesystem::exists("/dev/full")) {
    WARN("skipped: there is no /dev/full");
    return;
  }
  auto sink = FileSink::create("/dev/full");
  REQUIRE(sink);
  auto writer = Writer::create(**sink, "test").value();
  sample::add_static(writer);
  const auto status = (*sink)->commit();
  REQUIRE_FALSE(status);
  CHECK(status.error().code == ErrorCode::kIo);
  CHECK(status.error().message.find("No space left on device") != std::string::npos);
  CHECK(std::filesystem::exists("/dev/full"));
  // More than is buffered fails at once.
  sink = FileSink::create("/dev/full");
  REQUIRE(sink);
  CHECK_FALSE((*sink)->write(Bytes(1 << 20)));
  CHECK_FALSE((*sink)->write(Bytes(1 << 20)));
  CHECK_FALSE((*sink)->commit());
}

TEST_CASE("targets that cannot be written are named") {
  TemporaryDirectory directory;
  const auto missing = FileSink::create(directory.path("no/such/out.relit"));
  REQUIRE_FALSE(missing);
  CHECK(missing.error().code == ErrorCode::kIo);
  CHECK(missing.error().message.find("no/such") != std::string::npos);
  const auto folder = FileSink::create(directory.path("."));
  REQUIRE_FALSE(folder);
  CHECK(folder.error().message.find("directory") != std::string::npos);
  if (::geteuid() == 0) return;  // root may write anywhere
  REQUIRE(::chmod(directory.path(".").c_str(), 0500) == 0);
  const auto denied = FileSink::create(directory.path("out.relit"));
  REQUIRE(::chmod(directory.path(".").c_str(), 0700) == 0);
  REQUIRE_FALSE(denied);
  CHECK(denied.error().message.find("ermission") != std::string::npos);
}

TEST_CASE("a file is read back as it was written") {
  TemporaryDirectory directory;
  const auto path = directory.path("in.relit");
  put(path, sample::file());
  auto source = FileSource::open(path);
  REQUIRE(source);
  CHECK((*source)->seekable());
  CHECK((*source)->size() == sample::file().size());
  const auto all = sample::read_everything(std::move(*source));
  REQUIRE(all);
  CHECK(same(*all, sample::read_everything(sample::memory(sample::file())).value()));
  auto reader = Reader::open(FileSource::open(path).value());
  REQUIRE(reader);
  CHECK(reader->read_index().value().segments.size() == 3);
}

TEST_CASE("a named pipe is written and read from front to back") {
  TemporaryDirectory directory;
  const auto path = directory.path("pipe");
  REQUIRE(::mkfifo(path.c_str(), 0600) == 0);
  const auto file = sample::file();
  Status written;
  std::thread thread([&] {
    auto sink = FileSink::create(path);
    written = sink ? (*sink)->write(file) : Status(Unexpected{sink.error()});
    if (written) written = (*sink)->commit();
  });
  auto source = FileSource::open(path);
  const bool opened = source.has_value();
  const bool seekable = opened && (*source)->seekable();
  const auto all = opened ? sample::read_everything(std::move(*source))
                          : Result<sample::Everything>(fail(ErrorCode::kIo, "not opened"));
  thread.join();
  CHECK(written);
  CHECK_FALSE(seekable);
  REQUIRE(all);
  CHECK(all->finished);
}

TEST_CASE("waiting for a pipe can be interrupted, and goes on all the same") {
  TemporaryDirectory directory;
  const auto path = directory.path("pipe");
  REQUIRE(::mkfifo(path.c_str(), 0600) == 0);
  // Before anybody writes, then while nobody does.
  int polls = 0;
  bool stop = true;
  const auto source = FileSource::open(path, [&] { return stop && ++polls > 3; }).value();
  std::vector<std::uint8_t> some(10);
  const auto refused = source->read(some);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == ErrorCode::kCancelled);
  const int writer = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  REQUIRE(writer >= 0);
  polls = 0;
  CHECK(source->read(some).error().code == ErrorCode::kCancelled);
  CHECK(polls > 3);
  stop = false;
  REQUIRE(::write(writer, "abc", 3) == 3);
  CHECK(source->read(some).value() == 3);
  CHECK(some[2] == 'c');
  ::close(writer);
  CHECK(source->read(some).value() == 0);
}

TEST_CASE("files that cannot be read are named") {
  TemporaryDirectory directory;
  const auto missing = FileSource::open(directory.path("nothing"));
  REQUIRE_FALSE(missing);
  CHECK(missing.error().code == ErrorCode::kIo);
  CHECK(missing.error().message.find("nothing") != std::string::npos);
  const auto folder = FileSource::open(directory.path("."));
  REQUIRE_FALSE(folder);
  CHECK(folder.error().message.find("directory") != std::string::npos);
}

TEST_CASE("standard input is never sought in") {
  auto source = FileSource::open("-");
  REQUIRE(source);
  CHECK_FALSE((*source)->seekable());
  CHECK_FALSE((*source)->size());
  CHECK((*source)->seek(0).error().code == ErrorCode::kUnsupported);
}
