// SPDX-License-Identifier: GPL-3.0-or-later
// numpy arrays as the module reads them: strided, without a copy of numpy's making where the type already fits, and
// copied into our vectors without the GIL.
#pragma once

#include <cstring>

#include "module/bindings.h"

namespace afterglow {

/// A view of N rows of `width` items of 4 bytes (or 1: bytes). Holds the array; `take` needs no GIL.
struct Column {
  py::array keep;
  const char* data = nullptr;
  size_t rows = 0, width = 1, item = 4;
  py::ssize_t row_stride = 0, item_stride = 0;
  bool contiguous() const {
    return item_stride == py::ssize_t(item) && (row_stride == py::ssize_t(item * width) || rows <= 1);
  }
};

/// float32 as it is; other numbers are converted. None: an empty column. width 0: any of 1 to 4.
Column float_column(const py::handle& value, const std::string& what, size_t width);
/// int32 and uint32 as they are (negative ones become huge and thus out of range); other integers are converted.
Column index_column(const py::handle& value, const std::string& what, size_t width);
/// bool and uint8 as they are; other numbers become 0 or 1.
Column flag_column(const py::handle& value, const std::string& what);

/// Tells the system that this memory is about to be filled: page by page of 4 KB, filling costs more than copying.
void expect_large_pages(void* data, size_t bytes);

/// Copies every item of a column with gaps; the size is known to the compiler, so that no item costs a call.
template <size_t kItem>
void copy_items(const Column& column, char* to) {
  for (size_t row = 0; row < column.rows; ++row) {
    const char* from = column.data + py::ssize_t(row) * column.row_stride;
    for (size_t k = 0; k < column.width; ++k, from += column.item_stride, to += kItem) std::memcpy(to, from, kItem);
  }
}

/// The column's values as a vector of Out (whole rows, or single items).
template <class Out>
std::vector<Out> take(const Column& column) {
  std::vector<Out> out;
  const size_t bytes = column.rows * column.width * column.item;
  const size_t n = bytes / sizeof(Out);
  if (n == 0) return out;
  out.reserve(n + 16 / sizeof(Out) + 1);  // Embree may read 16 bytes beyond the last vertex
  expect_large_pages(out.data(), bytes);
  if (column.contiguous() && reinterpret_cast<uintptr_t>(column.data) % alignof(Out) == 0) {
    const Out* first = reinterpret_cast<const Out*>(column.data);
    out.assign(first, first + n);
    return out;
  }
  out.resize(n);
  char* to = reinterpret_cast<char*>(out.data());
  column.item == 1 ? copy_items<1>(column, to) : copy_items<4>(column, to);
  return out;
}

}  // namespace afterglow
