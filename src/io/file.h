// SPDX-License-Identifier: MIT
// Whole files in and out. A file appears under its name only when it is complete: bytes go to a temporary
// name beside it, are flushed to the disk, then renamed. So a full disk, a crash or a power cut leaves the
// old file or none.
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace firn {

// Errors: io Error that names the path and the system's reason.
void write_file(const std::filesystem::path& path, std::string_view bytes);
// Where a file that a person named is to be written: what a link leads to. Errors: io Error for what is there
// and is no regular file, such as a device, which would be replaced.
std::filesystem::path replaceable(const std::filesystem::path& path);
void write_pieces(const std::filesystem::path& path, std::span<const std::string_view> pieces);  // one file
// Adds a line, which ends in '\n', to a file that is there, and flushes it to the disk.
// Several processes may do so: each line is whole, and begins anew after one that was cut off. Errors: io
// Error; a part of the line may be there then.
void append_line(const std::filesystem::path& path, std::string_view line);
// From byte `from` on. Errors: io Error; refuses what is no regular file: pipes, devices.
std::string read_file(const std::filesystem::path& path, std::size_t from = 0);
std::string read_standard_input(
    std::size_t most);  // to its end; io Error if there are more bytes than `most`

std::uint64_t hash_bytes(const void* bytes, std::size_t size);        // XXH3, 64 bits
std::uint64_t hash_pieces(std::span<const std::string_view> pieces);  // as of one array
std::string hex(std::uint64_t hash);                                  // 16 lower-case digits
std::string hash_in_hex(std::string_view bytes);

}  // namespace firn
