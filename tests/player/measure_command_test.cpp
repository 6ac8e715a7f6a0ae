// SPDX-License-Identifier: MIT
// `relit measure` as a user runs it: what it writes, and its exit statuses.
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/player/coded_file.hpp"
#include "tests/player/damage.hpp"
#include "tests/player/files.hpp"
#include "tests/test.hpp"

using namespace relit::player::test;

namespace {

void write_bytes(const std::string& path, const Bytes& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

const std::string kQuick = " --composite cpu --threads 1 --every 1 --repeats 1";

}  // namespace

TEST_CASE("measure prints a table and writes all that it was asked for") {
  const Folder folder;
  const std::string clip = folder.file("coded.relit");
  write_bytes(clip, coded_file());
  std::string says;
  REQUIRE(run_relit("measure " + clip + kQuick + " --csv " + folder.file("m.csv") + " --json " +
                        folder.file("m.json") + " --html " + folder.file("m.html"),
                    &says) == 0);
  INFO(says);
  CHECK(says.find("all planes") != std::string::npos);
  const auto json = nlohmann::json::parse(read_bytes(folder.file("m.json")));
  CHECK(json["schema"] == "relit-measure");
  CHECK(json["schema_version"] == 1);
  REQUIRE(json["points"].size() == 1);
  CHECK(json["points"][0]["file"] == clip);
  CHECK(json["points"][0]["on_bytes_front"] == true);
  CHECK(json["command"].size() > 3);
  CHECK(json["machine"]["cores"].get<int>() > 0);
  CHECK(read_bytes(folder.file("m.csv")).size() > 300);
  CHECK(read_bytes(folder.file("m.html")).size() > 5000);
}

TEST_CASE("measure scores what plays of a damaged file, and says what was lost") {
  const Folder folder;
  Bytes file = coded_file();
  const Read whole = read_all(file);
  REQUIRE(whole.segments.size() == 2);
  std::mt19937 random(1);
  // The end of the second segment: its planes.
  damage(file, {whole.segments[1].end - 40, whole.segments[1].end - 20}, random);
  const std::string clip = folder.file("damaged.relit"), good = folder.file("good.relit");
  write_bytes(clip, file);
  write_bytes(good, coded_file());
  std::string says;
  CHECK(run_relit("measure " + clip + " --reference " + good + kQuick, &says) == 3);
  INFO(says);
  CHECK(says.find("frames lost") != std::string::npos);
  CHECK(says.find("dB") != std::string::npos);
}

TEST_CASE("measure says what is wrong, and with which status") {
  const Folder folder;
  const std::string clip = folder.file("coded.relit");
  write_bytes(clip, coded_file());
  std::string says;
  CHECK(run_relit("measure " + folder.file("none.relit"), &says) == 1);
  CHECK(says.find("none.relit") != std::string::npos);
  CHECK(run_relit("measure " + clip + " --reference " + folder.file("none.npy")) == 1);
  CHECK(run_relit("measure " + clip + kQuick + " --csv " + folder.file("no/such/place.csv"),
                  &says) == 1);
  CHECK(says.find("place.csv") != std::string::npos);
  CHECK(run_relit("measure " + clip + " --planes none") == 2);
  CHECK(run_relit("measure " + clip + " --composite auto") == 2);
  CHECK(run_relit("measure " + clip + " --clip nobody") == 2);
  CHECK(run_relit("measure") == 2);
  // Nothing is left behind, and what was there stays.
  const std::string old = folder.file("old.csv");
  std::ofstream(old) << "old";
  CHECK(run_relit("measure " + clip + " --planes 99 --csv " + old) == 2);
  CHECK(read_bytes(old).size() == 3);
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path), {}) == 2);
}
