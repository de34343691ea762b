// SPDX-License-Identifier: GPL-3.0-or-later
// The session's thread and what may be asked of it. Control calls take turns under one lock; readers take another,
// short one, and never wait for the render.
#include "render/session.h"

#include <algorithm>
#include <chrono>
#include <shared_mutex>

#include "base/errors.h"
#include "base/parallel.h"
#include "render/running_estimate.h"

namespace afterglow {

/// Radius of a pixel filter, in pixels, to which all of a pixel is one point: an edge lies before it or behind.
static constexpr float kPointFilter = 0.1f;

static double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

const char* state_name(SessionState state) {
  constexpr const char* kNames[] = {"idle", "running", "paused", "finished", "cancelled", "failed"};
  return kNames[int(state)];
}

Session::Session(std::shared_ptr<const CommittedScene> scene, RenderSettings settings)
    : scene_(std::move(scene)), settings_(std::move(settings)), shown_settings_(settings_) {}

Session::~Session() { stop_thread(); }

RenderSettings Session::settings() const {
  const std::lock_guard lock(control_);
  return settings_;
}

void Session::stop_thread() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  stop_ = false;
}

void Session::launch() {
  stop_thread();
  {
    const std::lock_guard lock(mutex_);
    state_ = paused_ ? SessionState::kPaused : SessionState::kRunning;
    shown_settings_ = settings_;
    failure_ = nullptr;
    failure_text_.clear();
    stage_ = "preparing";
    statistics_ = {};
    started_ = now();
    ended_ = 0.0;
    samples_done_ = 0;
  }
  try {
    thread_ = std::thread([this, settings = settings_] { run(settings); });
  } catch (...) {
    const std::lock_guard lock(mutex_);
    state_ = SessionState::kFailed;
    failure_ = std::current_exception();
    failure_text_ = "no thread could be started";
  }
}

void Session::start() {
  const std::lock_guard control(control_);
  {
    const std::lock_guard lock(mutex_);
    if (state_ == SessionState::kRunning || state_ == SessionState::kPaused) return;
  }
  paused_ = false;
  if (edits_)
    restart_after_edit_ = true;
  else
    launch();
}

bool Session::wait(double timeout) {
  std::unique_lock lock(mutex_);
  const auto done = [&] { return state_ != SessionState::kRunning && state_ != SessionState::kPaused; };
  if (timeout < 0.0 || timeout > 1e8)
    changed_.wait(lock, done);
  else if (!changed_.wait_for(lock, std::chrono::duration<double>(timeout), done))
    return false;
  if (failure_) std::rethrow_exception(failure_);
  return true;
}

void Session::cancel() {
  const std::lock_guard control(control_);
  restart_after_edit_ = false;
  stop_thread();
  const std::lock_guard lock(mutex_);
  if (state_ == SessionState::kRunning || state_ == SessionState::kPaused) state_ = SessionState::kCancelled;
  paused_ = false;
  changed_.notify_all();
}

void Session::pause() {
  const std::lock_guard control(control_);
  const std::lock_guard lock(mutex_);
  if (state_ != SessionState::kRunning) return;
  paused_ = true;
  state_ = SessionState::kPaused;
}

void Session::resume() {
  const std::lock_guard control(control_);
  const std::lock_guard lock(mutex_);
  paused_ = false;
  if (state_ == SessionState::kPaused) state_ = SessionState::kRunning;
}

void Session::begin_edit() {
  const std::lock_guard control(control_);
  if (edits_++) return;
  stop_thread();
  const std::lock_guard lock(mutex_);
  restart_after_edit_ = state_ != SessionState::kIdle && state_ != SessionState::kCancelled;
  if (state_ == SessionState::kRunning || state_ == SessionState::kPaused) stage_ = "editing";
}

void Session::end_edit() {
  const std::lock_guard control(control_);
  if (edits_ > 0) --edits_;
  if (!edits_ && restart_after_edit_) {
    restart_after_edit_ = false;
    launch();
  }
}

void Session::update(const NamedValues& values) {
  const std::lock_guard control(control_);
  RenderSettings next = settings_;
  next.apply(values);
  bool active;
  {
    const std::lock_guard lock(mutex_);
    active = state_ != SessionState::kIdle && state_ != SessionState::kCancelled;
  }
  if (active && !edits_) stop_thread();
  settings_ = std::move(next);
  if (active && !edits_) launch();
}

