// SPDX-License-Identifier: MIT
// Offsets and records are those of PKWARE's APPNOTE 6.3.10, sections 4.3 and 4.5.3. The only file that knows
// zlib.
#include "src/io/zip.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <optional>

#include "firn/error.h"
#include "src/core/memory.h"
#include "src/io/byte_stream.h"

namespace firn {
namespace {

constexpr std::uint32_t kMemberMark = 0x04034b50, kDirectoryMark = 0x02014b50, kEndMark = 0x06054b50,
                        kEnd64Mark = 0x06064b50, kLocator64Mark = 0x07064b50;
constexpr std::size_t kEndBytes = 22, kLocator64Bytes = 20, kLongestComment = 65535;
constexpr std::uint32_t kElsewhere = 0xffffffff;  // a size or a place that a ZIP64 record tells
constexpr std::uint16_t kStored = 0, kDeflated = 8, kEncrypted = 1;
constexpr std::uint64_t kMostOutOfOne = 1032;    // bytes that deflate can make of one
constexpr std::uint64_t kMostAtOnce = 1u << 30;  // bytes that zlib is given in one call

[[noreturn]] void refuse_zip(const std::string& where, const std::string& what) {
  throw Error(ErrorCode::io, where, what);
}

// A reader that stands at byte `from` of the archive.
ByteReader reader_at(std::string_view archive, std::uint64_t from, const std::string& where) {
  if (from > archive.size()) refuse_zip(where, "damaged ZIP archive: it ends too early");
  return {archive.substr(from), where};
}

std::size_t find_end(std::string_view archive, const std::string& where) {
  const std::size_t size = archive.size();
  for (std::size_t back = kEndBytes; back <= std::min(size, kEndBytes + kLongestComment); ++back) {
    ByteReader in(archive.substr(size - back), where);
    if (in.get<std::uint32_t>() != kEndMark) continue;
    in.take(kEndBytes - 6);
    if (in.get<std::uint16_t>() == in.left()) return size - back;  // the comment reaches the end
  }
  refuse_zip(where, "damaged ZIP archive: it has no directory, so it was cut off or is none");
}

struct Directory {
  std::uint64_t start, bytes, members;
};

std::optional<Directory> find_directory64(std::string_view archive, std::size_t end,
                                          const std::string& where) {
  if (end < kLocator64Bytes) return std::nullopt;
  ByteReader locator = reader_at(archive, end - kLocator64Bytes, where);
  if (locator.get<std::uint32_t>() != kLocator64Mark) return std::nullopt;
  locator.take(4);
  ByteReader in = reader_at(archive, locator.get<std::uint64_t>(), where);
  if (in.get<std::uint32_t>() != kEnd64Mark) refuse_zip(where, "damaged ZIP archive: no ZIP64 directory");
  in.take(8 + 2 + 2 + 4 + 4 + 8);  // its size, versions, disks, members on this disk
  Directory directory{};
  directory.members = in.get<std::uint64_t>();
  directory.bytes = in.get<std::uint64_t>();
  directory.start = in.get<std::uint64_t>();
  return directory;
}

Directory find_directory(std::string_view archive, const std::string& where) {
  const std::size_t end = find_end(archive, where);
  if (const auto directory = find_directory64(archive, end, where)) return *directory;
  ByteReader in = reader_at(archive, end, where);
  in.take(4 + 2 + 2 + 2);
  Directory directory{};
  directory.members = in.get<std::uint16_t>();
  directory.bytes = in.get<std::uint32_t>();
  directory.start = in.get<std::uint32_t>();
  return directory;
}

// The ZIP64 field holds, in this order, those of the sizes and of the place that have no room of their own.
void read_extra(std::string_view extra, ZipMember& member, const std::string& where) {
  for (ByteReader in(extra, where); in.left() >= 4;) {
    const auto kind = in.get<std::uint16_t>();
    const std::size_t bytes = in.get<std::uint16_t>();
    ByteReader sizes(in.take(std::min(bytes, in.left())), where);
    if (kind != 1) continue;
    for (std::uint64_t* value : {&member.size, &member.packed, &member.start}) {
      if (*value == kElsewhere) *value = sizes.get<std::uint64_t>();
    }
  }
}

ZipMember read_member(ByteReader& in, const std::string& where) {
  if (in.get<std::uint32_t>() != kDirectoryMark)
    refuse_zip(where, "damaged ZIP archive: its directory breaks off");
  ZipMember member;
  in.take(4);
  member.flags = in.get<std::uint16_t>();
  member.method = in.get<std::uint16_t>();
  in.take(4);
  member.crc = in.get<std::uint32_t>();
  member.packed = in.get<std::uint32_t>();
  member.size = in.get<std::uint32_t>();
  const auto name = in.get<std::uint16_t>(), extra = in.get<std::uint16_t>(),
             comment = in.get<std::uint16_t>();
  in.take(8);
  member.start = in.get<std::uint32_t>();
  member.name = in.take(name);
  read_extra(in.take(extra), member, where);
  in.take(comment);
  return member;
}

std::string_view packed_bytes(std::string_view archive, const ZipMember& member, const std::string& where) {
  ByteReader in = reader_at(archive, member.start, where);
  if (in.get<std::uint32_t>() != kMemberMark)
    refuse_zip(where, "damaged ZIP archive: '" + member.name + "' is not where its directory says");
  in.take(22);
  const auto name = in.get<std::uint16_t>(), extra = in.get<std::uint16_t>();
  in.take(std::size_t{name} + extra);
  return in.take(member.packed);
}

// Ends the inflation, whatever comes.
struct Inflation {
  z_stream stream{};
  Inflation() {
    if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
  }
  ~Inflation() { inflateEnd(&stream); }
  Inflation(const Inflation&) = delete;
  Inflation& operator=(const Inflation&) = delete;
};

// Whether `packed` is the deflation of exactly as many bytes as `out` has room for; they are in it then.
bool inflate_into(std::string_view packed, std::string& out) {
  Inflation inflation;
  z_stream& s = inflation.stream;
  std::uint64_t taken = 0, made = 0;
  char spare = 0;  // zlib wants room for the end of the stream, too
  for (int state = Z_OK; state == Z_OK;) {
    const auto give = static_cast<uInt>(std::min(kMostAtOnce, packed.size() - taken));
    const std::uint64_t left = out.size() - made;
    const auto room = static_cast<uInt>(left ? std::min(kMostAtOnce, left) : 1);
    s.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data() + taken));
    s.avail_in = give;
    s.next_out = reinterpret_cast<Bytef*>(left ? out.data() + made : &spare);
    s.avail_out = room;
    state = inflate(&s, Z_NO_FLUSH);
    taken += give - s.avail_in;
    made += room - s.avail_out;
    if (made > out.size()) return false;
    if (state == Z_STREAM_END) return made == out.size();
  }
  return false;
}

}  // namespace

