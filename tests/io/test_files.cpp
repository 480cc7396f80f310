// SPDX-License-Identifier: MIT
// Whole files: atomic writes, manifests, metrics.
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "firn/error.h"
#include "src/io/file.h"
#include "src/io/journal.h"
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
  m.scene_hash = hash_in_hex(m.scene);
  m.inputs = {{"/srv/hill.asc", "00aa"}};
  m.movie_hash = "0011";
  FrameRecord frame;
  frame.frame = 2;
  frame.simulate_seconds = 0.1;
  frame.rays = 1ull << 40;
  frame.mean_samples = 23.5;
  frame.snow_mass = 1.5;
  frame.medium_mass = 1.25;
  frame.metrics.momentum = {0.1, -1e-300, 3};
  frame.metrics.bounds_min = {-1, -2, -3};
  frame.metrics.bounds_max = {1, 2, 1.0 / 3};
  frame.metrics.step = {1e-4, "elastic wave \"packed\", 145 m/s"};
  frame.picture_hash = "0123456789abcdef";
  frame.files = {{"frames/0002.png", "00ff"}};
  m.frames = {frame};
  return m;
}

// A run folder as far as its manifest and the journal of its frames go.
struct Records {
  Scratch scratch;
  std::filesystem::path manifest = scratch / "run.json", journal = scratch / "frames.jsonl";
  explicit Records(const Manifest& m) {
    write_manifest(manifest, m);
    replace_journal(journal, m.key(), m.frames);
  }
  Manifest read() const { return read_manifest(manifest, journal); }
};

std::vector<int> frames_of(const Manifest& manifest) {
  std::vector<int> frames;
  for (const FrameRecord& record : manifest.frames) frames.push_back(record.frame);
  return frames;
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
      CHECK(error.code() == ErrorCode::io);
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
  const Manifest out = example();
  const Manifest in = Records(out).read();
  CHECK(in.status == out.status);
  CHECK(in.command == out.command);
  CHECK(in.seed == out.seed);
  CHECK(in.first == 2);
  CHECK(in.last == 5);
  CHECK(in.scene == out.scene);
  CHECK(in.inputs == out.inputs);
  CHECK(in.movie_hash == out.movie_hash);
  REQUIRE(in.frames.size() == 1);
  CHECK(in.frames[0].simulate_seconds == 0.1);
  CHECK(in.frames[0].rays == 1ull << 40);
  CHECK(in.frames[0].mean_samples == 23.5);
  CHECK(in.frames[0].snow_mass == 1.5);
  CHECK(in.frames[0].medium_mass == 1.25);
  CHECK(vec(in.frames[0].metrics.momentum) == vec(out.frames[0].metrics.momentum));
  CHECK(bounds_of(in.frames[0].metrics).max == bounds_of(out.frames[0].metrics).max);
  CHECK(in.frames[0].metrics.step.cause == out.frames[0].metrics.step.cause);
  CHECK(in.frames[0].files == out.frames[0].files);
}

TEST_CASE("A manifest of version 0.1 reads, with its frames: what it did not measure is 0") {
  const Records records(example());
  auto json = nlohmann::json::parse(read_file(records.manifest));
  auto frame = nlohmann::json::parse(encode_record(example().frames[0]));
  REQUIRE(frame.erase("medium_mass_kg") == 1);
  REQUIRE(frame.erase("picture_hash") == 1);
  frame["film_hash"] = "0123456789abcdef";
  json["frames"] = nlohmann::json::array({frame});  // braces alone: a copy for clang
  REQUIRE(json.erase("inputs") == 1);
  REQUIRE(json.erase("movie_hash") == 1);
  REQUIRE(json.erase("hash") == 1);
  json["version"] = "0.1.0";
  write_file(records.manifest, json.dump());
  std::filesystem::remove(records.journal);
  const Manifest in = records.read();
  CHECK(in.frames.at(0).medium_mass == 0);
  CHECK(in.frames.at(0).snow_mass == 1.5);
  CHECK(in.frames.at(0).picture_hash == "0123456789abcdef");
}

