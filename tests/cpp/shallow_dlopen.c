// SPDX-License-Identifier: GPL-3.0-or-later
// For the sanitizers, which end a program that loads a library by RTLD_DEEPBIND, as TBB does with its companion tbbbind when
// OpenImageDenoise asks for the machine's topology: the flag is taken away. tools/sanitized.sh builds and preloads it.
#define _GNU_SOURCE
#include <dlfcn.h>

void* dlopen(const char* path, int flags) {
  static void* (*next)(const char*, int);
  if (!next) *(void**)&next = dlsym(RTLD_NEXT, "dlopen");
  return next(path, flags & ~RTLD_DEEPBIND);
}
