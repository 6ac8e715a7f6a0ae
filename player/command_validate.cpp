// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "player/command.hpp"
#include "player/source.hpp"
#include "player/validator.hpp"

namespace relit::player {
namespace {

using nlohmann::ordered_json;

struct ValidateArguments {
  std::vector<std::string> sources;
  bool json = false;
  bool warnings_as_errors = false;
  int threads = 1;
};

struct Totals {
  std::uint64_t files = 0, valid = 0, errors = 0, warnings = 0;
};

/// All .relit files below a folder, sorted; anything else is itself.
Result<std::vector<std::string>> expand(const std::vector<std::string>& sources) {
  namespace fs = std::filesystem;
  std::vector<std::string> files;
  for (const std::string& source : sources) {
    std::error_code error;
    if (source == "-" || !fs::is_directory(source, error)) {
      files.push_back(source);
      continue;
    }
    std::vector<std::string> found;
    fs::recursive_directory_iterator at(source, error), end;
    for (; !error && at != end; at.increment(error)) {
      std::error_code ignored;
      if (at->path().extension() == ".relit" && at->is_regular_file(ignored))
        found.push_back(at->path().string());
    }
    if (error) return fail(ErrorCode::kIo, source + ": " + error.message());
    if (found.empty())
      return fail(ErrorCode::kNotFound, source + ": no .relit file in this folder");
    std::ranges::sort(found);
    files.insert(files.end(), found.begin(), found.end());
  }
  return files;
}

Result<ValidationReport> examine(const std::string& file, const ValidateArguments& arguments) {
  RELIT_ASSIGN(auto source, open_source(file));
  ValidationOptions options;
  options.threads = arguments.threads;
  auto report = validate(std::move(source), options);
  if (!report) return fail(report.error().code, file + ": " + report.error().message);
  return report;
}

ordered_json to_json(const std::string& file, const ValidationReport& report, bool valid) {
  ordered_json findings = ordered_json::array();
  for (const Finding& finding : report.findings) {
    findings.push_back({{"id", finding.kind->id},
                        {"severity", severity_name(finding.kind->severity)},
                        {"offset", finding.offset_bytes},
                        {"message", finding.message},
                        {"record", finding.record.empty() ? ordered_json(nullptr)
                                                          : ordered_json(finding.record)}});
  }
  return {{"file", file},
          {"valid", valid},
          {"errors", report.errors},
          {"warnings", report.warnings},
          {"findings", findings}};
}

void print(const std::string& file, const ValidationReport& report) {
  for (const Finding& finding : report.findings) {
    const std::string record = finding.record.empty() ? "" : finding.record + ": ";
    std::printf("%s:%llu: %s %s: %s%s\n", file.c_str(),
                static_cast<unsigned long long>(finding.offset_bytes),
                severity_name(finding.kind->severity).data(), finding.kind->id.data(),
                record.c_str(), finding.message.c_str());
  }
  const std::uint64_t met = report.errors + report.warnings + report.infos;
  if (met > report.findings.size())
    std::printf("%s: %llu further findings of the same kinds are left out\n", file.c_str(),
                static_cast<unsigned long long>(met - report.findings.size()));
}

int run_validate(const ValidateArguments& arguments) {
  const auto files = expand(arguments.sources);
  if (!files) return report(files.error());
  Totals totals;
  ordered_json all = ordered_json::array();
  for (const std::string& file : *files) {
    const auto found = examine(file, arguments);
    ++totals.files;
    if (!found) {
      report(found.error());
      continue;
    }
    const bool valid = found->valid() && !(arguments.warnings_as_errors && found->warnings > 0);
    totals.valid += valid ? 1 : 0;
    totals.errors += found->errors, totals.warnings += found->warnings;
    if (arguments.json)
      all.push_back(to_json(file, *found, valid));
    else
      print(file, *found);
  }
  if (arguments.json) {
    std::printf("%s\n", ordered_json{{"files", all}}
                            .dump(2, ' ', false, ordered_json::error_handler_t::replace)
                            .c_str());
  } else {
    std::printf("%llu of %llu files valid; %llu errors, %llu warnings\n",
                static_cast<unsigned long long>(totals.valid),
                static_cast<unsigned long long>(totals.files),
                static_cast<unsigned long long>(totals.errors),
                static_cast<unsigned long long>(totals.warnings));
  }
  return totals.valid == totals.files ? kSuccess : kBadInput;
}

}  // namespace

void add_validate(CommandLine& line) {
  Options command = line.add(
      "validate", "check that files keep every rule of the format, and that all of them decodes");
  const auto arguments = std::make_shared<ValidateArguments>();
  command
      .add("files", arguments->sources, "paths, - or http(s)://; of a folder, all *.relit below it")
      .required();
  command.flag("--json", arguments->json, "as JSON, to standard output");
  command.flag("--warnings-as-errors", arguments->warnings_as_errors,
               "a file with warnings is not valid");
  command.add("--threads", arguments->threads, "of each decoder").range(1, 64);
  command.footer("container/VALIDATION.md lists what can be found.");
  command.runs([arguments] { return run_validate(*arguments); });
}

}  // namespace relit::player