TEST_CASE("A manifest that is cut short or lacks a field is an io Error") {
  const Records records(example());
  const std::string whole = read_file(records.manifest);
  write_file(records.manifest, whole.substr(0, whole.size() / 2));
  CHECK_THROWS_AS(records.read(), Error);
  write_file(records.manifest, "{}");
  CHECK_THROWS_WITH(records.read(), contains("status"));
}

TEST_CASE("A manifest whose frames are no frames of its run, or whose scene was changed, is an io Error") {
  const auto reads = [&](const auto& change) {
    Manifest manifest = example();
    change(manifest);
    try {
      Records(manifest).read();
      return true;
    } catch (const Error& error) {
      CHECK(error.code() == ErrorCode::io);
      CHECK_THAT(error.what(), contains("damaged manifest"));
      return false;
    }
  };
  CHECK(reads([](Manifest&) {}));
  CHECK(reads([](Manifest& m) { m.frames.push_back(m.frames[0]), m.frames[1].frame = 5; }));
  CHECK_FALSE(reads([](Manifest& m) { m.frames[0].frame = 1; }));
  CHECK_FALSE(reads([](Manifest& m) { m.frames[0].frame = 6; }));
  CHECK_FALSE(reads([](Manifest& m) { m.first = -1; }));
  CHECK_FALSE(reads([](Manifest& m) { m.first = 6; }));
  CHECK_FALSE(reads([](Manifest& m) { m.last = 2147483647; }));
  CHECK_FALSE(reads([](Manifest& m) { m.scene += " "; }));
}

TEST_CASE("A manifest of which any byte was changed is an io Error") {
  const Records records(example());
  const std::string whole = read_file(records.manifest);
  for (std::size_t at = 0; at + 2 < whole.size(); at += 3) {
    std::string damaged = whole;
    damaged[at] = damaged[at] == '7' ? '8' : '7';
    write_file(records.manifest, damaged);
    INFO(at);
    CHECK_THROWS_AS(records.read(), Error);
  }
}

TEST_CASE("Frames added to a journal read back in their order, the later line of a frame") {
  const Records records(example());
  FrameRecord record = example().frames[0];
  for (const int frame : {4, 3, 5}) {
    record.frame = frame;
    append_journal(records.journal, example().key(), record);
  }
  record.frame = 3;
  record.rays = 17;
  append_journal(records.journal, example().key(), record);
  const Manifest in = records.read();
  CHECK(frames_of(in) == std::vector<int>{2, 3, 4, 5});
  CHECK(in.frames[1].rays == 17);
}

TEST_CASE("A line of a journal that was damaged, cut short or is of another run does not count") {
  Manifest manifest = example();
  manifest.frames.resize(3, manifest.frames[0]);
  for (int k = 0; k < 3; ++k) manifest.frames[static_cast<std::size_t>(k)].frame = 2 + k;
  const Records records(manifest);
  const std::string whole = read_file(records.journal);
  const std::size_t second = whole.find('\n') + 1, third = whole.find('\n', second) + 1;
  for (std::size_t at = second; at + 1 < third; ++at) {
    std::string damaged = whole;
    damaged[at] = damaged[at] == '7' ? '8' : '7';
    write_file(records.journal, damaged);
    INFO(at);
    REQUIRE(frames_of(records.read()) == std::vector<int>{2, 4});
  }
  for (std::size_t size = third; size < whole.size(); ++size) {
    write_file(records.journal, whole.substr(0, size));
    INFO(size);
    REQUIRE(frames_of(records.read()) == std::vector<int>{2, 3});
  }
  write_file(records.journal, std::string(1000, '\n') + whole.substr(second, third - second) + "{}\n\xff\n");
  CHECK(frames_of(records.read()) == std::vector<int>{3});
  manifest.started += "0";
  replace_journal(records.journal, manifest.key(), manifest.frames);
  CHECK(frames_of(records.read()).empty());
  std::filesystem::remove(records.journal);
  CHECK(frames_of(records.read()).empty());
}

