// SPDX-License-Identifier: MIT
// Each input goes to all readers of pictures; two of the three refuse it at its first bytes.
#include "src/io/images.h"

#include "firn/error.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/readers.h"

namespace firn::fuzz {
namespace {

template <class Read>
void read(const Read& reader, const std::string& path) {
  try {
    const auto image = reader(path);
    require(image.width > 0 && image.height > 0, "a picture has pixels");
    require(image.rgb.size() == std::size_t{3} * image.width * image.height,
            "a picture has three values a pixel");
  } catch (const Error&) {
  }
}

}  // namespace

void images(std::string_view input) {
  const MemoryFile file(input);
  read(read_png, file.path());
  read(read_ppm, file.path());
  read(read_pfm, file.path());
}

}  // namespace firn::fuzz
