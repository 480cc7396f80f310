// SPDX-License-Identifier: MIT
// firn::Renderer and firn::Picture for firn/_renderer.py.
#include "python/src/renderer.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firn/renderer.h"
#include "python/src/arrays.h"
#include "python/src/use.h"
#include "python/src/work.h"

namespace firn::python {
namespace {

constexpr const char* kToneMaps[] = {"soft", "srgb", "filmic"};

ToneMapping tone_of(double exposure, const std::string& curve) {
  const auto* const found = std::find(std::begin(kToneMaps), std::end(kToneMaps), curve);
  if (found == std::end(kToneMaps))
    throw Error(ErrorCode::usage, "tone_map", "'" + curve + "' is not one of soft, srgb, filmic");
  return {exposure, static_cast<ToneMap>(found - std::begin(kToneMaps))};
}

// A view of the picture's memory, which keeps the picture alive.
template <class T>
py::array_t<T> view(const Picture& picture, std::vector<T>& values, int channels, const py::object& owner) {
  Shape shape = {picture.height, picture.width};
  if (channels > 1) shape.push_back(channels);
  return array_at(shape, values.data(), owner);
}

py::object rgb(const py::object& self) {
  auto& picture = self.cast<Picture&>();
  return view(picture, picture.rgb, 3, self);
}

py::dict layers(const py::object& self) {
  auto& picture = self.cast<Picture&>();
  py::dict all;
  for (LayerImage& layer : picture.layers)
    all[layer_name(layer.layer)] = view(picture, layer.values, channels_of(layer.layer), self);
  return all;
}

// In memory of its own, which the array takes over.
py::object mapped(const Picture& picture, double exposure, const std::string& curve) {
  auto bytes = std::make_unique<std::vector<std::uint8_t>>();
  {
    const ToneMapping tone = tone_of(exposure, curve);
    const py::gil_scoped_release unlocked;
    *bytes = tone_mapped(picture, tone);
  }
  std::uint8_t* const data = bytes->data();
  const py::capsule owner(bytes.release(),
                          [](void* memory) { delete static_cast<std::vector<std::uint8_t>*>(memory); });
  return array_at<std::uint8_t>({picture.height, picture.width, 3}, data, owner);
}

std::vector<std::string> write(const Picture& picture, const std::string& file, double exposure,
                               const std::string& curve) {
  const ToneMapping tone = tone_of(exposure, curve);
  const py::gil_scoped_release unlocked;
  return write_picture(picture, file, tone);
}

class CoreRenderer {
 public:
  CoreRenderer(const Scene& scene, int threads, const std::string& isa) {
    const auto made = std::make_shared<std::optional<Renderer>>();
    run_alone([made, scene, options = RendererOptions{threads, isa}] { made->emplace(scene, options); });
    renderer_.emplace(std::move(**made));
  }
  ~CoreRenderer() {
    const py::gil_scoped_release unlocked;
    renderer_.reset();
  }

  std::unique_ptr<Picture> render(const Snapshot& snapshot, const py::object& watch) {
    const OneUser::Use use(user_, "the renderer");
    auto picture = std::make_unique<Picture>();
    run_watched([&](const std::stop_token& stop) { *picture = renderer_->render(snapshot, stop); }, watch);
    return picture;
  }

  std::pair<double, std::string> tone_mapping() const {
    const ToneMapping tone = renderer_->tone_mapping();
    return {tone.exposure, kToneMaps[static_cast<std::size_t>(tone.curve)]};
  }

 private:
  OneUser user_;
  std::optional<Renderer> renderer_;
};

}  // namespace

void bind_renderer(py::module_& module) {
  py::class_<Picture>(module, "Picture", "firn::Picture; firn.Picture is its face.")
      .def(py::init([](int width, int height) {
        Picture picture;
        picture.resize(width, height);
        return picture;
      }))
      .def("width", [](const Picture& picture) { return picture.width; })
      .def("height", [](const Picture& picture) { return picture.height; })
      .def("rgb", &rgb)
      .def("layers", &layers)
      .def("add_layer",
           [](Picture& picture, const std::string& name) {
             const auto* const found = std::find(std::begin(kLayerNames), std::end(kLayerNames), name);
             const auto layer = static_cast<Layer>(found - std::begin(kLayerNames));
             const std::size_t pixels = static_cast<std::size_t>(picture.width) * picture.height;
             picture.layers.push_back(
                 {layer, std::vector<float>(pixels * static_cast<std::size_t>(channels_of(layer)))});
           })
      .def("copy", [](const Picture& picture) { return Picture(picture); })
      .def("tone_mapped", &mapped)
      .def("write", &write);
  py::class_<CoreRenderer>(module, "Renderer", "firn::Renderer; firn.Renderer is its face.")
      .def(py::init<const Scene&, int, const std::string&>())
      .def("render", &CoreRenderer::render)
      .def("tone_mapping", &CoreRenderer::tone_mapping);
}

}  // namespace firn::python