TEST_CASE("A manifest and its frames are printed as one JSON object") {
  for (const bool frames : {false, true}) {
    Manifest manifest = example();
    if (!frames) manifest.frames.clear();
    std::ostringstream out;
    print_manifest(out, manifest);
    const auto json = nlohmann::json::parse(out.str());
    CHECK(json.at("scene") == manifest.scene);
    REQUIRE(json.at("frames").size() == manifest.frames.size());
    if (frames) CHECK(json.at("frames")[0].at("picture_hash") == "0123456789abcdef");
  }
}

TEST_CASE("The record of a frame goes through one line of JSON unchanged, and nothing else is one") {
  const FrameRecord out = example().frames[0];
  const std::string line = encode_record(out);
  CHECK(line.find('\n') == std::string::npos);
  const FrameRecord in = decode_record(line, "x");
  CHECK(encode_record(in) == line);
  CHECK(vec(in.metrics.momentum) == vec(out.metrics.momentum));
  CHECK_THROWS_WITH(decode_record(line.substr(1), "x.json"), contains("x.json"));
  CHECK_THROWS_AS(decode_record("[1, 2]", "x"), Error);
}

TEST_CASE("A record with a number that is not whole, or beyond its type, is refused by the name of its key") {
  auto json = nlohmann::ordered_json::parse(encode_record(example().frames[0]));
  const auto read_with = [&](const char* key, const nlohmann::ordered_json& value) {
    auto changed = json;
    changed[key] = value;
    return decode_record(changed.dump(), "x");
  };
  CHECK(read_with("frame", 2147483647).frame == 2147483647);
  CHECK(read_with("rays", 18446744073709551615u).rays == 18446744073709551615u);
  for (const auto& value : nlohmann::ordered_json::array(
           {1.5, 1e300, -1e300, 2147483648, -2147483649, 4294967296, 18446744073709551615u, "1", true}))
    CHECK_THROWS_WITH(read_with("frame", value), contains("x: not the record of a frame: frame"));
  for (const auto& value : nlohmann::ordered_json::array({-1, 2e19, -0.5}))
    CHECK_THROWS_WITH(read_with("rays", value), contains("rays"));
}

TEST_CASE("Pipes and devices are not read, and no read of one waits") {
  Scratch scratch;
  REQUIRE(::mkfifo((scratch / "pipe").c_str(), 0600) == 0);
  CHECK_THROWS_WITH(read_file(scratch / "pipe"), contains("pipe"));
  CHECK_THROWS_WITH(read_file("/dev/zero"), contains("device"));
  CHECK_THROWS_AS(read_file("/dev/null"), Error);
}

TEST_CASE("metrics.csv has a row a frame: those of the manifest first, whatever the file was") {
  Scratch scratch;
  Metrics metrics;
  metrics.bounds_min = metrics.bounds_max = {0.1, -1e-300, 1.0 / 3};
  metrics.step.cause = "elastic wave, 145 m/s";
  std::vector<FrameRecord> records;
  {
    MetricsCsv csv(scratch / "metrics.csv");
    for (int frame = 0; frame < 5; ++frame) {
      metrics.time = frame / 24.;
      csv.add(frame, metrics);
      records.emplace_back().frame = frame;
      records.back().metrics = metrics;
    }
    CHECK_THAT(read_file(scratch / "metrics.csv"), contains("\n4,"));  // on disk before it is closed
  }
  const std::string whole = read_file(scratch / "metrics.csv");
  const auto commas = [](const std::string& line) { return std::count(line.begin(), line.end(), ','); };
  std::istringstream in(whole);
  std::string header, row;
  std::getline(in, header);
  for (int frame = 0; frame < 5; ++frame) {
    REQUIRE(std::getline(in, row));
    CHECK(std::stoi(row) == frame);
    CHECK(commas(row) == commas(header) + 1);  // one comma stands inside the quoted cause
  }
  for (const std::string& damaged :
       {std::string(), whole.substr(0, whole.size() - 9), "frame\nrubbish\n" + whole, whole + row}) {
    write_file(scratch / "metrics.csv", damaged);
    MetricsCsv csv(scratch / "metrics.csv");
    csv.replace({records.begin(), records.begin() + 3});
    csv.add(3, records[3].metrics);
    csv.add(4, records[4].metrics);
    CHECK(read_file(scratch / "metrics.csv") == whole);
  }
}

