// SPDX-License-Identifier: GPL-3.0-or-later
// Dictionaries of nodes to a Graph: see the top of python/afterglow/_native.pyi for the form. Meaning is the compiler's
// affair; here only the form is checked.
#include "module/bindings.h"

namespace afterglow {

namespace {

std::string text_of(const py::handle& value, const std::string& what) {
  if (!py::isinstance<py::str>(value)) throw InvalidInput(what + " must be a string");
  return value.cast<std::string>();
}

bool is_link(const py::handle& value) {
  if (!py::isinstance<py::tuple>(value) && !py::isinstance<py::list>(value)) return false;
  const auto items = py::reinterpret_borrow<py::sequence>(value);
  return items.size() == 3 && py::isinstance<py::str>(items[0]);
}

Link link_from(const py::handle& value, size_t count, const std::string& what) {
  if (!is_link(value)) throw InvalidInput(what + " must be (\"link\", node index, output name)");
  const auto items = py::reinterpret_borrow<py::sequence>(value);
  if (items[0].cast<std::string>() != "link" || !py::isinstance<py::int_>(items[1]))
    throw InvalidInput(what + " must be (\"link\", node index, output name)");
  const int64_t node = items[1].cast<int64_t>();
  if (node < 0 || node >= int64_t(count))
    throw InvalidInput(what + " links to node " + std::to_string(node) + " of " + std::to_string(count));
  return {uint32_t(node), text_of(items[2], what + "'s output name")};
}

bool is_number(const py::handle& value) {
  return PyFloat_Check(value.ptr()) || PyLong_Check(value.ptr()) || PyNumber_Check(value.ptr());
}

float number_from(const py::handle& value, const std::string& what) {
  const double number = PyFloat_AsDouble(value.ptr());
  if (number == -1.0 && PyErr_Occurred()) {
    PyErr_Clear();
    throw InvalidInput(what + " must be a number");
  }
  return float(number);
}

InputValue input_from(const py::handle& value, size_t count, const std::string& what) {
  if (is_link(value)) return link_from(value, count, what);
  if (PySequence_Check(value.ptr()) && !py::isinstance<py::str>(value) && PySequence_Size(value.ptr()) > 0) {
    const auto items = py::reinterpret_borrow<py::sequence>(value);
    if (items.size() < 2 || items.size() > 4) throw InvalidInput(what + " must be a number, 2 to 4 numbers or a link");
    Vec3 v(0.0f);
    for (size_t k = 0; k < std::min<size_t>(items.size(), 3); ++k) v[int(k)] = number_from(items[k], what);
    return v;
  }
  PyErr_Clear();
  if (!is_number(value)) throw InvalidInput(what + " must be a number, 2 to 4 numbers or a link");
  return number_from(value, what);
}

Param param_from(const py::handle& value, const std::string& what) {
  if (value.is_none()) return std::monostate{};
  if (PyBool_Check(value.ptr())) return value.cast<bool>();
  if (py::isinstance<py::str>(value)) return value.cast<std::string>();
  if (PyLong_Check(value.ptr())) return value.cast<int64_t>();
  if (PyFloat_Check(value.ptr())) return value.cast<double>();
  if (PyIndex_Check(value.ptr()) && !py::isinstance<py::array>(value))
    return py::int_(py::reinterpret_borrow<py::object>(value)).cast<int64_t>();
  auto array = py::array_t<float, py::array::c_style | py::array::forcecast>::ensure(value);
  if (!array) {
    PyErr_Clear();
    throw InvalidInput(what + " must be None, a flag, a number, a string or an array of numbers");
  }
  if (array.ndim() == 0) return double(*array.data());
  return std::vector<float>(array.data(), array.data() + array.size());
}

py::dict dict_of(const py::dict& node, const char* key, const std::string& what) {
  if (!node.contains(key)) return {};
  const py::object value = node[key];
  if (value.is_none()) return {};
  if (!py::isinstance<py::dict>(value)) throw InvalidInput(what + "'s " + key + " must be a dictionary");
  return value;
}

Node node_from(const py::handle& value, size_t index, size_t count, const std::string& owner) {
  std::string what = owner + ": node " + std::to_string(index);
  if (!py::isinstance<py::dict>(value)) throw InvalidInput(what + " must be a dictionary");
  const auto dict = py::reinterpret_borrow<py::dict>(value);
  if (!dict.contains("type")) throw InvalidInput(what + " has no 'type'");
  Node node;
  node.type = text_of(dict["type"], what + "'s type");
  node.name = dict.contains("name") ? text_of(dict["name"], what + "'s name") : node.type;
  what += " '" + node.name + "'";
  for (const auto& [key, input] : dict_of(dict, "inputs", what)) {
    const std::string name = text_of(key, what + ": an input's name");
    if (input.is_none()) continue;
    node.inputs[name] = input_from(input, count, what + ": input '" + name + "'");
  }
  for (const auto& [key, param] : dict_of(dict, "params", what)) {
    const std::string name = text_of(key, what + ": a parameter's name");
    node.params[name] = param_from(param, what + ": parameter '" + name + "'");
  }
  return node;
}

}  // namespace

Graph graph_from_python(const py::handle& value, const std::string& owner) {
  if (!py::isinstance<py::dict>(value)) throw InvalidInput(owner + ": a graph must be a dictionary");
  const auto dict = py::reinterpret_borrow<py::dict>(value);
  if (!dict.contains("nodes")) throw InvalidInput(owner + ": a graph needs 'nodes'");
  const py::object nodes = dict["nodes"];
  if (!PySequence_Check(nodes.ptr())) throw InvalidInput(owner + ": 'nodes' must be a list");
  const auto list = py::reinterpret_borrow<py::sequence>(nodes);
  Graph graph;
  for (size_t i = 0; i < list.size(); ++i) graph.nodes.push_back(node_from(list[i], i, list.size(), owner));
  if (dict.contains("surface") && !dict["surface"].is_none())
    graph.surface = link_from(dict["surface"], list.size(), owner + ": 'surface'");
  return graph;
}

}  // namespace afterglow