std::vector<ZipMember> zip_members(std::string_view archive, const std::string& where) {
  const Directory directory = find_directory(archive, where);
  ByteReader in = reader_at(archive, directory.start, where);
  in = ByteReader(in.take(directory.bytes), where);
  std::vector<ZipMember> members;
  for (std::uint64_t k = 0; k < directory.members; ++k) members.push_back(read_member(in, where));
  return members;
}

std::string unzip(std::string_view archive, const ZipMember& member, const std::string& where) {
  const std::string name = "'" + member.name + "'";
  if (member.flags & kEncrypted) refuse_zip(where, name + " is encrypted");
  if (member.method != kStored && member.method != kDeflated)
    refuse_zip(where, name + " is packed with method " + std::to_string(member.method) +
                          ": stored and deflated members are read, as numpy writes them");
  const std::string_view packed = packed_bytes(archive, member, where);
  const bool possible =
      member.method == kStored ? member.size == packed.size() : member.size / kMostOutOfOne <= packed.size();
  if (!possible || member.size > machine_memory() / 2)
    refuse_zip(where, "damaged ZIP archive: " + name + " cannot have " + std::to_string(member.size) +
                          " bytes, packed in " + std::to_string(packed.size()));
  std::string bytes;
  if (member.method == kStored) {
    bytes = packed;
  } else {
    bytes.resize(member.size);
    if (!inflate_into(packed, bytes))
      refuse_zip(where, "damaged ZIP archive: " + name + " cannot be unpacked");
  }
  if (crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()) != member.crc)
    refuse_zip(where, "damaged ZIP archive: wrong checksum of " + name);
  return bytes;
}

}  // namespace firn
