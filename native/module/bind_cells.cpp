// SPDX-License-Identifier: GPL-3.0-or-later
// The HashCache's parts for the benchmark and the tests: the paper's own structure over a scene, what its records and
// the table's keep, keys, and the speed of look-ups.
#include <shared_mutex>

#include "methods/hash_cache/cuckoo.h"
#include "methods/hash_cache/healing.h"
#include "methods/hash_cache/measure.h"
#include "methods/hash_cache/occupied.h"
#include "module/queries.h"

namespace afterglow {

namespace {

using Points = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Keys = py::array_t<uint32_t, py::array::c_style | py::array::forcecast>;

Vec3 relative(const double* p, const DVec3& origin) { return Vec3(DVec3(p[0], p[1], p[2]) - origin); }

/// The structure of the HashCache's paper over a scene, which of the points lie in occupied cells, and what these hold
/// when the points' light has arrived.
py::dict occupied_cells(const PyScene& self, int levels, const py::handle& points, unsigned threads,
                        const py::handle& normals, const py::handle& light) {
  if (levels < 0 || levels > hash_cache::Occupied::kFinest)
    throw InvalidInput("occupied_cells: levels must be from 0 to " + std::to_string(hash_cache::Occupied::kFinest));
  const Points at = numbers<double>(points, "points", 3);
  const auto n = py::ssize_t(at.shape(0));
  const Points facing = numbers<double>(normals, "normals", 3), sent = numbers<double>(light, "light", 3);
  if (facing.shape(0) != sent.shape(0) || (sent.shape(0) && sent.shape(0) != n))
    throw InvalidInput("occupied_cells: normals and light must have a row for each point, or none");
  py::array_t<int64_t> index({py::ssize_t(levels) + 1, n});
  py::array_t<float> kept({py::ssize_t(levels) + 1, sent.shape(0), py::ssize_t(3)});
  int64_t* to = index.mutable_data();
  float* shown = kept.mutable_data();
  const auto vector = [](const Points& rows, py::ssize_t i) {
    return Vec3(float(rows.at(i, 0)), float(rows.at(i, 1)), float(rows.at(i, 2)));
  };
  hash_cache::Occupied occupied;
  {
    const py::gil_scoped_release free;
    const std::shared_lock<std::shared_mutex> lock(self.core->use);
    const Scene& scene = self.core->scene;
    occupied.build(scene, levels, threads);
    for (py::ssize_t i = 0; i < sent.shape(0); ++i)
      occupied.add(relative(at.data() + 3 * i, scene.origin()), vector(facing, i), vector(sent, i), 0, 0, uint32_t(i));
    for (int level = 0; level <= levels; ++level)
      for (py::ssize_t i = 0; i < n; ++i) {
        const uint32_t found = occupied.index(relative(at.data() + 3 * i, scene.origin()), level);
        *to++ = found == kNone ? -1 : int64_t(found);
        if (!sent.shape(0)) continue;
        Rgb value(0.0f);
        if (found != kNone)
          value =
              occupied.levels()[size_t(level)].data(found).unpack().light[!hash_cache::faces_front(vector(facing, i))];
        for (int c = 0; c < 3; ++c) *shown++ = value[c];
      }
  }
  py::list cells, blocks, maps, map_bytes, data_bytes;
  for (const hash_cache::OccupiedLevel& level : occupied.levels()) {
    cells.append(level.cells());
    blocks.append(level.blocks());
    maps.append(level.maps());
    map_bytes.append(level.map_bytes());
    data_bytes.append(level.data_bytes());
  }
  py::dict out;
  out["cells"] = cells, out["blocks"] = blocks, out["maps"] = maps, out["map_bytes"] = map_bytes, out["data_bytes"] = data_bytes;
  out["index"] = index, out["light"] = kept;
  out["peak_bytes"] = occupied.peak_bytes();
  out["seconds_mark"] = occupied.seconds_mark(), out["seconds_maps"] = occupied.seconds_maps();
  return out;
}

/// The paper's map over these keys, with so many slots for each at first: what it answers for `asked` (the key's place
/// among the keys, or -1), and how often it was built anew.
py::dict cuckoo_map(const Keys& keys, double usage, const Keys& asked) {
  if (!(usage > 0.0 && usage < 100.0)) throw InvalidInput("cuckoo_map: usage must be above 0 and below 100");
  std::vector<hash_cache::Block> blocks(size_t(keys.size()));
  for (size_t i = 0; i < blocks.size(); ++i) blocks[i] = {{1u, uint32_t(i)}, keys.data()[i]};
  hash_cache::CuckooMap map;
  map.build(blocks, usage);
  py::list found;
  for (py::ssize_t i = 0; i < asked.size(); ++i) {
    const hash_cache::BlockCells* block = map.find(asked.data()[i]);
    found.append(block ? int64_t(block->first) : int64_t(-1));
  }
  py::dict out;
  out["found"] = found, out["attempts"] = map.attempts(), out["bytes"] = map.bytes();
  return out;
}

py::dict measure_lookups(uint64_t cells, uint64_t lookups) {
  if (cells < 1 || cells > (uint64_t(1) << 28)) throw InvalidInput("measure_lookups: cells must be from 1 to 2^28");
  hash_cache::LookupSpeeds speeds;
  {
    const py::gil_scoped_release free;
    speeds = hash_cache::measure_lookups(cells, lookups);
  }
  py::dict out;
  out["table"] = speeds.table, out["map"] = speeds.map, out["reads"] = speeds.reads;
  out["table_bytes"] = speeds.table_bytes, out["map_bytes"] = speeds.map_bytes;
  return out;
}

py::array_t<uint64_t> cell_keys(const py::array_t<int64_t, py::array::c_style | py::array::forcecast>& cells) {
  if (cells.ndim() != 2 || cells.shape(1) != 5) throw InvalidInput("cell_keys: cells must be an array (N, 5)");
  std::vector<hash_cache::Cell> of;
  for (py::ssize_t i = 0; i < cells.shape(0); ++i) {
    const int64_t* c = cells.data(i, 0);
    of.push_back({int32_t(c[0]), int32_t(c[1]), int32_t(c[2]), uint32_t(c[3]), uint32_t(c[4])});
  }
  const std::vector<uint64_t> keys = hash_cache::keys_of(of);
  return py::array_t<uint64_t>(py::ssize_t(keys.size()), keys.data());
}

py::dict updated_cell(float light, uint32_t count, const py::handle& sums, uint32_t samples) {
  const Points given = numbers<double>(sums, "sums", 3);
  if (!samples) throw InvalidInput("updated_cell: samples must be 1 or more");
  std::vector<Rgb> all;
  for (py::ssize_t i = 0; i < given.shape(0); ++i)
    all.emplace_back(float(given.at(i, 0)), float(given.at(i, 1)), float(given.at(i, 2)));
  const hash_cache::Updated found = hash_cache::updated_cell(Rgb(light), count, all, samples);
  py::dict out;
  out["light"] = py::make_tuple(found.light.x, found.light.y, found.light.z);
  out["count"] = found.count;
  return out;
}

/// A record of the paper's structure after updates, each with a normal, a sum of samples, their number and the frame.
py::dict both_sides(const py::handle& normals, const py::handle& sums, const py::handle& samples,
                    const py::handle& frames, uint32_t changed) {
  const Points facing = numbers<double>(normals, "normals", 3), given = numbers<double>(sums, "sums", 3);
  const auto counts = numbers<int64_t>(samples, "samples", 1), at = numbers<int64_t>(frames, "frames", 1);
  const py::ssize_t n = given.shape(0);
  if (facing.shape(0) != n || counts.shape(0) != n || at.shape(0) != n)
    throw InvalidInput("both_sides: normals, sums, samples and frames must have as many rows");
  hash_cache::BothSidesRecord record;
  for (py::ssize_t i = 0; i < n; ++i) {
    if (counts.at(i) < 1) throw InvalidInput("both_sides: samples must be 1 or more");
    record.add(Vec3(float(facing.at(i, 0)), float(facing.at(i, 1)), float(facing.at(i, 2))),
               Rgb(float(given.at(i, 0)), float(given.at(i, 1)), float(given.at(i, 2))), uint32_t(counts.at(i)),
               uint32_t(at.at(i)), changed, uint32_t(i));
  }
  const hash_cache::BothSides found = record.unpack();
  const auto row = [](const Vec3& v) { return py::make_tuple(v.x, v.y, v.z); };
  py::dict out;
  out["front"] = row(found.light[0]), out["back"] = row(found.light[1]), out["normal"] = row(found.normal);
  out["counts"] = py::make_tuple(found.count[0], found.count[1]), out["frame"] = found.frame;
  out["bytes"] = sizeof(record);
  return out;
}

}  // namespace

void bind_cells(py::module_& m) {
  m.def("occupied_cells", &occupied_cells, py::arg("scene"), py::arg("levels"),
        py::arg("points") = py::array_t<double>(std::vector<py::ssize_t>{0, 3}), py::arg("threads") = 0,
        py::arg("normals") = py::array_t<double>(std::vector<py::ssize_t>{0, 3}),
        py::arg("light") = py::array_t<double>(std::vector<py::ssize_t>{0, 3}));
  m.def("cuckoo_map", &cuckoo_map, py::arg("keys"), py::arg("usage"), py::arg("asked"));
  m.def("measure_lookups", &measure_lookups, py::arg("cells"), py::arg("lookups"));
  m.def("samples_worth", &hash_cache::samples_worth, py::arg("samples"), py::arg("doubt"));
  m.def("cell_keys", &cell_keys, py::arg("cells"));
  m.def("updated_cell", &updated_cell, py::arg("light"), py::arg("count"), py::arg("sums"), py::arg("samples") = 1);
  m.def("both_sides", &both_sides, py::arg("normals"), py::arg("sums"), py::arg("samples"), py::arg("frames"),
        py::arg("changed") = 0);
}

}  // namespace afterglow