double Session::elapsed() const { return started_ > 0.0 ? (ended_ > 0.0 ? ended_ : now()) - started_ : 0.0; }

SessionProgress Session::progress() const {
  const std::lock_guard lock(mutex_);
  SessionProgress p;
  p.state = state_;
  p.stage = stage_;
  p.failure = failure_text_;
  p.samples = statistics_.samples;
  p.noise = statistics_.noise.value;
  p.exact = statistics_.exact;
  p.elapsed = elapsed();
  const uint64_t done = samples_done_.load();
  if (film_) {
    const FilmSettings& f = film_->settings();
    const double pixels = double(f.x1 - f.x0) * double(f.y1 - f.y0);
    p.fraction = std::min(1.0, double(done) / std::max(1.0, pixels * shown_settings_.samples * (1.0 + extra_)));
    if (shown_settings_.accuracy > 0.0f && p.noise > 0.0)  // its square falls with the samples
      p.fraction = std::max(p.fraction, std::min(1.0, std::pow(shown_settings_.accuracy / p.noise, 2.0)));
    if (shown_settings_.time_limit > 0.0f)
      p.fraction = std::max(p.fraction, std::min(1.0, p.elapsed / shown_settings_.time_limit));
    if (p.fraction > 0.0 && state_ == SessionState::kRunning) p.remaining = p.elapsed / p.fraction - p.elapsed;
  }
  if (state_ == SessionState::kFinished) p.fraction = 1.0, p.remaining = 0.0;
  if (!shown_ && film_step_ == 1 && done != generation_at_) {
    generation_at_ = done;
    const_cast<Session*>(this)->generation_++;
  }
  p.generation = generation_;
  return p;
}

SessionStatistics Session::statistics() const {
  const std::lock_guard lock(mutex_);
  SessionStatistics s = statistics_;
  s.elapsed = elapsed();
  return s;
}

std::pair<uint32_t, uint32_t> Session::size() const {
  const std::lock_guard lock(mutex_);
  if (shown_) return {shown_->width, shown_->height};
  if (film_) return {film_->width(), film_->height()};
  const FilmSettings film = completed(shown_settings_.film);
  return {film.x1 - film.x0, film.y1 - film.y0};
}

PassSet Session::passes() const {
  const std::lock_guard lock(mutex_);
  return (film_ ? film_->settings().passes : shown_settings_.film.passes) | kAlwaysKept;
}

std::shared_ptr<const Session::Image> Session::shown() const {
  const std::lock_guard lock(mutex_);
  return shown_;
}

void Session::read(Pass pass, std::vector<float>& out, uint32_t& width, uint32_t& height) const {
  std::shared_ptr<Film> film;
  uint32_t step;
  if (const auto shown = pass == Pass::kCombined ? this->shown() : nullptr) {
    out = shown->rgba;
    width = shown->width, height = shown->height;
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    // A viewport shows whole images only: until the first, nothing.
    if (!(pass == Pass::kCombined && shown_settings_.viewport)) film = film_;
    step = film_step_;
  }
  if (!film) {
    std::tie(width, height) = size();
    out.assign(size_t(width) * height * pass_info(pass).channels, 0.0f);
    return;
  }
  if (!(film->settings().passes & bit(pass)))
    throw InvalidInput(std::string("pass '") + pass_info(pass).name +
                       "' was not asked for; add it to the setting 'passes'");
  width = film->width(), height = film->height();
  out.resize(size_t(width) * height * pass_info(pass).channels);
  film->read(pass, out.data(), step);
}

bool Session::carried(const RenderSettings& settings, const Film& film) const {
  return film.carries() && film_made_for_.same_samples(settings) && film_seen_by_ &&
         same_view(*film_seen_by_, scene_->scene.camera());
}

void Session::set_stage(const char* stage) {
  const std::lock_guard lock(mutex_);
  stage_ = stage;
}

