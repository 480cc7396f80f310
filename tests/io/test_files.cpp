// SPDX-License-Identifier: MIT
// Whole files: atomic writes, manifests, metrics.
#include <signal.h>
#include <sys/resource.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "src/core/error.h"
#include "src/io/file.h"
#include "src/io/manifest.h"
#include "src/io/metrics_csv.h"
#include "tests/catch.h"
#include "tests/io/scratch.h"

using namespace firn;

namespace {

std::size_t entries(const std::filesystem::path& folder) {
  const std::filesystem::directory_iterator all(folder);
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

// Files of this process may not grow beyond `bytes` while it lives: a full disk that needs no disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    old_signal_ = ::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &old_);
    const rlimit small{bytes, old_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &old_);
    ::signal(SIGXFSZ, old_signal_);
  }

 private:
  rlimit old_{};
  void (*old_signal_)(int);
};

Manifest example() {
  Manifest m;
  m.status = "complete";
  m.command = "firn run 'a b.toml'";
  m.isa = "x86-64-v3";
  m.threads = 3;
  m.seed = 0xffffffffffffffffull;
  m.first = 2;
  m.last = 5;
  m.scene = "[camera]\nfov = 35\n";
  FrameRecord frame;
  frame.frame = 2;
  frame.simulate_seconds = 0.1;
  frame.rays = 1ull << 40;
  frame.mean_samples = 23.5;
  frame.snow_mass = 1.5;
  frame.medium_mass = 1.25;
  frame.metrics.momentum = Vec3(0.1, -1e-300, 3);
  frame.metrics.bounds = {Vec3(-1, -2, -3), Vec3(1, 2, 1.0 / 3)};
  frame.metrics.step = {1e-4, "elastic wave \"packed\", 145 m/s"};
  frame.film_hash = "0123456789abcdef";
  frame.files = {{"frames/0002.png", "00ff"}};
  m.frames = {frame};
  return m;
}

}  // namespace

TEST_CASE("A written file reads back byte for byte and leaves no other file behind") {
  Scratch scratch;
  std::string bytes("a\0b\n\xff", 5);
  write_file(scratch / "x", bytes);
  write_file(scratch / "x", bytes + bytes);
  CHECK(read_file(scratch / "x") == bytes + bytes);
  CHECK(entries(scratch.path()) == 1);
}

TEST_CASE("On a full disk the old file stays, nothing half-written remains and the error names the path") {
  Scratch scratch;
  write_file(scratch / "x", "old");
  {
    const FullDisk full(1000);
    try {
      write_file(scratch / "x", std::string(5000, 'n'));
      FAIL("no error");
    } catch (const Error& error) {
      CHECK(error.code() == ExitCode::io);
      CHECK(error.where() == (scratch / "x").string());
    }
  }
  CHECK(read_file(scratch / "x") == "old");
  CHECK(entries(scratch.path()) == 1);
}

TEST_CASE("Reading a missing file or a folder is an io Error that names it") {
  Scratch scratch;
  CHECK_THROWS_WITH(read_file(scratch / "none"), contains("none") && contains("No such file"));
  CHECK_THROWS_AS(read_file(scratch.path()), Error);
}

TEST_CASE("A manifest reads back to what was written, to the last bit of its numbers") {
  Scratch scratch;
  const Manifest out = example();
  write_manifest(scratch / "run.json", out);
  const Manifest in = read_manifest(scratch / "run.json");
  CHECK(in.status == out.status);
  CHECK(in.command == out.command);
  CHECK(in.seed == out.seed);
  CHECK(in.first == 2);
  CHECK(in.last == 5);
  CHECK(in.scene == out.scene);
  REQUIRE(in.frames.size() == 1);
  CHECK(in.frames[0].simulate_seconds == 0.1);
  CHECK(in.frames[0].rays == 1ull << 40);
  CHECK(in.frames[0].mean_samples == 23.5);
  CHECK(in.frames[0].snow_mass == 1.5);
  CHECK(in.frames[0].medium_mass == 1.25);
  CHECK(in.frames[0].metrics.momentum == out.frames[0].metrics.momentum);
  CHECK(in.frames[0].metrics.bounds.max == out.frames[0].metrics.bounds.max);
  CHECK(in.frames[0].metrics.step.cause == out.frames[0].metrics.step.cause);
  CHECK(in.frames[0].files == out.frames[0].files);
}

