// SPDX-License-Identifier: GPL-3.0-or-later
// One background render that can be asked, changed, paused and cancelled from any thread. Its state is one struct with
// defaults, replaced whole at every start; what to do next is decided in schedule.h and never here.
#pragma once

#include <atomic>
#include <condition_variable>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "film/denoiser.h"
#include "render/renderer.h"
#include "render/schedule.h"
#include "render/settings.h"

namespace afterglow {

enum class SessionState { kIdle, kRunning, kPaused, kFinished, kCancelled, kFailed };
const char* state_name(SessionState);

struct SessionProgress {
  SessionState state = SessionState::kIdle;
  double fraction = 0.0, elapsed = 0.0, remaining = -1.0, noise = -1.0;  // negative: not known
  bool exact = false;                                                    // the noise is the whole error
  uint32_t samples = 0;
  uint64_t generation = 0;
  std::string stage, failure;
};

struct SessionStatistics {
  std::string method, denoiser;
  uint32_t samples = 0, threads = 0, effects = 0;
  double elapsed = 0.0;
  std::map<std::string, double> seconds, method_values;
  std::map<std::string, size_t> bytes;
  BelievedError noise;
  bool exact = false;  // the noise is the whole error: the method has no bias and shares nothing between samples
  std::vector<std::string> warnings;
  struct Pass {
    uint32_t first, count, step;
    double seconds;
  };
  std::vector<Pass> passes;
};

class Session {
 public:
  Session(std::shared_ptr<const CommittedScene>, RenderSettings);
  ~Session();
  Session(const Session&) = delete;

  void start();               // from the beginning; does nothing while it runs
  bool wait(double timeout);  // true: finished or cancelled; rethrows what made it fail
  void cancel();              // returns when the scene is not read any more
  void pause();
  void resume();
  void begin_edit();  // stopped until end_edit(); may be nested
  void end_edit();
  void update(const NamedValues&);  // starts again when the image changes
  RenderSettings settings() const;
  /// What the method remembers of the scene, into and out of a file; not while it renders (InvalidInput).
  void save_cache(const std::string& path) const;
  void load_cache(const std::string& path);
  /// Drops what the method remembers: the next start() begins from nothing. Not while it renders (InvalidInput).
  void forget_cache() const;

  SessionProgress progress() const;
  SessionStatistics statistics() const;
  /// Size of what read() writes: width, height.
  std::pair<uint32_t, uint32_t> size() const;
  PassSet passes() const;
  /// One pass, width × height × channels floats; throws InvalidInput when it is not kept. Never waits for the render.
  void read(Pass, std::vector<float>& out, uint32_t& width, uint32_t& height) const;

  struct Image {  // a finished picture that stands in for the film's
    std::vector<float> rgba;
    uint32_t width = 0, height = 0;
  };
  /// What read() gives for the combined pass, without a copy, where there is such a picture; else null.
  std::shared_ptr<const Image> shown() const;

 private:
  void refuse_while_rendering() const;
  void keep_cache(const std::string& path, bool load) const;
  void stop_thread();
  void launch();
  void run(RenderSettings);
  /// From `before` samples on, which the film has already; returns how many it has then.
  uint32_t render_passes(const RenderSettings&, Renderer&, Film&, uint32_t before);
  /// Whether the film is of this view and its samples may outlive what was edited.
  bool carried(const RenderSettings&, const Film&) const;
  void publish(const RenderSettings&, const Film&, uint32_t step, bool filtered);
  bool filter(const RenderSettings&, const Film&, Image&);
  void warn(const std::string&);
  double elapsed() const;
  void set_stage(const char*);

  const std::shared_ptr<const CommittedScene> scene_;
  RenderSettings settings_;

  mutable std::mutex control_;  // start, cancel, edit, update: one at a time
  int edits_ = 0;
  bool restart_after_edit_ = false;
  std::thread thread_;
  std::shared_ptr<Denoiser> denoiser_;  // of the thread alone; kept, because its first use is slow
  std::string denoiser_made_for_;
  std::atomic<bool> stop_{false}, paused_{false};
  std::atomic<uint64_t> samples_done_{0};
  double sample_seconds_ = 0.0;  // of the thread alone: what a sample took last, which decides how coarse a start is
  static constexpr uint64_t kSamplesToTime = 128;  // fewer tell of the thread's waits; a coarse pass must tell
  RenderSettings film_made_for_;                   // of the thread alone: what the film's samples are of
  std::optional<Camera> film_seen_by_;
  bool view_moved_ = false;  // of the thread alone: since the last start

  mutable std::mutex mutex_;  // all below
  double extra_ = 0.0;        // samples beyond every pixel's own, for each of those
  mutable std::condition_variable changed_;
  SessionState state_ = SessionState::kIdle;
  RenderSettings shown_settings_;  // what readers are told about: those of the last start
  std::exception_ptr failure_;
  std::string failure_text_, stage_;
  std::shared_ptr<Film> film_;
  std::shared_ptr<const Image> shown_;  // null: read the film
  uint32_t film_step_ = 1;
  mutable uint64_t generation_ = 0;
  mutable uint64_t generation_at_ = 0;
  SessionStatistics statistics_;
  double started_ = 0.0, ended_ = 0.0;
};

}  // namespace afterglow