TEST_CASE("metrics.csv names the colliders whose forces it tells, and the plastic work") {
  Scratch scratch;
  Metrics metrics;
  metrics.plastic_work = 2.5;
  metrics.contacts = {{"ground", {1, -2, 0.5}}, {"plate, \"left\"", {0, 4, 0}}};
  MetricsCsv(scratch / "metrics.csv").add(0, metrics);
  const std::string text = read_file(scratch / "metrics.csv");
  CHECK_THAT(text, contains(",plastic_work_J,"));
  CHECK_THAT(text, contains(",dt_cause,force_x_N[ground],force_y_N[ground],force_z_N[ground],"
                            "\"force_x_N[plate, \"\"left\"\"]\","));
  CHECK_THAT(text, contains(",2.5,"));
  CHECK_THAT(text, contains(",1,-2,0.5,0,4,0\n"));
}

TEST_CASE("the manifest keeps the forces of the colliders") {
  Manifest manifest;
  manifest.scene_hash = hash_in_hex("");
  manifest.frames.resize(1);
  manifest.frames[0].metrics.contacts = {{"ground", {1, -2, 0.5}, {0.1, 0, -3}}};
  manifest.frames[0].metrics.plastic_work = 0.25;
  const Metrics m = Records(manifest).read().frames.at(0).metrics;
  REQUIRE(m.contacts.size() == 1);
  CHECK(m.contacts[0].collider == "ground");
  CHECK(m.contacts[0].force == Vector3{1, -2, 0.5});
  CHECK(m.contacts[0].torque == Vector3{0.1, 0, -3});
  CHECK(m.plastic_work == 0.25);
}

TEST_CASE("Lines that several writers add to a journal at a time are all whole") {
  const Manifest manifest = example();
  const Records records(manifest);
  JournalTail tail(records.journal, manifest.key());
  CHECK(tail.read().size() == 1);
  CHECK(tail.read().empty());
  std::vector<std::thread> writers;
  writers.reserve(4);
  for (int writer = 0; writer < 4; ++writer) {
    writers.emplace_back([&, writer] {
      for (int i = 0; i < 25; ++i) {
        FrameRecord record = manifest.frames[0];
        record.frame = 10 + 4 * i + writer;
        record.metrics.step.cause = std::string(5000, 'x');  // longer than a pipe would keep whole
        append_journal(records.journal, manifest.key(), record);
      }
    });
  }
  std::size_t seen = 0;
  for (int looks = 0; looks < 10'000 && seen < 100; ++looks) seen += tail.read().size();
  for (std::thread& writer : writers) writer.join();
  seen += tail.read().size();
  CHECK(seen == 100);
  CHECK(read_journal(records.journal, manifest.key()).size() == 101);
}

TEST_CASE("After a line that was cut off the next one begins anew") {
  const Manifest manifest = example();
  const Records records(manifest);
  const std::string whole = read_file(records.journal);
  for (std::size_t size = 0; size <= whole.size(); size += 31) {
    write_file(records.journal, whole + whole.substr(0, size));
    JournalTail tail(records.journal, manifest.key());
    tail.read();
    FrameRecord record = manifest.frames[0];
    record.frame = 3;
    append_journal(records.journal, manifest.key(), record);
    const auto added = tail.read();
    REQUIRE(!added.empty());
    CHECK(added.back().frame == 3);
    CHECK(frames_of(records.read()) == std::vector<int>{2, 3});
  }
}