TEST_CASE("A manifest of a version that measured less reads: what it lacks is 0") {
  Scratch scratch;
  write_manifest(scratch / "run.json", example());
  auto json = nlohmann::json::parse(read_file(scratch / "run.json"));
  REQUIRE(json["frames"][0].erase("medium_mass_kg") == 1);
  write_file(scratch / "run.json", json.dump());
  const Manifest in = read_manifest(scratch / "run.json");
  CHECK(in.frames.at(0).medium_mass == 0);
  CHECK(in.frames.at(0).snow_mass == 1.5);
}

TEST_CASE("A manifest that is cut short or lacks a field is an io Error") {
  Scratch scratch;
  write_manifest(scratch / "run.json", example());
  const std::string whole = read_file(scratch / "run.json");
  write_file(scratch / "run.json", whole.substr(0, whole.size() / 2));
  CHECK_THROWS_AS(read_manifest(scratch / "run.json"), Error);
  write_file(scratch / "run.json", "{}");
  CHECK_THROWS_WITH(read_manifest(scratch / "run.json"), contains("status"));
}

TEST_CASE("metrics.csv keeps the rows before the frame that a run resumes at and drops the others") {
  Scratch scratch;
  Metrics metrics;
  metrics.bounds.include(Vec3::Zero());
  metrics.step.cause = "elastic wave, 145 m/s";
  {
    MetricsCsv csv(scratch / "metrics.csv", 0);
    for (int frame = 0; frame < 5; ++frame) csv.add(frame, metrics);
    CHECK_THAT(read_file(scratch / "metrics.csv"), contains("\n4,"));  // on disk before it is closed
  }
  MetricsCsv csv(scratch / "metrics.csv", 3);
  csv.add(3, metrics);
  std::istringstream in(read_file(scratch / "metrics.csv"));
  std::string header, row;
  std::getline(in, header);
  const auto commas = [](const std::string& line) { return std::count(line.begin(), line.end(), ','); };
  for (int frame = 0; frame < 4; ++frame) {
    REQUIRE(std::getline(in, row));
    CHECK(std::stoi(row) == frame);
    CHECK(commas(row) == commas(header) + 1);  // one comma stands inside the quoted cause
  }
  CHECK_FALSE(std::getline(in, row));
}

TEST_CASE("metrics.csv names the colliders whose forces it tells, and the plastic work") {
  Scratch scratch;
  Metrics metrics;
  metrics.plastic_work = 2.5;
  metrics.contacts = {{"ground", Vec3(1, -2, 0.5)}, {"plate, \"left\"", Vec3(0, 4, 0)}};
  MetricsCsv(scratch / "metrics.csv", 0).add(0, metrics);
  const std::string text = read_file(scratch / "metrics.csv");
  CHECK_THAT(text, contains(",plastic_work_J,"));
  CHECK_THAT(text, contains(",dt_cause,force_x_N[ground],force_y_N[ground],force_z_N[ground],"
                            "\"force_x_N[plate, \"\"left\"\"]\","));
  CHECK_THAT(text, contains(",2.5,"));
  CHECK_THAT(text, contains(",1,-2,0.5,0,4,0\n"));
}

TEST_CASE("the manifest keeps the forces of the colliders") {
  Scratch scratch;
  Manifest manifest;
  manifest.frames.resize(1);
  manifest.frames[0].metrics.contacts = {{"ground", Vec3(1, -2, 0.5)}};
  manifest.frames[0].metrics.plastic_work = 0.25;
  write_manifest(scratch / "run.json", manifest);
  const Metrics m = read_manifest(scratch / "run.json").frames.at(0).metrics;
  REQUIRE(m.contacts.size() == 1);
  CHECK(m.contacts[0].collider == "ground");
  CHECK(m.contacts[0].force == Vec3(1, -2, 0.5));
  CHECK(m.plastic_work == 0.25);
}
