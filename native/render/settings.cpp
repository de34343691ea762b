// SPDX-License-Identifier: GPL-3.0-or-later
// Named values to render settings.
#include "render/settings.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "base/errors.h"

namespace afterglow {

namespace {

[[noreturn]] void wrong(const std::string& name, const std::string& wanted) {
  throw InvalidInput("setting '" + name + "' wants " + wanted);
}

double number(const std::string& name, const NamedValue& value, double low, double high) {
  double d = 0.0;
  if (const auto* b = std::get_if<bool>(&value))
    d = *b;
  else if (const auto* i = std::get_if<int64_t>(&value))
    d = double(*i);
  else if (const auto* f = std::get_if<double>(&value))
    d = *f;
  else
    wrong(name, "a number");
  if (!(d >= low && d <= high)) {
    const auto text = [](double limit) {
      return limit == std::floor(limit) ? std::to_string(int64_t(limit)) : std::to_string(limit);
    };
    wrong(name, "a number from " + text(low) + " to " + text(high) + ", not " + std::to_string(d));
  }
  return d;
}

const std::string& text(const std::string& name, const NamedValue& value) {
  if (const auto* s = std::get_if<std::string>(&value)) return *s;
  wrong(name, "a text");
}

std::vector<double> numbers(const std::string& name, const NamedValue& value, size_t count) {
  const auto* v = std::get_if<std::vector<double>>(&value);
  if (!v || v->size() != count) wrong(name, std::to_string(count) + " numbers");
  return *v;
}

std::vector<std::string> texts(const std::string& name, const NamedValue& value) {
  if (const auto* v = std::get_if<std::vector<std::string>>(&value)) return *v;
  if (const auto* v = std::get_if<std::vector<double>>(&value); v && v->empty()) return {};
  wrong(name, "a list of texts");
}

uint32_t choice(const std::string& name, const NamedValue& value, const std::vector<std::string>& choices) {
  const std::string& chosen = text(name, value);
  std::string known;
  for (size_t i = 0; i < choices.size(); ++i) {
    if (choices[i] == chosen) return uint32_t(i);
    known += (i ? ", " : "") + choices[i];
  }
  wrong(name, "one of " + known + ", not '" + chosen + "'");
}

void set_mist(FilmSettings& film, const std::string& name, const NamedValue& value) {
  const auto bad = [&] { wrong(name, "(start, depth, 'quadratic', 'linear' or 'inverse_quadratic')"); };
  std::vector<double> v;
  if (const auto* words = std::get_if<std::vector<std::string>>(&value); words && words->size() == 3) {
    const std::vector<std::string> falloffs = {"quadratic", "linear", "inverse_quadratic"};
    const auto falloff = std::find(falloffs.begin(), falloffs.end(), (*words)[2]);
    if (falloff == falloffs.end()) bad();
    char* end = nullptr;
    for (size_t i = 0; i < 2; ++i) v.push_back(std::strtod((*words)[i].c_str(), &end));
    v.push_back(double(falloff - falloffs.begin()));
  } else {
    v = numbers(name, value, 3);
  }
  if (!(v[0] >= 0.0 && v[0] < 1e30) || !(v[1] >= 0.0 && v[1] < 1e30) || !(v[2] >= 0.0 && v[2] <= 2.0)) bad();
  film.mist_start = float(v[0]), film.mist_depth = float(v[1]), film.mist_falloff = uint8_t(v[2]);
}

void set_region(FilmSettings& film, const std::string& name, const NamedValue& value) {
  const std::vector<double> v = numbers(name, value, 4);
  for (double d : v)
    if (!(d >= 0.0 && d <= 65535.0)) wrong(name, "(x0, y0, x1, y1) inside the image");
  film.x0 = uint32_t(v[0]), film.y0 = uint32_t(v[1]), film.x1 = uint32_t(v[2]), film.y1 = uint32_t(v[3]);
}

SettingValue method_value(const std::string& name, const NamedValue& value, const SettingDescription& d) {
  if (std::holds_alternative<std::string>(d.default_value)) return text(name, value);
  const double n = number(name, value, d.min, d.max);
  if (std::holds_alternative<bool>(d.default_value)) return n != 0.0;
  if (std::holds_alternative<int64_t>(d.default_value)) return int64_t(n);
  return n;
}

using Setter = std::function<void(RenderSettings&, const std::string&, const NamedValue&)>;

const std::map<std::string, Setter>& setters() {
  using R = RenderSettings;
  using N = std::string;
  using V = NamedValue;
  static const std::map<std::string, Setter> all = {
      {"width", [](R& r, const N& n, const V& v) { r.film.width = uint32_t(number(n, v, 1, 65535)); }},
      {"height", [](R& r, const N& n, const V& v) { r.film.height = uint32_t(number(n, v, 1, 65535)); }},
      {"region", [](R& r, const N& n, const V& v) { set_region(r.film, n, v); }},
      {"method", [](R& r, const N& n, const V& v) { r.method = text(n, v); }},
      {"samples", [](R& r, const N& n, const V& v) { r.samples = uint32_t(number(n, v, 1, 16777216)); }},
      {"accuracy", [](R& r, const N& n, const V& v) { r.accuracy = float(number(n, v, 0, 1e6)); }},
      {"time_limit", [](R& r, const N& n, const V& v) { r.time_limit = float(number(n, v, 0, 1e9)); }},
      {"seed", [](R& r, const N& n, const V& v) { r.seed = int64_t(number(n, v, -2147483648.0, 4294967295.0)); }},
      {"frame", [](R& r, const N& n, const V& v) { r.frame = number(n, v, -1e9, 1e9); }},
      {"threads", [](R& r, const N& n, const V& v) { r.threads = uint32_t(number(n, v, 0, 1024)); }},
      {"pixel_filter",
       [](R& r, const N& n, const V& v) {
         r.film.filter = PixelFilterKind(choice(n, v, {"BOX", "GAUSSIAN", "BLACKMAN_HARRIS"}));
       }},
      {"filter_width", [](R& r, const N& n, const V& v) { r.film.filter_width = float(number(n, v, 0.01, 100)); }},
      {"film_transparent", [](R& r, const N& n, const V& v) { r.film.transparent = number(n, v, 0, 1) != 0; }},
      {"film_exposure", [](R& r, const N& n, const V& v) { r.film.exposure = float(number(n, v, 0, 1e6)); }},
      {"passes",
       [](R& r, const N& n, const V& v) {
         r.film.passes = kAlwaysKept;
         for (const std::string& name : texts(n, v)) r.film.passes |= bit(pass_by_name(name));
       }},
      {"denoise", [](R& r, const N& n, const V& v) { r.denoise = number(n, v, 0, 1) != 0; }},
      {"denoiser", [](R& r, const N& n, const V& v) { r.denoiser = text(n, v); }},
      {"denoiser_search", [](R& r, const N& n, const V& v) { r.denoiser_search = texts(n, v); }},
      {"viewport", [](R& r, const N& n, const V& v) { r.viewport = number(n, v, 0, 1) != 0; }},
      {"carry_over", [](R& r, const N& n, const V& v) { r.carry_over = number(n, v, 0, 1) != 0; }},
      {"sight", [](R& r, const N& n, const V& v) { r.sight = number(n, v, 0, 1) != 0; }},
      {"mist", [](R& r, const N& n, const V& v) { set_mist(r.film, n, v); }},
      {"local_view",
       [](R& r, const N& n, const V& v) {
         r.local_view.clear();
         r.local_view_set = true;
         if (const auto* none = std::get_if<bool>(&v); none && !*none) {  // None
           r.local_view_set = false;
           return;
         }
         const auto* handles = std::get_if<std::vector<double>>(&v);
         if (!handles && !(std::get_if<std::vector<std::string>>(&v))) wrong(n, "a list of instance handles or None");
         if (handles)
           for (double h : *handles) r.local_view.push_back(uint32_t(h));
       }},
  };
  return all;
}

}  // namespace

void RenderSettings::apply(const NamedValues& values) {
  RenderSettings next = *this;
  for (const auto& [name, value] : values) {
    if (const auto found = setters().find(name); found != setters().end()) {
      found->second(next, name, value);
      continue;
    }
    bool known = false;
    for (const MethodDescription& method : method_descriptions())
      for (const SettingDescription& d : method.settings)
        if (d.name == name && !known) {
          known = true;
          std::erase_if(next.method_settings, [&](const auto& s) { return s.first == name; });
          next.method_settings.emplace_back(name, method_value(name, value, d));
        }
    if (!known) throw InvalidInput("no setting is called '" + name + "'");
  }
  const FilmSettings& f = next.film;
  if (f.x1 && (f.x0 >= std::min(f.x1, f.width) || f.y0 >= std::min(f.y1, f.height)))
    throw InvalidInput("setting 'region' holds no pixel of the image");
  if (next.method != "AUTO") make_method(next.method);  // throws with the list of names
  *this = std::move(next);
}

bool RenderSettings::same_samples(const RenderSettings& o) const {
  return film == o.film && method == o.method && method_settings == o.method_settings && seed == o.seed &&
         sight == o.sight && local_view_set == o.local_view_set && local_view == o.local_view;
}

}  // namespace afterglow
