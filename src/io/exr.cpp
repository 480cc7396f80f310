// SPDX-License-Identifier: MIT
#include "src/io/exr.h"

#include "build_facts.h"
#include "firn/error.h"

#if FIRN_OPENEXR
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>

#include <exception>
#include <vector>
#endif

namespace firn {

#if FIRN_OPENEXR

namespace {

// The last part of a channel's name, by the layer that it belongs to.
const char* channel_letters(Layer layer) {
  if (layer == Layer::normal) return "XYZ";
  if (channels_of(layer) == 3) return "RGB";
  return layer == Layer::depth ? "Z" : "Y";
}

class ExrImage {
 public:
  ExrImage(int width, int height) : width_(width), header_(width, height) {
    header_.compression() = Imf::ZIP_COMPRESSION;
  }

  void add(const std::string& prefix, Layer layer, const std::vector<float>& values) {
    const std::size_t channels = channels_of(layer);
    for (std::size_t c = 0; c < channels; ++c) {
      const std::string name = prefix + channel_letters(layer)[c];
      header_.channels().insert(name, Imf::Channel(Imf::FLOAT));
      // The library reads here; its slices serve reading and writing alike.
      char* base = const_cast<char*>(reinterpret_cast<const char*>(values.data() + c));
      frame_.insert(name, Imf::Slice(Imf::FLOAT, base, 4 * channels, 4 * channels * width_));
    }
  }

  std::string encode(int height) const {
    Imf::StdOSStream bytes;
    {
      Imf::OutputFile file(bytes, header_, 0);
      file.setFrameBuffer(frame_);
      file.writePixels(height);
    }
    return bytes.str();
  }

 private:
  std::size_t width_;
  Imf::Header header_;
  Imf::FrameBuffer frame_;
};

}  // namespace

bool has_exr() { return true; }

std::string encode_exr(const Picture& picture) {
  try {
    ExrImage image(picture.width, picture.height);
    image.add("", Layer::beauty, picture.rgb);
    for (const LayerImage& l : picture.layers) {
      image.add(std::string(layer_name(l.layer)) + ".", l.layer, l.values);
    }
    return image.encode(picture.height);
  } catch (const std::exception& error) {
    throw Error(ErrorCode::failed, "exr", error.what());
  }
}

#else

bool has_exr() { return false; }

std::string encode_exr(const Picture&) {
  throw Error(ErrorCode::failed, "exr", "this firn was built without OpenEXR");
}

#endif

}  // namespace firn
