// SPDX-License-Identifier: MIT
// Particle files and checkpoints come back bit for bit, or not at all.
#include <cstring>
#include <limits>

#include "firn/error.h"
#include "src/core/rng.h"
#include "src/io/checkpoint.h"
#include "src/io/file.h"
#include "src/io/particle_file.h"
#include "src/particles/snapshot.h"
#include "tests/catch.h"
#include "tests/io/scratch.h"

using namespace firn;

namespace {

Snapshot random_snapshot(std::size_t count, int frame) {
  Snapshot s;
  s.frame = frame;
  s.time = frame / 24.0;
  s.origin = {100, -0.1, 1e-9};
  s.dx = 0.01;
  s.resize(count);
  std::uint64_t key = static_cast<std::uint64_t>(frame);
  for_each_stored_column(s, [&](auto column) {
    using Value = std::decay_t<decltype(column[0])>;
    for (auto& value : column) {
      const auto bits = static_cast<std::uint32_t>(hash_keys(3, ++key));
      std::memcpy(&value, &bits, sizeof(Value));  // any bits at all, NaN and denormals included
    }
  });
  return s;
}

DrivenCollider random_collider(const std::string& name) {
  DrivenCollider c;
  c.name = name;
  double next = static_cast<double>(name.size());
  c.time = ++next;
  c.dt = ++next;
  for (auto* v : {&c.position, &c.velocity, &c.angular_velocity, &c.force, &c.torque}) {
    for (double& x : *v) x = 1 / ++next;
  }
  for (double& x : c.rotation) x = 1 / ++next;
  return c;
}

bool same(const Snapshot& a, const Snapshot& b) {
  if (a.frame != b.frame || a.time != b.time || a.origin != b.origin || a.dx != b.dx) return false;
  return encode_snapshot(a) == encode_snapshot(b);
}

// A frame that was simulated, but not written.
PendingFrame pending(int frame) {
  FrameRecord record;
  record.frame = frame;
  record.simulate_seconds = 0.1 * frame;
  return {record, random_snapshot(10, frame)};
}

}  // namespace

TEST_CASE("A particle file reads back bit for bit") {
  Scratch scratch;
  for (const std::size_t count : {0, 1, 1003}) {
    const Snapshot out = random_snapshot(count, 5);
    write_particle_file(scratch / "p.firn", out);
    Snapshot in = read_particle_file(scratch / "p.firn");
    REQUIRE(in.size() == count);
    CHECK(same(in, out));
    CHECK((count == 0 || std::memcmp(in.position[2].data(), out.position[2].data(), 4 * count) == 0));
    CHECK(in.object == out.object);
  }
}

TEST_CASE("A particle file has the driven colliders of its time") {
  for (const std::size_t count : {0, 1, 103}) {
    for (const std::size_t names : {1, 2, 40}) {
      Snapshot out = random_snapshot(count, 2);
      const std::string without = encode_snapshot(out);
      for (std::size_t k = 0; k < names; ++k)
        out.driven.push_back(random_collider(std::string(k, 'x') + "\xc3\xa9"));
      const std::string bytes = encode_snapshot(out);
      const Snapshot in = decode_snapshot(bytes, "p.firn");
      REQUIRE(in.driven.size() == names);
      for (std::size_t k = 0; k < names; ++k) CHECK(in.driven[k] == out.driven[k]);
      CHECK(encode_snapshot(in) == bytes);
      for (std::size_t at = 0; at < bytes.size(); at += 31) {
        std::string damaged = bytes;
        damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
        REQUIRE_THROWS_AS(decode_snapshot(damaged, "p.firn"), Error);
        REQUIRE_THROWS_AS(decode_snapshot(bytes.substr(0, at), "p.firn"), Error);
      }
      out.driven.clear();
      CHECK(encode_snapshot(out) == without);
      out.driven.push_back(random_collider("a"));
      out.driven[0].force[1] = std::numeric_limits<double>::infinity();
      CHECK_THROWS_WITH(decode_snapshot(encode_snapshot(out), "p.firn"), contains("p.firn"));
    }
  }
}

TEST_CASE("A particle file with any byte changed, or of any other length, is an io Error") {
  const std::string whole = encode_snapshot(random_snapshot(50, 1));
  for (std::size_t at = 0; at < whole.size(); at += 13) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    REQUIRE_THROWS_AS(decode_snapshot(damaged, "p.firn"), Error);
    REQUIRE_THROWS_AS(decode_snapshot(whole.substr(0, at), "p.firn"), Error);
  }
  CHECK_THROWS_WITH(decode_snapshot(whole + "x", "p.firn"), contains("p.firn"));
}

TEST_CASE("A checkpoint comes back with its state and its pending frames") {
  Scratch scratch;
  Checkpoint out{42, 7, 1ull << 50, {pending(6), pending(7)}, std::string("sta\0te", 6)};
  write_checkpoint(scratch / "c", out);
  const Checkpoint in = read_checkpoint(scratch / "c", 42);
  CHECK(in.frame == 7);
  CHECK(in.particle_steps == 1ull << 50);
  CHECK(in.state == out.state);
  REQUIRE(in.pending.size() == 2);
  for (int i = 0; i < 2; ++i) {
    CHECK(same(in.pending[i].snow, out.pending[i].snow));
    CHECK(encode_record(in.pending[i].record) == encode_record(out.pending[i].record));
  }
}

TEST_CASE("A checkpoint whose pending frames do not ascend, come twice or are ahead of it is an io Error") {
  Scratch scratch;
  const auto reads = [&](std::vector<PendingFrame> frames) {
    write_checkpoint(scratch / "c", {42, 7, 9, std::move(frames), "state"});
    try {
      return read_checkpoint(scratch / "c", 42).frame == 7;
    } catch (const Error& error) {
      CHECK_THAT(error.what(), contains("pending frames"));
      return false;
    }
  };
  CHECK(reads({}));
  CHECK(reads({pending(5), pending(7)}));
  CHECK_FALSE(reads({pending(7), pending(7)}));
  CHECK_FALSE(reads({pending(7), pending(6)}));
  CHECK_FALSE(reads({pending(8)}));
  CHECK_FALSE(reads({pending(-1)}));
  CHECK_FALSE(reads({{pending(6).record, pending(7).snow}}));
}

TEST_CASE("A checkpoint of another scene, a damaged or a cut one is an io Error") {
  Scratch scratch;
  write_checkpoint(scratch / "c", {42, 7, 9, {pending(7)}, "state"});
  CHECK_THROWS_WITH(read_checkpoint(scratch / "c", 43), contains("another scene"));
  const std::string whole = read_file(scratch / "c");
  for (const std::size_t length : {std::size_t{0}, std::size_t{4}, std::size_t{9}, whole.size() - 1}) {
    write_file(scratch / "c", whole.substr(0, length));
    CHECK_THROWS_AS(read_checkpoint(scratch / "c", 42), Error);
  }
  for (std::size_t at = 0; at < whole.size(); at += 17) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 1);
    write_file(scratch / "c", damaged);
    REQUIRE_THROWS_AS(read_checkpoint(scratch / "c", 42), Error);
  }
}
