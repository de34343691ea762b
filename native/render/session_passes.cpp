// SPDX-License-Identifier: GPL-3.0-or-later
// What the session's thread does: whole passes by the schedule, pictures for readers, the denoiser.
#include <bit>
#include <chrono>
#include <shared_mutex>
#include <thread>
#include <utility>

#include "base/errors.h"
#include "base/parallel.h"
#include "film/denoise_task.h"
#include "render/extra_samples.h"
#include "render/session.h"
#include "render/sight.h"

namespace afterglow {

namespace {

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Pictures of a cache are smooth but for direct light: their first one may take three times as long and be finer.
constexpr double kFinerStart = 1.0 / 3.0;

/// Of a first pass: what one sample a pixel tells of noise is little, and half of the extra ones tell more.
constexpr int kExtraRounds = 2;
/// A viewport's first picture does not wait for rays that only look.
constexpr uint32_t kLooksFrom = 2;
/// In which a first picture reaches the screen before all cores are busy with what comes after it.
constexpr double kDrawn = 0.07;
/// Passes for the pixels that an edit left without samples, before those are asked that seem untouched.
constexpr uint32_t kCaughtUp = 6;

InstanceMask local_view_mask(const Scene& scene, const std::vector<uint32_t>& handles) {
  InstanceMask mask(scene.instances().size() / 64 + 1, 0);
  for (uint32_t handle : handles) {
    const uint32_t index = scene.instance_index(handle);
    mask[index / 64] |= uint64_t(1) << (index % 64);
  }
  return mask;
}

std::vector<PixelNoise> noise_of(const Film& film) {
  std::vector<PixelNoise> pixels(size_t(film.width()) * film.height());
  parallel_blocks(pixels.size(), 16384, [&](size_t begin, size_t end) {
    for (size_t p = begin; p < end; ++p) pixels[p] = film.noise(p);
  });
  return pixels;
}

/// Surfaces, the noise of each pixel's mean, and light that no surface reflects.
template <class Read>
void add_layered_guides(const Film& film, DenoiseImages& images, const Read& read, StopToken stop) {
  read(images.surface, Pass::kDenoiseSurface);
  read(images.seen, Pass::kEmission);
  if (!film.settings().transparent) {
    std::vector<float> sky;
    read(sky, Pass::kEnvironment);
    for (size_t i = 0; i < sky.size() && i < images.seen.size(); ++i) images.seen[i] += sky[i];
  }
  if (stop.stop()) return;
  for (size_t i = 0; i < images.seen.size(); ++i)
    images.seen[i] += images.surface[i / 3 * kSurfaceFloats + kSurfaceMirrored + i % 3] * film.settings().exposure;
  const std::vector<PixelNoise> noise = noise_of(film);
  if (stop.stop()) return;
  images.error = deviations(noise, film.width(), film.height(), DeviationUnit::kRelative, stop);
  for (size_t p = 0; p < noise.size(); ++p) images.error[p] /= std::sqrt(float(std::max(1u, noise[p].samples)));
}

BelievedError spread_of(const Film& film) {
  const float spread = film.spread();
  return {spread, spread, spread};
}

}  // namespace

void Session::refuse_while_rendering() const {
  const std::lock_guard lock(mutex_);
  if (state_ == SessionState::kRunning || state_ == SessionState::kPaused)
    throw InvalidInput("a cache is saved, loaded or dropped while nothing renders: wait() or cancel() first");
}

void Session::keep_cache(const std::string& path, bool load) const {
  const std::lock_guard control(control_);
  refuse_while_rendering();
  const std::shared_lock lock(scene_->use);
  std::unique_ptr<Renderer> renderer = Renderer::take(*scene_, Renderer::chosen(settings_.method, settings_.viewport));
  try {
    load ? renderer->load(*scene_, path) : renderer->save(*scene_, path);
  } catch (...) {
    Renderer::leave(*scene_, std::move(renderer));
    throw;
  }
  Renderer::leave(*scene_, std::move(renderer));
}

void Session::save_cache(const std::string& path) const { keep_cache(path, false); }
void Session::load_cache(const std::string& path) { keep_cache(path, true); }

void Session::forget_cache() const {
  const std::lock_guard control(control_);
  refuse_while_rendering();
  Renderer::take(*scene_, Renderer::chosen(settings_.method, settings_.viewport)).reset();
}

uint32_t Session::render_passes(const RenderSettings& settings, Renderer& renderer, Film& film, uint32_t before) {
  Work work{.stop = StopToken(&stop_),
            .seed = uint64_t(settings.seed),
            .threads = settings.threads,
            .pause = &paused_,
            .samples_done = &samples_done_};
  InstanceMask shown;
  if (settings.local_view_set) {
    shown = local_view_mask(scene_->scene, settings.local_view);
    work.shown = &shown;
  }
  double begun = now();
  work.lazy = settings.viewport && film.carries();
  renderer.update(*scene_, work);
  const uint32_t wanted = settings.viewport ? settings.samples : std::max(settings.samples, renderer.first());
  {
    const std::lock_guard lock(mutex_);
    shown_settings_.samples = wanted;
    statistics_.seconds["prepare"] = now() - begun;
    extra_ = renderer.extra();
    stage_ = "rendering";
  }
  if (renderer.extra() > 0.0f || (settings.denoise && settings.denoiser == kLayeredId)) film.keep_noise();
  const FilmSettings& f = film.settings();
  const uint64_t pixels = uint64_t(film.width()) * film.height();
  const ScheduleOptions options{before + wanted, settings.viewport, settings.time_limit > 0.0f,
                                coarsest_step(pixels, sample_seconds_ * (renderer.exact() ? 1.0 : kFinerStart))};
  bool shown_filtered = false;
  const bool carries = film.carries();
  const bool goes_on = carries && !settings.viewport && least_samples(film) > 0;  // from the frame before
  if (carries && !settings.viewport) film.smooth({}, settings.threads, work.stop);
  if (carries) film.begin_asking();
  uint32_t caught_up = 0;
  uint32_t done = before;
  uint64_t extra = 0;
  double in_passes = 0.0, at_last_publish = 0.0;
  for (uint32_t index = 0; !stop_; ++index) {
    PassPlan plan = plan_pass(options, index, done);
    if (goes_on && index < 2)
      plan = index ? PassPlan{0, 1, 1, CarryOver::kQuietStep} : PassPlan{0, 1, CarryOver::kQuietStep, 0};
    const bool rest_waits = carries && settings.viewport && film.rest_waits();
    if ((!plan.count && !rest_waits) || limit_reached(in_passes, settings.time_limit, done - before, plan.count)) break;
    work.pass = index;
    work.caching = caching_share(view_moved_, plan.step);
    begun = now();
    bool asks = carries && (settings.viewport ? index < 32 && options.coarsest >> index : index < (goes_on ? 2u : 1u));
    std::vector<PixelRequest> requests = carries && !asks ? catch_up_requests(film, wanted)
                                         : asks ? pass_requests({0, 1, plan.step, plan.skip}, f.x0, f.y0, f.x1, f.y1)
                                                : pass_requests(plan, f.x0, f.y0, f.x1, f.y1);
    if (carries) {
      const bool rest = !asks && rest_waits && (caught_up++ >= kCaughtUp || !plan.count);
      if (rest) requests = waiting_requests(film), film.ask_the_rest();
      if (asks) std::erase_if(requests, [&](const PixelRequest& r) { return !film.wants(r); });
      asks |= rest;
    }
    renderer.render(*scene_, requests, film, work);
    if (stop_) break;
    if (asks) film.end_asking(plan.step, settings.viewport);
    if (plan.step == 1) done = carries ? least_samples(film) : plan.first + plan.count;
    const bool looks = film.keeps_sight() && plan.step == 1 && !film.asks() &&
                       done >= std::max(1u, 2 * film.looked()) && (!settings.viewport || done >= kLooksFrom);
    double looking = now();
    if (looks) renderer.look(*scene_, film, done, settings.viewport ? kLeastSightInViewport : kLeastSight, work);
    looking = now() - looking;
    if (stop_) break;
    if (renderer.extra() > 0.0f && plan.step == 1) {
      work.extra = true;
      const int rounds = settings.viewport || index ? 1 : kExtraRounds;
      for (int i = 1; i <= rounds && !stop_; ++i) {
        const std::vector<PixelRequest> noisy = extra_requests(film, renderer.extra() * float(i) / float(rounds));
        for (const PixelRequest& request : noisy) extra += request.count;
        renderer.render(*scene_, noisy, film, work);
      }
      work.extra = false;
      if (stop_) break;
    }
    const double seconds = now() - begun;
    in_passes += seconds;
    uint64_t samples = 0;
    for (const PixelRequest& request : requests) samples += sample_count(request);
    if (samples >= kSamplesToTime && !paused_) sample_seconds_ = (seconds - looking) / double(samples);
    BelievedError noise;
    const bool due = error_is_due(done) || (done >= 2 && done >= wanted);
    if (plan.step == 1 && due) noise = carries ? spread_of(film) : film.believed_error();
    const MethodStatistics told = renderer.statistics();
    for (const std::string& warning : told.warnings) warn(warning);
    {
      const std::lock_guard lock(mutex_);
      film_step_ = plan.step;
      statistics_.samples = done;
      if (done > before && renderer.extra() > 0.0f) extra_ = double(extra) / (double(pixels) * (done - before));
      if (noise.value >= 0.0f) statistics_.noise = noise;
      statistics_.seconds["render"] = in_passes;
      for (const auto& [name, value] : told.values) statistics_.method_values[name] = value;
      if (statistics_.passes.size() < 4096) statistics_.passes.push_back({plan.first, plan.count, plan.step, seconds});
    }
    const bool last =
        !plan_pass(options, index + 1, done).count && !(carries && settings.viewport && film.rest_waits());
    if (carries && settings.viewport && plan.step == 1 && (done <= 1 || last || now() - at_last_publish > 0.05))
      film.smooth(deviations(noise_of(film), film.width(), film.height(), DeviationUnit::kRelative), settings.threads,
                  work.stop);
    if (settings.viewport) {
      const bool filter_now = settings.denoise && plan.step == 1 && (std::has_single_bit(done) || last);
      if (filter_now) {
        publish(settings, film, 1, true);
        shown_filtered = true;
      } else if (!shown_filtered && (plan.step > 1 || done <= 1 || last || now() - at_last_publish > 0.05)) {
        publish(settings, film, plan.step, false);
        at_last_publish = now();
      }
    }
    const bool refines = std::exchange(work.left, false);
    for (const double shown = now(); refines && !stop_ && now() - shown < kDrawn;)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    if (refines && !stop_ && renderer.refine(*scene_, work)) {
      if (stop_) break;
      film.begin_asking();  // as after an edit
      caught_up = 0, index = uint32_t(-1);
      continue;
    }
    if (settings.accuracy > 0.0f && error_may_stop(done) && noise.value >= 0.0f && noise.value <= settings.accuracy)
      break;
  }
  if (!stop_ && settings.denoise && done && !settings.viewport) publish(settings, film, 1, true);
  if (!stop_ && carries && !settings.viewport && !this->shown())  // noise that is smoothed denoises worse
    film.smooth(deviations(noise_of(film), film.width(), film.height(), DeviationUnit::kRelative), settings.threads,
                work.stop);
  if (!stop_ && settings.viewport && !shown_filtered && done) publish(settings, film, 1, false);
  return done;
}

/// Puts a picture where readers find it: the film's as it is, or filtered.
void Session::publish(const RenderSettings& settings, const Film& film, uint32_t step, bool filtered) {
  auto image = std::make_shared<Image>();
  image->width = film.width(), image->height = film.height();
  image->rgba.resize(size_t(image->width) * image->height * 4);
  film.read(Pass::kCombined, image->rgba.data(), step);
  if (filtered && !filter(settings, film, *image) && !settings.viewport) return;
  if (stop_) return;
  const std::lock_guard lock(mutex_);
  shown_ = std::move(image);
  generation_++;
}

bool Session::filter(const RenderSettings& settings, const Film& film, Image& image) {
  set_stage("denoising");
  const double begun = now();
  uint32_t samples;
  bool exact;
  {
    const std::lock_guard lock(mutex_);
    samples = statistics_.samples, exact = statistics_.exact;
  }
  const size_t pixels = size_t(image.width) * image.height;
  const auto images = std::make_shared<DenoiseImages>();
  images->width = image.width, images->height = image.height;
  const bool layered = settings.denoiser == kLayeredId;
  const auto read = [&](std::vector<float>& plane, Pass pass) {
    const size_t size = pixels * pass_info(pass).channels;
    plane.reserve(size);  // page by page, for a stop waits for none of it
    while (plane.size() < size && !stop_) plane.resize(std::min(size, plane.size() + (1u << 20)));
    if (stop_) return;
    film.read(pass, plane.data(), 1, StopToken(&stop_));
  };
  if (layered) {
    add_layered_guides(film, *images, read, StopToken(&stop_));
  } else {
    read(images->albedo, Pass::kAlbedo);
  }
  read(images->normal, Pass::kDenoiseNormal);
  images->color.resize(pixels * 3);
  if (stop_) return false;
  for (size_t p = 0; p < pixels; ++p)
    for (size_t c = 0; c < 3; ++c) images->color[p * 3 + c] = image.rgba[p * 4 + c];
  const uint32_t kept = film.carries() && !settings.viewport ? typical_samples(film) : 0;
  const DenoisePlan plan = denoise_plan(settings.viewport, samples, kept, exact);
  images->fast = plan.fast, images->prefilter = plan.prefilter, images->threads = settings.threads;
  try {
    if (denoiser_made_for_ != settings.denoiser) denoiser_.reset();
    denoiser_made_for_ = settings.denoiser;
    const auto make = [id = settings.denoiser, search = settings.denoiser_search] {
      return borrow_denoiser(id, search);
    };
    run_denoise_task(denoiser_, make, images, StopToken(&stop_));
  } catch (const Cancelled&) {
    return false;
  } catch (const Error& reason) {
    warn(std::string("not denoised: ") + reason.what());
    return false;
  }
  if (!layered && film.keeps_sight() && film.keeps_noise())
    keep_edges(film, noise_of(film), image.rgba.data(), images->color.data());
  for (size_t p = 0; p < pixels; ++p)
    for (size_t c = 0; c < 3; ++c) image.rgba[p * 4 + c] = std::fmax(0.0f, images->color[p * 3 + c]);
  const std::lock_guard lock(mutex_);
  statistics_.seconds["denoise"] += now() - begun;
  statistics_.denoiser = settings.denoiser;
  stage_ = "rendering";
  return true;
}

}  // namespace afterglow
