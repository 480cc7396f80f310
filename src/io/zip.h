// SPDX-License-Identifier: MIT
// ZIP archives as numpy writes them: stored or deflated members, ZIP64 sizes. The sizes are those of the
// archive's directory, so it does not matter whether the members tell their own before or after them.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace firn {

struct ZipMember {
  std::string name;
  std::uint64_t start = 0;   // byte of the archive at which its own header begins
  std::uint64_t packed = 0;  // bytes in the archive
  std::uint64_t size = 0;    // bytes
  std::uint32_t crc = 0;
  std::uint16_t method = 0;
  std::uint16_t flags = 0;
};

// `where` names the archive in errors: io Error for what is no archive, or a damaged one.
std::vector<ZipMember> zip_members(std::string_view archive, const std::string& where);

// The bytes of a member; they have the size and the checksum that the directory tells. A size that so few
// packed bytes cannot have is refused before any room is taken. Errors: io Error.
std::string unzip(std::string_view archive, const ZipMember& member, const std::string& where);

// An archive with these files in it, names and bytes, as they are: nothing is deflated.
std::string zip(const std::vector<std::pair<std::string, std::string>>& files);

}  // namespace firn
