// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

// CLI11 is included by command_line.cpp alone: its headers take longer to compile than any command.
namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace relit::player {

/// One option, flag or positional argument of a command; belongs to its CommandLine.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option required();
  /// From `least` to `most` words.
  Option expected(int least, int most);
  /// Words after the first belong to what follows, so that the option is repeated for each.
  Option one_each();
  /// The words of one argument are separated by this.
  Option delimiter(char separator);
  Option excludes(Option other);
  Option needs(Option other);
  /// Both limits included. T: int or double.
  template <typename T>
  Option range(T least, T most);
  Option not_negative();
  Option one_of(std::initializer_list<int> values);
  Option one_of(std::initializer_list<std::string> values);
  /// A number with a unit such as KiB or MB.
  Option size_in_bytes();
  /// The help tells the variable's present value.
  Option shows_default();

  /// Whether it was on the command line; after parsing.
  [[nodiscard]] bool given() const;

 private:
  CLI::Option* option_;
};

/// The options of one command; belongs to its CommandLine.
class Options {
 public:
  explicit Options(CLI::App* app) : app_(app) {}

  /// `name` is "-o,--output", or one word for a positional argument. `variable` is written while
  /// parsing. T: std::string, int, double, float, std::uint32_t, std::uint64_t, or a vector of
  /// std::string, double, float or std::uint32_t.
  template <typename T>
  Option add(const std::string& name, T& variable, const std::string& help);
  Option flag(const std::string& name, bool& variable, const std::string& help);
  /// What the help ends with.
  void footer(const std::string& text);
  /// What the command does once its options are parsed: returns the exit status.
  void runs(std::function<int()> run);

 private:
  CLI::App* app_;
};

/// A program's commands and their options: parses the words and runs the command they name.
class CommandLine {
 public:
  CommandLine(const std::string& description, const std::string& program,
              const std::string& version);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  void footer(const std::string& text);
  Options add(const std::string& command, const std::string& help);

  /// The command's exit status; 0 after --help and --version, kUsage where the words make no sense
  /// (which is then said on standard error).
  int run(int argc, const char* const* argv);

 private:
  std::unique_ptr<CLI::App> app_;
};

}  // namespace relit::player
