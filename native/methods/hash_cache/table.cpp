// SPDX-License-Identifier: GPL-3.0-or-later
// Sort, reduce, insert, level after level: see table.h (Roth et al. 2020, 3.2, last paragraph).
#include "methods/hash_cache/table.h"

#include <algorithm>

#include "base/parallel.h"

namespace afterglow::hash_cache {

namespace {

using KeyIndex = std::pair<uint64_t, uint32_t>;
constexpr size_t kBlock = 4096;
constexpr size_t kFullest = 10, kOf = 16;  // slots that may be taken, in sixteenths

/// Keys and indices of the samples, grouped by the keys' first byte and in the samples' order within each group.
std::vector<KeyIndex> grouped(std::span<const Sample> samples, unsigned threads,
                              std::array<size_t, Table::kParts + 1>& first) {
  const size_t blocks = (samples.size() + kBlock - 1) / kBlock;
  std::vector<uint64_t> keys(samples.size());
  std::vector<std::array<uint32_t, Table::kParts>> at(blocks);
  parallel_blocks(samples.size(), kBlock, threads, [&](size_t begin, size_t end) {
    auto& counts = at[begin / kBlock];
    counts.fill(0);
    for (size_t i = begin; i < end; ++i) counts[(keys[i] = key_of(samples[i].cell)) >> 56]++;
  });
  uint32_t sum = 0;
  for (uint32_t part = 0; part < Table::kParts; ++part) {
    first[part] = sum;
    for (auto& counts : at) {
      const uint32_t n = counts[part];
      counts[part] = sum;
      sum += n;
    }
  }
  first[Table::kParts] = sum;
  std::vector<KeyIndex> order(samples.size());
  parallel_blocks(samples.size(), kBlock, threads, [&](size_t begin, size_t end) {
    auto& next = at[begin / kBlock];
    for (size_t i = begin; i < end; ++i) order[next[keys[i] >> 56]++] = {keys[i], uint32_t(i)};
  });
  return order;
}

}  // namespace

void Record::add(const Rgb& sum, uint32_t n, uint32_t stamp) {
  const uint32_t all = std::min(count() + n, kMostSamples);
  const float share = float(n) / float(std::max(all, n));
  light += share * (sum / float(n) - light);
  light = glm::max(light, Rgb(0.0f));  // rounding may go a hair below
  word = all << 12 | (stamp & (kStamps - 1));
}

Record& Table::Part::slot(uint64_t key) {
  for (size_t i = home(key);; i = i + 1 == slots.size() ? 0 : i + 1)
    if (slots[i].key == key || !slots[i].key) return slots[i];
}

void Table::Part::resize(size_t count) {
  std::vector<Record> old(count);
  old.swap(slots);
  for (const Record& r : old)
    if (r.key) slot(r.key) = r;
}

void Table::Part::reserve(size_t more, size_t most) {
  const size_t needed = (used + more) * kOf / kFullest + 2;
  if (needed > slots.size()) resize(std::max(needed, std::min(most, slots.size() + slots.size() / 2)));
}

void Table::Part::drop_older(uint32_t age, uint32_t stamp) {
  std::vector<Record> kept;
  for (const Record& r : slots)
    if (r.key && ((stamp - r.stamp()) & (Record::kStamps - 1)) <= age) kept.push_back(r);
  std::fill(slots.begin(), slots.end(), Record{});
  for (const Record& r : kept) slot(r.key) = r;
  used = kept.size();
}

/// When the new cells do not fit: the longest without a sample go, until a quarter of the part is free.
void Table::make_room(Part& part, size_t fresh, uint32_t stamp, TableCounts& counts) const {
  const size_t most = part_limit() * kFullest / kOf;
  if (part.used + fresh <= most) return;
  std::vector<uint32_t> with_age(Record::kStamps, 0);
  for (const Record& r : part.slots)
    if (r.key) with_age[(stamp - r.stamp()) & (Record::kStamps - 1)]++;
  const size_t wanted = most - std::min(most, std::max(fresh, most / 4));
  size_t kept = with_age[0];
  uint32_t age = 0;
  while (age + 1 < Record::kStamps && kept + with_age[age + 1] <= wanted) kept += with_age[++age];
  if (kept == part.used) return;
  counts.evicted += part.used - kept;
  part.drop_older(age, stamp);
}

void Table::reduce(std::span<const Sample> samples, std::span<const KeyIndex> order, uint32_t stamp, Part& part,
                   Reduced& out) const {
  std::vector<KeyIndex> sorted(order.begin(), order.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<uint64_t> keys;
  size_t fresh = 0;
  for (size_t i = 0; i < sorted.size();) {
    const uint64_t key = sorted[i].first;
    Sample sum = samples[sorted[i].second];
    for (++i; i < sorted.size() && sorted[i].first == key; ++i) {
      const Sample& s = samples[sorted[i].second];
      sum.light += s.light;
      sum.count += s.count;
    }
    out.cells.push_back(sum);
    keys.push_back(key);
    fresh += part.slots.empty() || !part.slot(key).key;
  }
  make_room(part, fresh, stamp, out.counts);
  const size_t most = part_limit() * kFullest / kOf;
  part.reserve(std::min(fresh, most - std::min(most, part.used)), part_limit());
  if (part.slots.empty()) {
    out.counts.refused += keys.size();
    return;
  }
  for (size_t i = 0; i < keys.size(); ++i) {
    Record& record = part.slot(keys[i]);
    if (!record.key) {
      if (part.used >= most) {
        out.counts.refused++;
        continue;
      }
      record.key = keys[i];
      part.used++;
      out.counts.added++;
    }
    record.add(out.cells[i].light, out.cells[i].count, stamp);
  }
}

uint64_t Table::add(std::vector<Sample> samples, uint32_t stamp, unsigned threads, StopToken stop) {
  // A level at a time, from the finest: what is reduced there is all that the next one needs.
  std::array<std::vector<Sample>, kTopLevel + 1> begins;
  for (const Sample& s : samples) begins[std::min<uint32_t>(s.cell.level, kTopLevel)].push_back(s);
  samples.clear();
  uint64_t touched = 0;
  for (int level = 0; level <= kTopLevel && !stop.stop(); ++level) {
    samples.insert(samples.end(), begins[level].begin(), begins[level].end());
    if (samples.empty()) continue;
    std::array<size_t, kParts + 1> first;
    const std::vector<KeyIndex> order = grouped(samples, threads, first);
    std::vector<Reduced> reduced(kParts);
    parallel_blocks(kParts, 8, threads, [&](size_t begin, size_t end) {
      for (size_t p = begin; p < end; ++p)
        if (first[p] < first[p + 1])
          reduce(samples, std::span(order).subspan(first[p], first[p + 1] - first[p]), stamp, parts_[p], reduced[p]);
    });
    samples.clear();
    for (const Reduced& r : reduced) {
      counts_.added += r.counts.added, counts_.evicted += r.counts.evicted, counts_.refused += r.counts.refused;
      touched += r.cells.size();
      for (Sample s : r.cells) {
        s.cell = parent(s.cell);
        samples.push_back(s);
      }
    }
  }
  return touched;
}

void Table::clear() {
  for (Part& part : parts_) part = Part{};
  counts_ = TableCounts{};
}

void Table::forget(uint32_t most) {
  for (Part& part : parts_)
    for (Record& r : part.slots) r.word = std::min(r.count(), most) << 12 | r.stamp();
}

size_t Table::size() const {
  size_t sum = 0;
  for (const Part& part : parts_) sum += part.used;
  return sum;
}

size_t Table::bytes() const {
  size_t sum = sizeof(*this);
  for (const Part& part : parts_) sum += part.slots.capacity() * sizeof(Record);
  return sum;
}

std::vector<Record> Table::sorted() const {
  std::vector<Record> all;
  all.reserve(size());
  for (const Part& part : parts_) {
    const size_t begin = all.size();
    for (const Record& r : part.slots)
      if (r.key) all.push_back(r);
    std::sort(all.begin() + ptrdiff_t(begin), all.end(),
              [](const Record& a, const Record& b) { return a.key < b.key; });
  }
  return all;
}

void Table::restore(std::span<const Record> records) {
  clear();
  std::array<size_t, kParts> counts{};
  for (const Record& r : records) counts[r.key >> 56]++;
  for (uint32_t p = 0; p < kParts; ++p)
    if (counts[p]) parts_[p].reserve(counts[p], counts[p]);
  for (const Record& r : records) {
    Part& part = parts_[r.key >> 56];
    part.slot(r.key) = r;
    part.used++;
  }
}

}  // namespace afterglow::hash_cache
