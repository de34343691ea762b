// SPDX-License-Identifier: GPL-3.0-or-later
// What g++ 12 calls in glibc and libstdc++ and Blender's oldest hosts (glibc 2.28, GCC 8's libstdc++) do not have yet.
// Linked, hidden, into the packaged module alone. Layouts are those of the Itanium C++ ABI as libstdc++ froze them.
#include <pthread.h>

#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <new>

extern "C" {
char __libc_single_threaded = 0;  // glibc 2.32: true lets libstdc++ leave out atomics; never here
void __cxa_free_exception(void*) noexcept;
}

namespace {

// __cxa_refcounted_exception stands directly before the thrown object: the count first, then __cxa_exception, whose second
// word is the object's destructor.
constexpr std::ptrdiff_t kHeader = 128;
constexpr std::ptrdiff_t kDestructor = kHeader - 16 - 8;

int* count_of(void* thrown) { return reinterpret_cast<int*>(static_cast<char*>(thrown) - kHeader); }

}  // namespace

namespace std {

void __throw_bad_array_new_length() { throw bad_array_new_length(); }  // GCC 11

void condition_variable::wait(unique_lock<mutex>& lock) noexcept {  // GCC 12 gave it a new version
  pthread_cond_wait(native_handle(), lock.mutex()->native_handle());
}

namespace __exception_ptr {

void exception_ptr::_M_addref() noexcept {  // GCC 11 exports what was inside before
  if (_M_exception_object) __atomic_add_fetch(count_of(_M_exception_object), 1, __ATOMIC_ACQ_REL);
}

void exception_ptr::_M_release() noexcept {
  if (!_M_exception_object) return;
  if (__atomic_sub_fetch(count_of(_M_exception_object), 1, __ATOMIC_ACQ_REL) == 0) {
    auto destroy = *reinterpret_cast<void (**)(void*)>(static_cast<char*>(_M_exception_object) - kDestructor);
    if (destroy) destroy(_M_exception_object);
    __cxa_free_exception(_M_exception_object);
  }
  _M_exception_object = nullptr;
}

}  // namespace __exception_ptr
}  // namespace std
