// SPDX-License-Identifier: GPL-3.0-or-later
// Ratios and their doubts, from the largest regions to the smallest: see healing.h.
#include "methods/hash_cache/healing.h"

#include <algorithm>

#include "base/sampler.h"

namespace afterglow::hash_cache {

namespace {

constexpr uint32_t kAPlace = 16;        // probes of a region
constexpr double kPrior = 4.0;          // probes that what is known of the larger region counts for
constexpr double kDoubtPrior = 0.5;     // the same of the share that no ratio explains
constexpr float kWorth = 1.0f;          // squared noise of a sample over that of a change which nothing explains
constexpr float kLeast = 6.0f;          // samples: what counts for less is not worth its bias
constexpr double kSure = 5.0;           // a ratio that is off by less than the root of this errors is chance
constexpr float kCertain = 1e-3f;       // doubt below which light may as well be unchanged
constexpr float kMostDoubtful = 24.0f;  // samples that other light counts for at most; paths may not end in so few
constexpr float kMostRatio = 64.0f;
constexpr int kOwnLevels = 3;              // regions of one object's side, up to eight times as wide as the smallest
constexpr uint32_t kAnyone = 0x7fffffffu;  // owner of regions that hold all objects

double sum(const Rgb& c) { return double(c.x) + double(c.y) + double(c.z); }

Cell at_level(const Cell& c, int level) {
  const int up = level - int(c.level);
  return {c.x >> up, c.y >> up, c.z >> up, c.owner, uint32_t(level)};
}
Cell of_anyone(Cell c) {
  c.owner = kAnyone;
  return c;
}

/// Samples of one region: sums first, then, when the ratio is known, residuals.
struct Sums {
  Cell cell;
  Rgb before{0.0f}, after{0.0f};
  double off = 0.0, weight = 0.0, squares = 0.0;
  uint32_t probes = 0;
  std::vector<uint32_t> members;
  Change change;
};

/// The region's own ratio as far as it is surer than how far it is from the larger region's (kin; the whole has none).
void find_change(Sums& s, const Change& larger, std::span<const Rgb> before, std::span<const Rgb> after, bool kin) {
  const double prior = kin ? kPrior : 1.0;
  Change& c = s.change;
  c = larger;
  if (s.members.size() > 1) {
    const double n = double(s.members.size()), few = n / (n - 1.0) * (1.0 + 16.0 / (n * n));
    for (int i = 0; i < 3; ++i) {
      if (!(s.before[i] > 0.0f)) continue;
      const float own = std::min(s.after[i] / s.before[i], kMostRatio);
      double squares = 0.0, light = 0.0;
      for (const uint32_t m : s.members) {
        const double expected = double(own) * double(before[m][i]), found = double(after[m][i]);
        const double most = std::max({found, expected, double(c.ratio[i]) * double(before[m][i])});
        squares += (found - expected) * (found - expected);
        light += most * most;
      }
      if (!(light > 0.0)) continue;
      // Few paths agree by chance: what is known of the larger region's spread joins.
      c.spread[i] = float((n * squares / light + prior * double(larger.spread[i])) / (n + prior));
      const double away = double(own - c.ratio[i]) * double(s.before[i]), chance = double(c.spread[i]) * light * few;
      const double share = !kin ? 1.0 : away != 0.0 ? std::max(0.0, 1.0 - kSure * chance / (away * away)) : 0.0;
      c.ratio[i] += float(share) * (own - c.ratio[i]);
    }
  }
  double off = 0.0, weight = 0.0, squares = 0.0;
  for (const uint32_t m : s.members) {
    const Rgb expected = c.ratio * before[m];
    const double w = sum(glm::max(expected, after[m]));
    off += sum(glm::abs(after[m] - expected));
    weight += w, squares += w * w;
  }
  const double count = squares > 0.0 ? weight * weight / squares : 0.0;  // dark ones tell nothing
  const double share = weight > 0.0 ? off / weight : 0.0;
  const double known = std::min(prior, kDoubtPrior);
  const double f = (count * share + known * double(larger.unexplained)) / (count + known);
  c.unexplained = float(f);
  c.doubt = float(f * f + f * (1.0 - f) / (count + known + 1.0));
}

}  // namespace

uint32_t samples_worth(uint32_t samples, float doubt) {
  if (!samples) return 0;
  const float worth = 1.0f / (1.0f / float(samples) + std::max(doubt, 0.0f) / kWorth);
  if (doubt <= kCertain) return uint32_t(std::ceil(worth));
  return worth < kLeast ? 0u : uint32_t(std::min(worth, kMostDoubtful));
}

void Healing::clear() {
  probes_.clear();
  used_ = next_ = 0;
  edits_.clear();
  whole_ = Change{};
}

void Healing::keep(const Grid& grid, std::span<const Probe> found) {
  if (probes_.empty()) probes_.resize(kProbes);
  for (const Probe& p : found) {
    const int level = std::min(p.level + kRegionLevels, kTopLevel);
    const uint64_t key = key_of(grid.cell(p.point.position, owner_of(p.point.instance, p.point.face_normal), level));
    const uint32_t lot = hash(hash(uint32_t(p.point.x) | uint32_t(p.point.y) << 16, p.point.sample, p.seed)) % kAPlace;
    Probe& place = probes_[mix(key + lot) % kProbes];
    used_ += !place.seed;
    place = p;
    place.seed |= !place.seed;
  }
}

std::vector<Probe> Healing::next_probes(size_t most) {
  std::vector<Probe> next;
  for (size_t seen = 0; seen < probes_.size() && next.size() < most; ++seen, next_ = (next_ + 1) % kProbes)
    if (probes_[next_].seed) next.push_back(probes_[next_]);
  return next;
}

void Healing::restore(uint32_t place, const Probe& probe) {
  if (probes_.empty()) probes_.resize(kProbes);
  used_ += !probes_[place].seed;
  probes_[place] = probe;
}

void Healing::edit(const Grid& grid, std::span<const Rgb> now, std::vector<uint32_t> forgotten, uint32_t stamp,
                   uint32_t most) {
  std::vector<Rgb> before(probes_.size());
  std::unordered_map<uint64_t, Sums> regions;
  std::array<std::vector<uint64_t>, kTopLevel + 1> levels;
  Sums whole;
  const auto join = [&](Sums& s, uint32_t i) {
    s.before += before[i], s.after += now[i];
    s.members.push_back(i);
  };
  for (uint32_t i = 0; i < probes_.size(); ++i) {
    Probe& p = probes_[i];
    if (!p.seed) continue;
    if (std::binary_search(forgotten.begin(), forgotten.end(), p.point.instance) || !is_finite(now[i])) {
      p = Probe{};
      used_--;
      continue;
    }
    before[i] = p.light;
    p.light = now[i];
    join(whole, i);
    const int own = std::min(p.level + kRegionLevels, kTopLevel);
    const Cell cell = grid.cell(p.point.position, owner_of(p.point.instance, p.point.face_normal), own);
    const auto file = [&](const Cell& c) {
      const uint64_t key = key_of(c);
      const auto [at, made] = regions.try_emplace(key);
      if (made) at->second.cell = c, levels[c.level].push_back(key);
      join(at->second, i);
    };
    for (int level = own; level <= kTopLevel; ++level) {
      const Cell c = at_level(cell, level);
      if (level <= own + kOwnLevels) file(c);
      if (level > own) file(of_anyone(c));
    }
  }
  Change nothing;
  nothing.unexplained = 0.5f;
  find_change(whole, nothing, before, now, false);
  Edit edit{stamp, most, std::move(forgotten), {}, whole.change};
  for (int level = kTopLevel; level >= 0; --level)
    for (const uint64_t key : levels[size_t(level)]) {
      Sums& s = regions[key];
      const Change* prior = &whole.change;
      if (level < kTopLevel) {
        // An object that ends here is told more of by what stands around it than by itself.
        auto larger = regions.find(key_of(parent(s.cell)));
        if (larger == regions.end() || larger->second.members.size() < 2 * s.members.size())
          larger = regions.find(key_of(of_anyone(parent(s.cell))));
        if (larger != regions.end()) prior = &larger->second.change;
      }
      find_change(s, *prior, before, now, true);
      edit.regions.emplace(key, s.change);
    }
  whole_ = edit.whole;
  edits_.push_back(std::move(edit));
}

bool Healing::due() const { return active() && (edits_.size() > kEdits || stamp_ - edits_.front().stamp > kOldest); }

uint32_t Healing::retire() {
  const uint32_t age = stamp_ - edits_.front().stamp;
  edits_.pop_front();
  return age;
}

Change Healing::change_at(const Edit& edit, const Cell& cell) {
  const int first = std::min(int(cell.level) + kRegionLevels, kTopLevel);
  for (int level = first; level <= std::min(first + kOwnLevels, kTopLevel); ++level)
    if (const auto at = edit.regions.find(key_of(at_level(cell, level))); at != edit.regions.end()) return at->second;
  for (int level = first; level <= kTopLevel; ++level)
    if (const auto at = edit.regions.find(key_of(of_anyone(at_level(cell, level)))); at != edit.regions.end()) {
      Change change = at->second;
      change.doubt = std::max(change.doubt, edit.whole.doubt);  // a neighbour's probes may stand in other light
      return change;
    }
  return edit.whole;
}

Known Healing::mended(const Record& r, const Cell& cell) const {
  const uint32_t owner = cell.owner & ~kOnTheWay;
  Cell place = cell;
  place.owner = owner;
  Known k{r.light(), r.count(), r.age(stamp_)};
  for (auto edit = edits_.rbegin(); edit != edits_.rend() && k.count; ++edit) {
    if (k.age <= stamp_ - edit->stamp) break;
    if (std::binary_search(edit->forgotten.begin(), edit->forgotten.end(), owner / 8u)) return {};
    const Change change = change_at(*edit, place);
    k.light = glm::min(k.light * change.ratio, Rgb(1e30f));
    k.count = std::min(samples_worth(k.count, change.doubt), edit->most);
  }
  return k;
}

size_t Healing::bytes() const {
  size_t bytes = probes_.capacity() * sizeof(Probe);
  for (const Edit& e : edits_) bytes += e.regions.size() * (sizeof(Change) + 32) + e.forgotten.size() * 4;
  return bytes;
}

}  // namespace afterglow::hash_cache
