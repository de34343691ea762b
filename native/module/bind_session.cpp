// SPDX-License-Identifier: GPL-3.0-or-later
// Session and the methods about themselves, as Python sees them. No logic: values, arrays, the GIL, exceptions.
#include <pybind11/stl.h>

#include <shared_mutex>

#include "module/bindings.h"
#include "render/record_rays.h"
#include "render/renderer.h"
#include "render/session.h"

namespace afterglow {

void bind_denoise(py::module_&);

namespace {

NamedValue named_value(const std::string& name, const py::handle& value) {
  if (value.is_none()) return false;
  if (py::isinstance<py::bool_>(value)) return value.cast<bool>();
  if (py::isinstance<py::int_>(value)) return value.cast<int64_t>();
  if (py::isinstance<py::float_>(value)) return value.cast<double>();
  if (py::isinstance<py::str>(value)) return value.cast<std::string>();
  if (py::hasattr(value, "__float__") && !py::hasattr(value, "__len__"))
    return py::float_(py::reinterpret_borrow<py::object>(value)).cast<double>();
  if (py::hasattr(value, "__iter__")) {
    const py::list items(py::reinterpret_borrow<py::object>(value));
    if (items.empty()) return std::vector<double>{};
    try {
      bool words = false;  // one text among them makes all of them texts
      for (const py::handle& item : items) words |= py::isinstance<py::str>(item);
      if (!words) return items.cast<std::vector<double>>();
      std::vector<std::string> texts;
      for (const py::handle& item : items) texts.push_back(py::str(item).cast<std::string>());
      return texts;
    } catch (const py::cast_error&) {
    }
  }
  throw InvalidInput("setting '" + name + "' has a value of type " +
                     py::str(py::type::of(value).attr("__name__")).cast<std::string>() + ", which no setting takes");
}

NamedValues named_values(const py::handle& mapping) {
  NamedValues values;
  const py::dict settings(py::reinterpret_borrow<py::object>(mapping));
  for (const auto& [key, value] : settings) {
    const auto name = py::str(key).cast<std::string>();
    values.emplace_back(name, named_value(name, value));
  }
  return values;
}

py::object known(double value) { return value >= 0.0 ? py::object(py::float_(value)) : py::object(py::none()); }

py::object setting_value(const SettingValue& value) {
  return std::visit([](const auto& v) -> py::object { return py::cast(v); }, value);
}

class PySession {
 public:
  PySession(const PyScene& scene, const py::object& settings) {
    RenderSettings render;
    render.apply(named_values(settings));
    session_ = std::make_unique<Session>(scene.core, std::move(render));
  }
  ~PySession() {
    const py::gil_scoped_release free;
    session_.reset();
  }
  PySession(const PySession&) = delete;
  Session* operator->() { return session_.get(); }

