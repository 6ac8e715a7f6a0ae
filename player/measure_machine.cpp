// SPDX-License-Identifier: MIT
#include "player/measure_machine.hpp"

#include <sys/utsname.h>

#include <fstream>
#include <iterator>
#include <thread>

#include "player/measure_point.hpp"

namespace relit::player {
namespace {

// Of the first processor; ARM's kernels name none.
std::string cpu_model() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("model name", 0) != 0 && line.rfind("Hardware", 0) != 0) continue;
    const std::size_t begin = line.find_first_not_of(" \t:", line.find(':'));
    if (begin != std::string::npos) return line.substr(begin);
  }
  std::ifstream board("/proc/device-tree/model");
  std::string name;
  std::getline(board, name, '\0');
  return name.empty() ? "unknown" : name;
}

std::string system_name() {
  utsname name{};
  if (uname(&name) != 0) return "unknown";
  return std::string(name.sysname) + " " + name.release + " " + name.machine;
}

}  // namespace

std::vector<std::string> command_words() {
  std::ifstream in("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(in, word, '\0');) words.push_back(word);
  return words;
}

std::string shell_text(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) {
    if (!out.empty()) out += ' ';
    const bool plain = !word.empty() && word.find_first_not_of(
                                            "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                            "0123456789_-./,:=+@%") == std::string::npos;
    if (plain) {
      out += word;
      continue;
    }
    out += '\'';
    for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    out += '\'';
  }
  return out;
}

MeasuredMachine describe_machine(std::vector<Backend>& backends) {
  MeasuredMachine machine;
  machine.cpu = cpu_model();
  machine.cores = static_cast<int>(std::thread::hardware_concurrency());
  machine.system = system_name();
  machine.version = "relit " RELIT_VERSION;
  backends.clear();
  for (const Backend backend :
       {Backend::kEgl, Backend::kEglEs2, Backend::kEglEs2Mediump, Backend::kOsmesa}) {
    const Status opened = on_own_thread([&]() -> Status {
      RELIT_ASSIGN(const GlBackend gl, open_backend(backend));
      machine.gl.push_back(
          {backend_name(backend), gl.device->caps().renderer, gl.device->caps().version_text});
      return {};
    });
    if (opened) backends.push_back(backend);
  }
  return machine;
}

}  // namespace relit::player
