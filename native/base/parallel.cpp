// SPDX-License-Identifier: GPL-3.0-or-later
// Parallel loops over TBB: see parallel.h.
#include "base/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif
#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
// A worker must read where the handover is before it can tell the sanitizer that there was one.
#define AFTERGLOW_UNWATCHED __attribute__((no_sanitize_thread))
#else
#define AFTERGLOW_UNWATCHED
#endif

namespace afterglow {

namespace {

/// Tells the thread sanitizer what TBB, which is not compiled with it, keeps from it: that work sees all that its giver
/// did before, and its giver all that the work did. Without the sanitizer it is nothing.
class Handover {
 public:
  Handover() { release(given_); }
  ~Handover() { acquire(back_); }
  Handover(const Handover&) = delete;

  /// While alive: a piece of the work.
  class Piece {
   public:
    explicit Piece(Handover& from) : from_(from) { acquire(from_.given_); }
    ~Piece() { release(from_.back_); }
    Piece(const Piece&) = delete;

   private:
    Handover& from_;
  };

 private:
  static void acquire([[maybe_unused]] char& place) {
#if defined(__SANITIZE_THREAD__)
    __tsan_acquire(&place);
#endif
  }
  static void release([[maybe_unused]] char& place) {
#if defined(__SANITIZE_THREAD__)
    __tsan_release(&place);
#endif
  }
  char given_ = 0, back_ = 0;
};

}  // namespace

#if defined(__SSE2__)
FlushDenormals::FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040u); }  // flush and read as zero
FlushDenormals::~FlushDenormals() { _mm_setcsr(saved_); }
#else
FlushDenormals::FlushDenormals() : saved_(0) {}
FlushDenormals::~FlushDenormals() {}
#endif

unsigned thread_count(unsigned threads) {
  const unsigned all = unsigned(tbb::this_task_arena::max_concurrency());
  return threads ? threads : std::max(1u, all);
}

void run_limited(unsigned threads, const std::function<void()>& work) {
  if (threads == 0) return work();
  tbb::task_arena arena(static_cast<int>(threads));
  Handover handover;
  arena.execute([&]() AFTERGLOW_UNWATCHED {
    const Handover::Piece piece(handover);
    work();
  });
}

void parallel_blocks(size_t count, size_t block, unsigned threads, const std::function<void(size_t, size_t)>& body,
                     StopToken stop) {
  block = std::max<size_t>(block, 1);
  const size_t blocks = (count + block - 1) / block;
  const auto run = [&](size_t b) {
    if (stop.stop()) return;
    const FlushDenormals flush;
    body(b * block, std::min(count, (b + 1) * block));
  };
  if (threads == 1 || blocks <= 1) {
    for (size_t b = 0; b < blocks; ++b) run(b);
    return;
  }
  run_limited(threads, [&] {
    Handover handover;
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, blocks, 1),
        [&](const tbb::blocked_range<size_t>& range) AFTERGLOW_UNWATCHED {
          const Handover::Piece piece(handover);
          for (size_t b = range.begin(); b != range.end(); ++b) run(b);
        },
        tbb::simple_partitioner());
  });
}

}  // namespace afterglow