 private:
  std::unique_ptr<Session> session_;
};

/// `with session.edit():`
struct EditGuard {
  py::object owner;
  PySession* session;
};

py::dict progress(PySession& session) {
  const SessionProgress p = session->progress();
  py::dict d;
  d["state"] = state_name(p.state);
  d["fraction"] = p.fraction;
  d["samples"] = p.samples;
  d["remaining"] = known(p.remaining);
  d["elapsed"] = p.elapsed;
  d["stage"] = p.stage;
  d["error"] = known(p.exact ? p.noise : -1.0);
  d["noise"] = known(p.noise);
  d["generation"] = p.generation;
  if (!p.failure.empty()) d["failure"] = p.failure;
  return d;
}

py::dict statistics(PySession& session) {
  const SessionStatistics s = session->statistics();
  py::dict d, seconds, rays, bytes, values;
  uint64_t dropped = 0;
  for (const auto& [stage, value] : s.seconds) seconds[py::str(stage)] = value;
  for (const auto& [name, value] : s.method_values) {
    if (name == "dropped")
      dropped = uint64_t(value);
    else if (name.ends_with("_rays"))
      rays[py::str(name.substr(0, name.size() - 5))] = uint64_t(value);
    else
      values[py::str(name)] = value;
  }
  for (const auto& [name, value] : s.bytes) bytes[py::str(name)] = value;
  d["method"] = s.method;
  d["samples"] = s.samples;
  d["elapsed"] = s.elapsed;
  d["seconds"] = seconds;
  d["rays"] = rays;
  const BelievedError error = s.exact ? s.noise : BelievedError{};
  d["believed_error"] = known(error.value);
  d["error_low"] = known(error.low);
  d["error_high"] = known(error.high);
  d["noise"] = known(s.noise.value);
  d["bytes"] = bytes;
  d["dropped"] = dropped;
  d["values"] = values;
  d["warnings"] = s.warnings;
  d["threads"] = s.threads;
  d["effects"] = s.effects;
  d["denoiser"] = s.denoiser;
  py::list passes;
  for (const auto& pass : s.passes) {
    py::dict one;
    one["first"] = pass.first, one["count"] = pass.count, one["step"] = pass.step, one["seconds"] = pass.seconds;
    passes.append(one);
  }
  d["passes_log"] = passes;
  return d;
}

py::array_t<float> read(PySession& session, const std::string& name, const py::object& out) {
  const Pass pass = pass_by_name(name);
  if (pass == Pass::kCombined && py::isinstance<py::array_t<float, py::array::c_style>>(out)) {
    auto array = py::reinterpret_borrow<py::array_t<float, py::array::c_style>>(out);
    const std::shared_ptr<const Session::Image> shown = session->shown();
    if (shown && size_t(array.size()) == shown->rgba.size()) {  // a viewport's way: one copy
      std::copy(shown->rgba.begin(), shown->rgba.end(), array.mutable_data());
      return array;
    }
  }
  auto pixels = std::make_unique<std::vector<float>>();
  uint32_t width = 0, height = 0;
  {
    const py::gil_scoped_release free;
    session->read(pass, *pixels, width, height);
  }
  const py::ssize_t channels = pass_info(pass).channels;
  if (out.is_none()) {
    std::vector<float>* kept = pixels.release();
    const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<float>*>(p); });
    return py::array_t<float>({py::ssize_t(height), py::ssize_t(width), channels}, kept->data(), owner);
  }
  if (!py::isinstance<py::array_t<float, py::array::c_style>>(out))
    throw InvalidInput("read: out must be a C-contiguous float32 array");
  auto array = py::reinterpret_borrow<py::array_t<float, py::array::c_style>>(out);
  if (size_t(array.size()) != pixels->size())
    throw InvalidInput("read: out holds " + std::to_string(array.size()) + " values, the pass '" + name + "' has " +
                       std::to_string(height) + " × " + std::to_string(width) + " × " + std::to_string(channels));
  std::copy(pixels->begin(), pixels->end(), array.mutable_data());
  return array;
}

py::list descriptions() {
  constexpr const char* kTypes[] = {"bool", "int", "float", "str"};
  py::list all;
  for (const MethodDescription& m : method_descriptions()) {
    py::list settings;
    for (const SettingDescription& s : m.settings) {
      py::dict d;
      d["name"] = s.name, d["label"] = s.label, d["description"] = s.description, d["unit"] = s.unit;
      d["type"] = kTypes[s.default_value.index()];
      d["default"] = setting_value(s.default_value);
      d["min"] = s.min, d["max"] = s.max;
      settings.append(d);
    }
    py::dict d;
    d["id"] = m.id, d["label"] = m.label, d["description"] = m.description, d["settings"] = settings;
    d["debug_views"] = m.debug_views, d["statistics"] = m.statistics;
    all.append(d);
  }
  return all;
}

