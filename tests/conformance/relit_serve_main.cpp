// SPDX-License-Identifier: MIT
// relit-serve: `relit info`, `relit validate` and relit-frames for `run.py --serve`. Each runs in a
// fork; the libraries, which take most of such a command's time, are loaded once.
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "player/command.hpp"
#include "tests/conformance/frames.hpp"

extern "C" {
#include <libavutil/log.h>
}

namespace {

using namespace relit;

int print_frames(const std::string& path) {
  auto source = container::FileSource::open(path);
  if (!source) return player::report(source.error());
  const auto frames = conformance::decode_frames(std::move(*source));
  if (!frames) return player::report_in(path, frames.error());
  std::printf("%s\n", frames->dump().c_str());
  return 0;
}

/// What main() of the command with these words returns.
int run(const std::vector<std::string>& words) {
  av_log_set_level(AV_LOG_QUIET);
  if (words.size() == 2 && words[0] == "frames") return print_frames(words[1]);
  player::CommandLine line("Conformance", "relit", "relit");
  player::add_info(line);
  player::add_validate(line);
  std::vector<const char*> arguments{"relit"};
  for (const std::string& word : words) arguments.push_back(word.c_str());
  return line.run(static_cast<int>(arguments.size()), arguments.data());
}

/// Runs them in a child whose standard output is `output`: the exit status, or 128 and a signal.
int run_in_child(const std::vector<std::string>& words, std::FILE* output) {
  const pid_t child = fork();
  if (child == 0) {
    dup2(fileno(output), STDOUT_FILENO);
    const int status = run(words);
    std::cout.flush();
    std::fflush(nullptr);
    _exit(status);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child) return 126;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::string contents(std::FILE* file) {
  std::rewind(file);
  std::string text;
  for (int c = std::getc(file); c != EOF; c = std::getc(file)) text.push_back(static_cast<char>(c));
  return text;
}

}  // namespace

int main() {
  for (std::string line; std::getline(std::cin, line);) {
    std::FILE* output = std::tmpfile();
    if (output == nullptr) return 2;
    const int status = run_in_child(nlohmann::json::parse(line), output);
    const nlohmann::json answer{{"status", status}, {"output", contents(output)}};
    std::fclose(output);
    std::printf("%s\n", answer.dump().c_str());
    std::fflush(stdout);
  }
  return 0;
}
