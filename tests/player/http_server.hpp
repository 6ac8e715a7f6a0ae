// SPDX-License-Identifier: MIT
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/player/files.hpp"

namespace relit::player::test {

/// tests/player/http_server.py, running for as long as this object lives.
class HttpServer {
 public:
  explicit HttpServer(const std::filesystem::path& file) : log_(folder_.file("log")) {
    std::array<int, 2> to{}, from{};
    REQUIRE(::pipe2(to.data(), O_CLOEXEC) == 0);
    REQUIRE(::pipe2(from.data(), O_CLOEXEC) == 0);
    const std::string script = (source_dir() / "tests/player/http_server.py").string();
    child_ = ::fork();
    REQUIRE(child_ >= 0);
    if (child_ == 0) {
      ::dup2(to[0], STDIN_FILENO);
      ::dup2(from[1], STDOUT_FILENO);
      ::execlp("python3", "python3", script.c_str(), file.c_str(), log_.c_str(), nullptr);
      ::_exit(127);
    }
    ::close(to[0]);
    ::close(from[1]);
    input_ = to[1];
    char c = 0;
    while (::read(from[0], &c, 1) == 1 && c != '\n') port_ += c;
    ::close(from[0]);
    REQUIRE_FALSE(port_.empty());
  }
  ~HttpServer() {
    ::close(input_);
    ::kill(child_, SIGTERM);
    ::waitpid(child_, nullptr, 0);
  }
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// The file with a fault: "ok", "cut/1000", …
  [[nodiscard]] std::string address(const std::string& fault) const {
    return "http://127.0.0.1:" + port_ + "/" + fault;
  }

  struct Request {
    std::string range;  ///< as asked, or "-"
    int status = 0;
    std::uint64_t sent = 0;  ///< bytes of the body
  };
  /// All requests so far, once `count` of them have been answered.
  [[nodiscard]] std::vector<Request> log(std::size_t count) const {
    std::vector<Request> requests;
    for (int i = 0; i < 500; ++i) {
      requests.clear();
      std::ifstream in(log_);
      Request r;
      while (in >> r.range >> r.status >> r.sent) requests.push_back(r);
      if (requests.size() >= count) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return requests;
  }

 private:
  Folder folder_;
  std::string log_;
  std::string port_;
  pid_t child_ = -1;
  int input_ = -1;
};

}  // namespace relit::player::test
