// SPDX-License-Identifier: GPL-3.0-or-later
// Sort, reduce, insert, level after level: see table.h (Roth et al. 2020, 3.2, last paragraph).
#include "methods/hash_cache/table.h"

#include <algorithm>

#include "base/parallel.h"

namespace afterglow::hash_cache {

namespace {

using KeyIndex = std::pair<uint64_t, uint32_t>;
constexpr size_t kBlock = 4096;

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

Record& Table::slot(uint32_t p, uint64_t key) {
  const Part& part = parts_[p];
  for (uint32_t i = part.home(key);; i = part.next(i))
    for (Record& r : stores_[p].buckets[i].cells)
      if (r.tag == uint32_t(key) || !r.tag) return r;
}

void Table::put(uint32_t p, const Entry& entry) {
  Store& store = stores_[p];
  Record& r = slot(p, entry.key);
  r = entry.record;
  store.rest[size_t(&r - store.buckets.front().cells)] = uint32_t(entry.key >> 32);
}

template <class Function>
void Table::each(uint32_t p, const Function& function) const {
  const Store& store = stores_[p];
  for (size_t b = 0; b < store.buckets.size(); ++b)
    for (size_t k = 0; k < 4; ++k)
      if (const Record& r = store.buckets[b].cells[k]; r.tag)
        function(Entry{uint64_t(store.rest[4 * b + k]) << 32 | r.tag, r});
}

void Table::resize(uint32_t p, size_t count) {
  std::vector<Entry> kept;
  kept.reserve(stores_[p].used);
  each(p, [&](const Entry& e) { kept.push_back(e); });
  Store& store = stores_[p];
  store = Store{std::vector<Bucket>(count), std::vector<uint32_t>(4 * count), kept.size()};
  parts_[p] = {store.buckets.data(), uint32_t(count)};
  for (const Entry& e : kept) put(p, e);
}

void Table::reserve(uint32_t p, size_t more, size_t most) {
  const size_t count = stores_[p].buckets.size(), needed = (stores_[p].used + more) * kOf / kFullest + 1;
  if (needed > count) resize(p, std::max(needed, std::min(most, count + count / 2)));
}

/// At most so many of them, whichever they are.
void Table::keep_younger(uint32_t p, uint32_t age, uint32_t stamp, size_t most) {
  std::vector<Entry> kept;
  each(p, [&](const Entry& e) {
    if (e.record.age(stamp) <= age && kept.size() < most) kept.push_back(e);
  });
  Store& store = stores_[p];
  std::fill(store.buckets.begin(), store.buckets.end(), Bucket{});
  for (const Entry& e : kept) put(p, e);
  store.used = kept.size();
}

/// When the new cells do not fit: the longest without a sample go, until a quarter of the part is free.
void Table::make_room(uint32_t p, size_t fresh, uint32_t stamp, TableCounts& counts) {
  const size_t most = most_cells(), used = stores_[p].used;
  if (used + fresh <= most) return;
  std::vector<uint32_t> with_age(Record::kStamps, 0);
  each(p, [&](const Entry& e) { with_age[e.record.age(stamp)]++; });
  const size_t wanted = most - std::min(most, std::max(fresh, most / 4));
  size_t kept = with_age[0];
  uint32_t age = 0;
  while (age + 1 < Record::kStamps && kept + with_age[age + 1] <= wanted) kept += with_age[++age];
  if (kept == used && used <= most) return;
  keep_younger(p, age, stamp, most);
  counts.evicted += used - stores_[p].used;
}

void Table::set_limit(size_t bytes, uint32_t stamp) {
  limit_ = bytes;
  for (uint32_t p = 0; p < kParts; ++p) {
    make_room(p, 0, stamp, counts_);
    if (stores_[p].buckets.size() > most_buckets()) resize(p, most_buckets());
  }
}

void Table::keep_ages(uint32_t stamp) {
  static_assert(Record::kOld + kParts < Record::kStamps);
  for (Bucket& bucket : stores_[stamp % kParts].buckets)
    for (Record& r : bucket.cells)
      if (r.tag && r.age(stamp) > Record::kOld) r.set_age(Record::kOld, stamp);
}

void Table::reduce(std::span<const Sample> samples, std::span<const KeyIndex> order, uint32_t stamp, uint32_t salt,
                   const Mend& mend, uint32_t p, Reduced& out) {
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
    fresh += !find(key);
  }
  make_room(p, fresh, stamp, out.counts);
  Store& store = stores_[p];
  const size_t most = most_cells();
  reserve(p, std::min(fresh, most - std::min(most, store.used)), most_buckets());
  for (size_t i = 0; i < keys.size(); ++i) {
    Record& record = slot(p, keys[i]);
    if (!record.tag) {
      if (store.used >= most) {
        out.counts.refused++;
        continue;
      }
      record.tag = uint32_t(keys[i]);
      store.rest[size_t(&record - store.buckets.front().cells)] = uint32_t(keys[i] >> 32);
      store.used++;
      out.counts.added++;
    } else if (mend) {
      mend(record, out.cells[i].cell);
    }
    record.add(out.cells[i].light, out.cells[i].count, stamp, salt);
  }
}

uint64_t Table::add(std::vector<Sample> samples, uint32_t stamp, unsigned threads, StopToken stop, const Mend& mend) {
  // A level at a time, from the finest: what is reduced there is all that the next one needs.
  std::array<std::vector<Sample>, kTopLevel + 1> begins;
  for (const Sample& s : samples) begins[std::min<uint32_t>(s.cell.level, kTopLevel)].push_back(s);
  samples.clear();
  uint64_t touched = 0;
  adds_ = stamp == last_stamp_ ? adds_ + 1 : 0;
  last_stamp_ = stamp;
  const uint32_t salt = stamp * 0x9e3779b9u + adds_;
  for (int level = 0; level <= kTopLevel && !stop.stop(); ++level) {
    samples.insert(samples.end(), begins[level].begin(), begins[level].end());
    if (samples.empty()) continue;
    std::array<size_t, kParts + 1> first;
    const std::vector<KeyIndex> order = grouped(samples, threads, first);
    std::vector<Reduced> reduced(kParts);
    parallel_blocks(kParts, 8, threads, [&](size_t begin, size_t end) {
      for (size_t p = begin; p < end; ++p)
        if (first[p] < first[p + 1])
          reduce(samples, std::span(order).subspan(first[p], first[p + 1] - first[p]), stamp, salt, mend, uint32_t(p),
                 reduced[p]);
    });
    std::array<size_t, kParts + 1> begin_of;
    begin_of[0] = 0;
    for (uint32_t p = 0; p < kParts; ++p) {
      const Reduced& r = reduced[p];
      counts_.added += r.counts.added, counts_.evicted += r.counts.evicted, counts_.refused += r.counts.refused;
      begin_of[p + 1] = begin_of[p] + r.cells.size();
    }
    touched += begin_of[kParts];
    samples.resize(begin_of[kParts]);
    parallel_blocks(kParts, 8, threads, [&](size_t begin, size_t end) {
      for (size_t p = begin; p < end; ++p)
        for (size_t i = 0; i < reduced[p].cells.size(); ++i) {
          Sample& s = samples[begin_of[p] + i] = reduced[p].cells[i];
          s.cell = parent(s.cell);
        }
    });
  }
  return touched;
}

void Table::clear() {
  parts_.fill({});
  stores_.fill({});
  counts_ = TableCounts{};
  last_stamp_ = adds_ = 0;
}

void Table::drop_older(uint32_t age, uint32_t stamp) {
  for (uint32_t p = 0; p < kParts; ++p)
    if (stores_[p].used) keep_younger(p, age, stamp, stores_[p].used);
}

size_t Table::size() const {
  size_t sum = 0;
  for (const Store& store : stores_) sum += store.used;
  return sum;
}

size_t Table::bytes() const {
  size_t sum = sizeof(*this);
  for (const Store& store : stores_)
    sum += store.buckets.capacity() * sizeof(Bucket) + store.rest.capacity() * sizeof(uint32_t);
  return sum;
}

std::vector<Entry> Table::sorted() const {
  std::vector<Entry> all;
  all.reserve(size());
  for (uint32_t p = 0; p < kParts; ++p) {
    const auto begin = ptrdiff_t(all.size());
    each(p, [&](const Entry& e) { all.push_back(e); });
    std::sort(all.begin() + begin, all.end(), [](const Entry& a, const Entry& b) { return a.key < b.key; });
  }
  return all;
}

void Table::restore(std::span<const Entry> entries) {
  clear();
  std::array<size_t, kParts> counts{};
  for (const Entry& e : entries) counts[e.key >> 56]++;
  for (uint32_t p = 0; p < kParts; ++p)
    if (counts[p]) reserve(p, counts[p], 0);
  for (const Entry& e : entries) {
    put(uint32_t(e.key >> 56), e);
    stores_[e.key >> 56].used++;
  }
}

}  // namespace afterglow::hash_cache