void Session::warn(const std::string& text) {
  const std::lock_guard lock(mutex_);
  if (std::find(statistics_.warnings.begin(), statistics_.warnings.end(), text) == statistics_.warnings.end())
    statistics_.warnings.push_back(text);
}

void Session::run(RenderSettings settings) {
  SessionState result = SessionState::kFinished;
  std::exception_ptr failure;
  std::string text;
  try {
    const std::shared_lock use(scene_->use);
    std::unique_ptr<Renderer> kept = Renderer::take(*scene_, Renderer::chosen(settings.method, settings.viewport));
    Renderer& renderer = *kept;
    Settings method_settings = settings.method_settings;
    method_settings.emplace_back("accuracy", double(settings.accuracy));
    method_settings.emplace_back("denoise", settings.denoise);
    renderer.configure(method_settings);
    if (settings.denoise) {
      settings.denoiser = chosen_denoiser(settings.denoiser, settings.denoiser_search);
      settings.film.passes |= denoise_passes(settings.denoiser);
    }
    const bool carries = settings.carry_over && renderer.carries();
    if (carries) settings.film.passes |= Film::kCarriedPasses;
    const bool looks = settings.sight && renderer.looks() &&
                       filter_radius(settings.film.filter, settings.film.filter_width) > kPointFilter;
    if (looks) settings.film.passes |= Film::kSeenPasses;
    std::shared_ptr<Film> film;
    {
      const std::lock_guard lock(mutex_);
      if (film_ && film_.use_count() == 1) film.swap(film_);  // nobody reads it: its memory serves again
    }
    const FilmSettings wanted = completed(settings.film);
    const bool running = renderer.running() && !settings.viewport;
    uint32_t before = 0;
    if (carries && !settings.viewport) {
      film = RunningEstimate::take_carried(*scene_, settings, wanted, settings.seed);
      if (!film) film = std::make_shared<Film>(wanted);
    } else if (auto last = running ? RunningEstimate::take(*scene_, settings, wanted, before) : nullptr)
      film = std::move(last);
    else if (film && film->settings() == wanted && film->carries() == carries) {
      if (!carries || !carried(settings, *film)) film->clear();
    } else {
      film = std::make_shared<Film>(wanted);
    }
    if (carries) film->carry_over();
    if (looks) film->keep_sight();
    film_made_for_ = settings;
    const Camera& camera = scene_->scene.camera();
    view_moved_ = settings.viewport && film_seen_by_ && !same_view(*film_seen_by_, camera);
    film_seen_by_ = camera;
    {
      const std::lock_guard lock(mutex_);
      film_ = film;
      film_step_ = settings.viewport ? kCoarsestStep : 1;
      if (!settings.viewport) shown_ = nullptr;
      statistics_.method = renderer.method();
      statistics_.exact = renderer.exact();
      statistics_.effects = scene_->effects.bits;
      statistics_.threads = thread_count(settings.threads);
      statistics_.bytes["film"] = film->bytes();
    }
    uint32_t samples = 0;
    run_limited(settings.threads, [&] { samples = render_passes(settings, renderer, *film, before); });
    if (stop_) result = SessionState::kCancelled;
    if ((running || (carries && !settings.viewport)) && !stop_)
      RunningEstimate::leave(*scene_, settings, film, samples);
    Renderer::leave(*scene_, std::move(kept));
  } catch (const std::bad_alloc&) {
    failure = std::make_exception_ptr(OutOfMemory("the render ran out of memory; lower the resolution or the passes"));
    text = "the render ran out of memory";
  } catch (const std::exception& e) {
    failure = std::current_exception();
    text = e.what();
  } catch (...) {
    failure = std::current_exception();
    text = "unknown failure";
  }
  const std::lock_guard lock(mutex_);
  // A stop for an edit leaves the state to whoever stopped it: to readers the render goes on.
  if (failure)
    state_ = SessionState::kFailed, failure_ = failure, failure_text_ = text;
  else if (result == SessionState::kFinished)
    state_ = result;
  if (state_ != SessionState::kRunning && state_ != SessionState::kPaused) {
    ended_ = now();
    stage_ = state_name(state_);
  }
  if (failure || result == SessionState::kFinished) generation_++;  // stopped for an edit: nothing new to see
  changed_.notify_all();
}

}  // namespace afterglow
