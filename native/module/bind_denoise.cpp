// SPDX-License-Identifier: GPL-3.0-or-later
// The denoisers, as Python sees them.
#include <pybind11/stl.h>

#include "film/denoiser.h"
#include "module/bindings.h"

namespace afterglow {

void bind_denoise(py::module_&);

namespace {

py::list list(const std::vector<std::string>& search) {
  py::list all;
  for (const DenoiserInfo& info : list_denoisers(search)) {
    py::dict d;
    d["id"] = info.id, d["label"] = info.label, d["available"] = info.available, d["reason"] = info.reason;
    d["path"] = info.path, d["version"] = info.version;
    all.append(d);
  }
  return all;
}

/// RGB of an (h, w, 3 or 4) image; empty for None.
std::vector<float> rgb_of(const py::object& image, const std::string& what, uint32_t& width, uint32_t& height) {
  if (image.is_none()) return {};
  const auto array = py::array_t<float, py::array::c_style | py::array::forcecast>::ensure(image);
  if (!array || array.ndim() != 3 || (array.shape(2) != 3 && array.shape(2) != 4)) {
    PyErr_Clear();
    throw InvalidInput("denoise: " + what + " must be an image of the shape (height, width, 3 or 4)");
  }
  if (height && (uint32_t(array.shape(0)) != height || uint32_t(array.shape(1)) != width))
    throw InvalidInput("denoise: " + what + " has another size than color");
  height = uint32_t(array.shape(0)), width = uint32_t(array.shape(1));
  std::vector<float> rgb(size_t(width) * height * 3);
  const size_t channels = size_t(array.shape(2));
  for (size_t p = 0; p < size_t(width) * height; ++p)
    for (size_t c = 0; c < 3; ++c) rgb[p * 3 + c] = array.data()[p * channels + c];
  return rgb;
}

/// The same values of an array of (h, w, channels), or (h, w) for one channel; empty for None.
std::vector<float> plane_of(const py::object& image, const std::string& what, uint32_t width, uint32_t height,
                            int channels) {
  if (image.is_none()) return {};
  const auto array = py::array_t<float, py::array::c_style | py::array::forcecast>::ensure(image);
  const bool fits = array && array.ndim() >= 2 && array.shape(0) == py::ssize_t(height) &&
                    array.shape(1) == py::ssize_t(width) && array.size() == py::ssize_t(width) * height * channels;
  if (!fits) {
    PyErr_Clear();
    throw InvalidInput("denoise: " + what + " must hold " + std::to_string(channels) +
                       " values for each pixel of color");
  }
  return {array.data(), array.data() + array.size()};
}

const float* given(const std::vector<float>& plane) { return plane.empty() ? nullptr : plane.data(); }

py::array_t<float> denoise(const py::object& color, const py::object& albedo, const py::object& normal,
                           const std::string& id, const std::vector<std::string>& search, bool prefilter,
                           const py::object& surface, const py::object& error, const py::object& seen) {
  uint32_t width = 0, height = 0;
  const std::vector<float> c = rgb_of(color, "color", width, height);
  if (c.empty()) throw InvalidInput("denoise: color must hold pixels");
  const std::vector<float> a = rgb_of(albedo, "albedo", width, height), n = rgb_of(normal, "normal", width, height);
  const std::vector<float> s = plane_of(surface, "surface", width, height, kSurfaceFloats),
                           e = plane_of(error, "error", width, height, 1), own = rgb_of(seen, "seen", width, height);
  py::array_t<float> result({py::ssize_t(height), py::ssize_t(width), py::ssize_t(3)});
  float* output = result.mutable_data();
  const py::gil_scoped_release free;
  DenoiseInput input;
  input.color = c.data();
  input.albedo = given(a), input.normal = given(n);
  input.surface = given(s), input.error = given(e), input.seen = given(own);
  input.width = width, input.height = height;
  input.prefilter = prefilter;
  borrow_denoiser(id, search)->filter(input, output);
  return result;
}

}  // namespace

void bind_denoise(py::module_& m) {
  m.def("denoisers", &list, py::arg("search") = std::vector<std::string>{});
  m.def("denoise", &denoise, py::arg("color"), py::arg("albedo") = py::none(), py::arg("normal") = py::none(),
        py::kw_only(), py::arg("denoiser") = "AUTO", py::arg("search") = std::vector<std::string>{},
        py::arg("prefilter") = false, py::arg("surface") = py::none(), py::arg("error") = py::none(),
        py::arg("seen") = py::none());
}

}  // namespace afterglow
