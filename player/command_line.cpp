// SPDX-License-Identifier: MIT
#include "player/command_line.hpp"

#include <CLI/CLI.hpp>
#include <cstdint>
#include <iostream>
#include <utility>

#include "player/command.hpp"

namespace relit::player {

Option Option::required() { return Option(option_->required()); }
Option Option::expected(int least, int most) { return Option(option_->expected(least, most)); }
Option Option::one_each() { return Option(option_->allow_extra_args(false)); }
Option Option::delimiter(char separator) { return Option(option_->delimiter(separator)); }
Option Option::excludes(Option other) { return Option(option_->excludes(other.option_)); }
Option Option::needs(Option other) { return Option(option_->needs(other.option_)); }

template <typename T>
Option Option::range(T least, T most) {
  return Option(option_->check(CLI::Range(least, most)));
}
template Option Option::range(int, int);
template Option Option::range(double, double);

Option Option::not_negative() { return Option(option_->check(CLI::NonNegativeNumber)); }
Option Option::one_of(std::initializer_list<int> values) {
  return Option(option_->check(CLI::IsMember(std::vector(values))));
}
Option Option::one_of(std::initializer_list<std::string> values) {
  return Option(option_->check(CLI::IsMember(std::vector(values))));
}
Option Option::size_in_bytes() { return Option(option_->transform(CLI::AsSizeValue(false))); }
Option Option::shows_default() { return Option(option_->capture_default_str()); }
bool Option::given() const { return option_->count() > 0; }

template <typename T>
Option Options::add(const std::string& name, T& variable, const std::string& help) {
  return Option(app_->add_option(name, variable, help));
}
template Option Options::add(const std::string&, std::string&, const std::string&);
template Option Options::add(const std::string&, int&, const std::string&);
template Option Options::add(const std::string&, double&, const std::string&);
template Option Options::add(const std::string&, float&, const std::string&);
template Option Options::add(const std::string&, std::uint32_t&, const std::string&);
template Option Options::add(const std::string&, std::uint64_t&, const std::string&);
template Option Options::add(const std::string&, std::vector<std::string>&, const std::string&);
template Option Options::add(const std::string&, std::vector<double>&, const std::string&);
template Option Options::add(const std::string&, std::vector<float>&, const std::string&);
template Option Options::add(const std::string&, std::vector<std::uint32_t>&, const std::string&);

Option Options::flag(const std::string& name, bool& variable, const std::string& help) {
  return Option(app_->add_flag(name, variable, help));
}
void Options::footer(const std::string& text) { app_->footer(text); }

namespace {

/// A subcommand that knows what it does.
class Runnable : public CLI::App {
 public:
  using CLI::App::App;
  std::function<int()> run;
};

}  // namespace

void Options::runs(std::function<int()> run) { static_cast<Runnable*>(app_)->run = std::move(run); }

CommandLine::CommandLine(const std::string& description, const std::string& program,
                         const std::string& version)
    : app_(std::make_unique<CLI::App>(description, program)) {
  app_->set_version_flag("--version", version);
  app_->require_subcommand(1);
}

CommandLine::~CommandLine() = default;

void CommandLine::footer(const std::string& text) { app_->footer(text); }

Options CommandLine::add(const std::string& command, const std::string& help) {
  const auto added = std::make_shared<Runnable>(help, command);
  added->footer(app_->get_footer());
  app_->add_subcommand(added);
  return Options(added.get());
}

int CommandLine::run(int argc, const char* const* argv) {
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app_->exit(error, std::cout, std::cerr) == 0 ? kSuccess : kUsage;
  }
  return static_cast<const Runnable*>(app_->get_subcommands().front())->run();
}

}  // namespace relit::player
