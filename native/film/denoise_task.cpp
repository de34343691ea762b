// SPDX-License-Identifier: GPL-3.0-or-later
// The task's thread, and the tasks that nobody waits for any more.
#include "film/denoise_task.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "base/errors.h"

namespace afterglow {

namespace {

using namespace std::chrono_literals;

const float* given(const std::vector<float>& plane) { return plane.empty() ? nullptr : plane.data(); }

struct Task {
  DenoiserMaker make;
  std::shared_ptr<Denoiser> denoiser;
  std::shared_ptr<DenoiseImages> images;
  std::atomic<bool> stop{false};
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false;
  std::exception_ptr failure;

  void run() {
    std::exception_ptr caught;
    try {
      if (!denoiser) denoiser = make();
      const DenoiseImages& i = *images;
      denoiser->filter({.color = i.color.data(),
                        .albedo = given(i.albedo),
                        .normal = given(i.normal),
                        .surface = given(i.surface),
                        .error = given(i.error),
                        .seen = given(i.seen),
                        .width = i.width,
                        .height = i.height,
                        .fast = i.fast,
                        .prefilter = i.prefilter,
                        .stop = StopToken(&stop),
                        .threads = i.threads},
                       images->color.data());
    } catch (...) {
      caught = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    if (stop) denoiser.reset();
    failure = std::move(caught);  // whoever waits holds it alone, and ends it
    done = true;
    changed.notify_all();
  }
};

/// Threads of tasks; the process's end waits for those that are still in a library.
struct Running {
  std::atomic<int> count{0};
  ~Running() {
    for (int i = 0; i < 500 && count > 0; ++i) std::this_thread::sleep_for(10ms);
  }
};
Running running;

}  // namespace

void run_denoise_task(std::shared_ptr<Denoiser>& denoiser, DenoiserMaker make,
                      const std::shared_ptr<DenoiseImages>& images, StopToken stop) {
  const auto task = std::make_shared<Task>();
  task->make = std::move(make);
  task->denoiser = denoiser;
  task->images = images;
  running.count++;
  try {
    std::thread([task] {
      task->run();
      running.count--;
    }).detach();
  } catch (...) {
    running.count--;
    throw;
  }
  std::unique_lock lock(task->mutex);
  while (!task->changed.wait_for(lock, 5ms, [&] { return task->done; })) {
    if (!stop.stop()) continue;
    task->stop = true;
    denoiser.reset();
    throw Cancelled("denoising was cancelled");
  }
  denoiser = std::move(task->denoiser);
  if (task->failure) std::rethrow_exception(std::exchange(task->failure, nullptr));
}

}  // namespace afterglow
