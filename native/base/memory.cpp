// SPDX-License-Identifier: GPL-3.0-or-later
// See memory.h: glibc keeps what lies between pieces that are in use.
#include "base/memory.h"

#include <cstdlib>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace afterglow {

void release_free_memory() {
#if defined(__GLIBC__)
  malloc_trim(0);
#endif
}

}  // namespace afterglow
