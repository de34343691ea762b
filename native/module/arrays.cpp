// SPDX-License-Identifier: GPL-3.0-or-later
// numpy arrays as columns: see arrays.h.
#include "module/arrays.h"

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace afterglow {

namespace {

std::string shape_of(const py::array& array) {
  std::string text = "(";
  for (py::ssize_t k = 0; k < array.ndim(); ++k) text += (k ? ", " : "") + std::to_string(array.shape(k));
  return text + ")";
}

py::array any_array(const py::handle& value, const std::string& what) {
  py::array array = py::array::ensure(value);
  if (!array) {
    PyErr_Clear();
    throw InvalidInput(what + " must be an array");
  }
  return array;
}

char kind_of(const py::array& array) { return array.dtype().kind(); }

template <class T>
py::array converted(const py::array& array, const std::string& what) {
  py::array out = py::array_t<T, py::array::forcecast>::ensure(array);
  if (!out) {
    PyErr_Clear();
    throw InvalidInput(what + " holds values that are no numbers");
  }
  return out;
}

Column column_of(py::array array, const std::string& what, size_t width, size_t item) {
  const bool flat = array.ndim() == 1 && width <= 1;
  const bool table =
      array.ndim() == 2 && (width == 0 ? array.shape(1) >= 1 && array.shape(1) <= 4 : size_t(array.shape(1)) == width);
  if (!flat && !table) {
    const std::string wanted = width == 0 ? "(N, 1 to 4)" : width == 1 ? "(N,)" : "(N, " + std::to_string(width) + ")";
    throw InvalidInput(what + " must have the shape " + wanted + ", not " + shape_of(array));
  }
  Column out;
  out.item = item;
  out.rows = size_t(array.shape(0));
  out.width = flat ? 1 : size_t(array.shape(1));
  out.row_stride = array.strides(0);
  out.item_stride = flat ? py::ssize_t(item) : array.strides(1);
  if (out.width == 1) out.item_stride = py::ssize_t(item);
  out.data = static_cast<const char*>(array.data());
  out.keep = std::move(array);
  return out;
}

}  // namespace

Column float_column(const py::handle& value, const std::string& what, size_t width) {
  if (!value || value.is_none()) return {};
  py::array array = any_array(value, what);
  const char kind = kind_of(array);
  if (kind != 'f' && kind != 'i' && kind != 'u' && kind != 'b') throw InvalidInput(what + " must hold numbers");
  if (!py::isinstance<py::array_t<float>>(array)) array = converted<float>(array, what);
  return column_of(array, what, width, 4);
}

Column index_column(const py::handle& value, const std::string& what, size_t width) {
  if (!value || value.is_none()) return {};
  py::array array = any_array(value, what);
  const char kind = kind_of(array);
  if (kind != 'i' && kind != 'u' && array.size() > 0) throw InvalidInput(what + " must hold integers");
  if (array.itemsize() == 8 && array.size() > 0) {  // beyond 32 bits is out of range, not something else
    auto wide = py::array_t<int64_t, py::array::c_style | py::array::forcecast>::ensure(array);
    std::vector<py::ssize_t> shape(wide.shape(), wide.shape() + wide.ndim());
    py::array_t<uint32_t> narrow(shape);
    for (py::ssize_t i = 0; i < wide.size(); ++i) {
      const int64_t x = wide.data()[i];
      narrow.mutable_data()[i] = x < 0 || x >= int64_t(kNone) ? kNone : uint32_t(x);
    }
    array = narrow;
  } else if (!py::isinstance<py::array_t<int32_t>>(array) && !py::isinstance<py::array_t<uint32_t>>(array)) {
    array = converted<int32_t>(array, what);
  }
  return column_of(array, what, width, 4);
}

Column flag_column(const py::handle& value, const std::string& what) {
  if (!value || value.is_none()) return {};
  py::array array = any_array(value, what);
  if (!py::isinstance<py::array_t<bool>>(array) && !py::isinstance<py::array_t<uint8_t>>(array))
    array = converted<bool>(array, what);
  return column_of(array, what, 1, 1);
}

void expect_large_pages([[maybe_unused]] void* data, [[maybe_unused]] size_t bytes) {
#if defined(__linux__)
  constexpr uintptr_t page = uintptr_t(1) << 21;
  const uintptr_t first = (reinterpret_cast<uintptr_t>(data) + page - 1) & ~(page - 1);
  const uintptr_t last = (reinterpret_cast<uintptr_t>(data) + bytes) & ~(page - 1);
  if (last > first) madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);  // a hint: may fail
#endif
}

DMat4 matrix_from_python(const py::handle& value, const std::string& what) {
  const std::vector<DMat4> all = matrices_from_python(value, what);
  if (all.size() != 1) throw InvalidInput(what + " must be one 4 x 4 matrix");
  return all[0];
}

std::vector<DMat4> matrices_from_python(const py::handle& value, const std::string& what) {
  auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(value);
  if (!array) {
    PyErr_Clear();
    throw InvalidInput(what + " must be 4 x 4 matrices");
  }
  const auto n = array.ndim();
  if (n < 2 || n > 3 || array.shape(n - 1) != 4 || array.shape(n - 2) != 4)
    throw InvalidInput(what + " must have the shape (N, 4, 4), not " + shape_of(array));
  const size_t count = n == 3 ? size_t(array.shape(0)) : 1;
  std::vector<DMat4> out(count);
  const double* from = array.data();
  for (DMat4& m : out)
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column) m[column][row] = *from++;
  return out;
}

}  // namespace afterglow
