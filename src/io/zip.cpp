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

namespace {

constexpr std::uint16_t kVersion64 = 45, kSizes64 = 1;  // a reader that knows ZIP64; the field of its sizes

// What a member's own header and that in the directory have in common: all sizes in a ZIP64 field.
std::string member_facts(const std::string& name, std::uint64_t size, std::uint32_t crc,
                         std::uint16_t extra) {
  std::string facts;
  put(facts, kVersion64);
  put(facts, std::uint16_t{0});  // flags
  put(facts, kStored);
  put(facts, std::uint32_t{0x00210000});  // 1 January 1980, 0:00
  put(facts, crc);
  put(facts, size < kElsewhere ? static_cast<std::uint32_t>(size) : kElsewhere);
  put(facts, size < kElsewhere ? static_cast<std::uint32_t>(size) : kElsewhere);
  put(facts, static_cast<std::uint16_t>(name.size()));
  put(facts, extra);
  return facts;
}

std::string local_header(const std::string& name, std::uint64_t size, std::uint32_t crc) {
  const bool large = size >= kElsewhere;
  std::string header;
  put(header, kMemberMark);
  header += member_facts(name, size, crc, large ? 20 : 0) + name;
  if (large) {
    put(header, kSizes64);
    put(header, std::uint16_t{16});
    put(header, size);
    put(header, size);
  }
  return header;
}

std::string directory_header(const std::string& name, std::uint64_t size, std::uint32_t crc,
                             std::uint64_t start) {
  const bool large = size >= kElsewhere, far = start >= kElsewhere;
  const auto bytes = static_cast<std::uint16_t>((large ? 16 : 0) + (far ? 8 : 0));
  std::string header;
  put(header, kDirectoryMark);
  put(header, kVersion64);
  header += member_facts(name, size, crc, static_cast<std::uint16_t>(bytes > 0 ? bytes + 4 : 0));
  put(header, std::uint16_t{0});  // bytes of the comment
  put(header, std::uint16_t{0});  // disk
  put(header, std::uint16_t{0});  // internal attributes
  put(header, std::uint32_t{0});  // external ones
  put(header, far ? kElsewhere : static_cast<std::uint32_t>(start));
  header += name;
  if (bytes > 0) {
    put(header, kSizes64);
    put(header, bytes);
  }
  for (int k = 0; large && k < 2; ++k) put(header, size);
  if (far) put(header, start);
  return header;
}

// The records that end an archive, with those of ZIP64, which say what the others cannot.
std::string end_records(std::uint64_t members, std::uint64_t start, std::uint64_t bytes) {
  std::string end;
  put(end, kEnd64Mark);
  put(end, std::uint64_t{44});  // bytes of this record that follow
  put(end, kVersion64);
  put(end, kVersion64);
  put(end, std::uint32_t{0});
  put(end, std::uint32_t{0});
  for (const std::uint64_t fact : {members, members, bytes, start}) put(end, fact);
  put(end, kLocator64Mark);
  put(end, std::uint32_t{0});
  put(end, start + bytes);
  put(end, std::uint32_t{1});
  put(end, kEndMark);
  put(end, std::uint32_t{0});
  put(end, std::uint16_t{0xffff});
  put(end, std::uint16_t{0xffff});
  put(end, kElsewhere);
  put(end, kElsewhere);
  put(end, std::uint16_t{0});
  return end;
}

}  // namespace

std::string zip(const std::vector<std::pair<std::string, std::string>>& files) {
  std::string archive, directory;
  for (const auto& [name, bytes] : files) {
    const auto crc =
        static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
    directory += directory_header(name, bytes.size(), crc, archive.size());
    archive += local_header(name, bytes.size(), crc);
    archive += bytes;
  }
  const std::uint64_t start = archive.size();
  archive += directory;
  return archive + end_records(files.size(), start, directory.size());
}

}  // namespace firn