py::dict record(const PyScene& scene, const py::object& settings, size_t most) {
  RenderSettings render;
  render.apply(named_values(settings));
  RecordedRays rays;
  {
    const py::gil_scoped_release free;
    const std::shared_lock use(scene.core->use);
    rays = record_rays(*scene.core, render, most);
  }
  const DVec3 origin = scene.core->scene.origin();
  const auto table = [](size_t rows) { return py::array_t<double>({py::ssize_t(rows), py::ssize_t(3)}); };
  const auto fill = [&](const std::vector<Ray>& from, auto&& second, py::array_t<double>& a, py::array_t<double>& b) {
    for (size_t i = 0; i < from.size(); ++i) {
      const DVec3 start = DVec3(from[i].origin) + origin, other = second(from[i], start);
      for (int c = 0; c < 3; ++c)
        a.mutable_at(py::ssize_t(i), c) = start[c], b.mutable_at(py::ssize_t(i), c) = other[c];
    }
  };
  py::array_t<double> origins = table(rays.closest.size()), directions = table(rays.closest.size()),
                      starts = table(rays.occlusion.size()), targets = table(rays.occlusion.size());
  fill(
      rays.closest, [](const Ray& r, const DVec3&) { return DVec3(r.direction); }, origins, directions);
  fill(
      rays.occlusion,
      [](const Ray& r, const DVec3& start) {
        return start + DVec3(r.direction) * (std::isfinite(r.t_max) ? double(r.t_max) : 1e6);
      },
      starts, targets);
  py::dict d;
  d["closest_origins"] = origins, d["closest_directions"] = directions;
  d["occluded_origins"] = starts, d["occluded_targets"] = targets;
  return d;
}

/// Waits in slices, so that Ctrl-C is heard.
bool wait(PySession& session, double timeout) {
  for (double left = timeout;; left -= 0.1) {
    bool ended;
    {
      const py::gil_scoped_release free;
      ended = session->wait(std::fmin(std::fmax(left, 0.0), 0.1));
    }
    if (ended) return true;
    if (PyErr_CheckSignals()) throw py::error_already_set();
    if (left <= 0.1) return false;
  }
}

}  // namespace

void bind_session(py::module_& m) {
  using Free = py::call_guard<py::gil_scoped_release>;
  py::class_<EditGuard>(m, "_EditGuard")
      .def("__enter__",
           [](EditGuard& g) {
             const py::gil_scoped_release free;
             (*g.session)->begin_edit();
           })
      .def("__exit__", [](EditGuard& g, const py::args&) {
        const py::gil_scoped_release free;
        (*g.session)->end_edit();
      });
  py::class_<PySession>(m, "Session")
      .def(py::init<const PyScene&, const py::object&>(), py::arg("scene"), py::arg("settings") = py::dict(),
           py::keep_alive<1, 2>())
      .def(
          "start", [](PySession& s) { s->start(); }, Free())
      .def("wait", &wait, py::arg("timeout") = 1e9)
      .def(
          "cancel", [](PySession& s) { s->cancel(); }, Free())
      .def(
          "pause", [](PySession& s) { s->pause(); }, Free())
      .def(
          "resume", [](PySession& s) { s->resume(); }, Free())
      .def("edit",
           [](const py::object& self) {
             return EditGuard{self, self.cast<PySession*>()};
           })
      .def(
          "update",
          [](PySession& s, const py::object& settings) {
            const NamedValues values = named_values(settings);
            const py::gil_scoped_release free;
            s->update(values);
          },
          py::arg("settings"))
      .def(
          "save_cache", [](PySession& s, const std::string& path) { s->save_cache(path); }, py::arg("path"), Free())
      .def(
          "load_cache", [](PySession& s, const std::string& path) { s->load_cache(path); }, py::arg("path"), Free())
      .def(
          "forget_cache", [](PySession& s) { s->forget_cache(); }, Free())
      .def("progress", &progress)
      .def("passes", [](PySession& s) { return pass_names(s->passes()); })
      .def("read", &read, py::arg("name") = "combined", py::arg("out") = py::none())
      .def("statistics", &statistics);
  m.def("method_descriptions", &descriptions);
  m.def("chosen_method", &Renderer::chosen, py::arg("method"), py::arg("viewport"));
  m.def("caching_share", &caching_share, py::arg("view_moved"), py::arg("step"));
  m.def(
      "denoise_plan",
      [](bool viewport, uint32_t samples, uint32_t kept, bool exact) {
        const DenoisePlan plan = denoise_plan(viewport, samples, kept, exact);
        return py::make_tuple(plan.prefilter, plan.fast);
      },
      py::arg("viewport"), py::arg("samples"), py::arg("kept"), py::arg("exact"));
  m.def("record_rays", &record, py::arg("scene"), py::arg("settings") = py::dict(), py::arg("most") = size_t(500'000));
  bind_denoise(m);
}

}  // namespace afterglow
