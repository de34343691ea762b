// SPDX-License-Identifier: GPL-3.0-or-later
// Parallel loops over TBB without its headers. Blocks are cut the same way on any number of threads, so that a loop's
// result may depend on its blocks but never on who ran them. An exception of a block ends the loop and comes out of it.
#pragma once

#include <cstddef>
#include <functional>

#include "base/cancel.h"

namespace afterglow {

/// Calls body(begin, end) for blocks of at most `block` of [0, count). threads 0: all. Denormals are zero inside.
/// After `stop` no further block starts.
void parallel_blocks(size_t count, size_t block, unsigned threads, const std::function<void(size_t, size_t)>& body,
                     StopToken stop = {});
inline void parallel_blocks(size_t count, size_t block, const std::function<void(size_t, size_t)>& body) {
  parallel_blocks(count, block, 0, body);
}

/// Runs the function where at most `threads` threads join its parallel work (0: all), and waits for it.
void run_limited(unsigned threads, const std::function<void()>& work);

/// How many threads parallel_blocks would use for `threads`.
unsigned thread_count(unsigned threads = 0);

/// While alive, denormal floats count as zero on this thread: they are slow, and Embree asks for it.
class FlushDenormals {
 public:
  FlushDenormals();
  ~FlushDenormals();
  FlushDenormals(const FlushDenormals&) = delete;

 private:
  unsigned saved_;
};

}  // namespace afterglow
