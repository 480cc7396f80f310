// SPDX-License-Identifier: MIT
// A Snapshot on disk, read back bit for bit: `firn simulate` keeps them, `firn render RUN` shows them,
// checkpoints hold those that were not shown yet. Little-endian, no padding:
//
//   offset  bytes  content
//   0       8      "FIRNSNAP"
//   8       4      u32 version: 2, or 3 where colliders are driven by a program
//   12      4      i32 frame
//   16      8      f64 time (s)
//   24      24     f64 x 3 origin (m, world)
//   48      8      f64 dx (m)
//   56      8      u64 n, number of particles
//   64      8      u64 XXH3 of bytes 0..63 followed by the columns
//   72      44 n   columns: f32 x y z (m from the origin), f32 vx vy vz (m/s), f32 density (kg/m^3),
//                  f32 volume0 (m^3), i16 x 3 rotation (axis tan(angle / 4), in 1/32767), u32 id, u16 object;
//                  each n entries, one after another
//
// In version 3 there follow, for each driven collider, u32 bytes of its name, the name, and f64 x 26: time
// (s), position (m), rotation (row by row), velocity (m/s), angular velocity (rad/s), length of its last step
// (s), force (N), torque (N m), as in firn/driver.h; the end of the file is the end of the list.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "firn/snapshot.h"

namespace firn {

std::string encode_snapshot(const Snapshot& snapshot);
// `where` names the source in errors: io Error for another format or version, a wrong length or checksum.
Snapshot decode_snapshot(std::string_view bytes, const std::string& where);

void write_particle_file(const std::filesystem::path& path, const Snapshot& snapshot);
Snapshot read_particle_file(const std::filesystem::path& path);

}  // namespace firn
