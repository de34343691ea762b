// SPDX-License-Identifier: GPL-3.0-or-later
// The exceptions that cross the module's border, one C++ type for each Python type. A message tells what is wrong, with
// which object, and how to mend it.
#pragma once

#include <stdexcept>
#include <string>

namespace afterglow {

struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};
struct InvalidInput : Error {
  using Error::Error;
};
struct InvalidHandle : Error {
  using Error::Error;
};
struct FileError : Error {
  using Error::Error;
};
struct Unsupported : Error {
  using Error::Error;
};
struct OutOfMemory : Error {
  using Error::Error;
};
struct Cancelled : Error {
  using Error::Error;
};

}  // namespace afterglow
