// SPDX-License-Identifier: MIT
#include "player/memory_plan.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "player/memory_account.hpp"

namespace relit::player {
namespace {

constexpr std::uint64_t kLeastRing = 2;
constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

std::uint64_t total(const std::vector<MemoryTerm>& terms) {
  std::uint64_t sum = 0;
  for (const MemoryTerm& term : terms) sum += term.heap_bytes + term.gpu_bytes;
  return sum;
}

std::uint64_t default_ring(const container::ClipRecord& clip) {
  const double rate =
      static_cast<double>(clip.tick_rate.num) / static_cast<double>(clip.tick_rate.den) *
      static_cast<double>(clip.frame_count) / static_cast<double>(clip.duration_ticks);
  return static_cast<std::uint64_t>(std::clamp(rate / 4, 4.0, 16.0));
}

/// The clips of a plan, the one that it is about first.
class Accounts {
 public:
  static Result<Accounts> create(const container::FileContents& contents,
                                 const SegmentScale& segments, const MemoryWishes& wishes) {
    Accounts accounts;
    RELIT_ASSIGN(auto first, MemoryAccount::create(contents, segments, wishes));
    accounts.clips_.push_back(std::move(first));
    MemoryWishes other = wishes;
    for (const std::string& clip : wishes.others) {
      other.clip = clip;
      // The segments of others are not known.
      RELIT_ASSIGN(auto account, MemoryAccount::create(contents, {}, other));
      accounts.clips_.push_back(std::move(account));
    }
    return accounts;
  }

  [[nodiscard]] const MemoryAccount& first() const { return clips_.front(); }
  /// Of the most layers that a clip has.
  [[nodiscard]] std::size_t layer_count() const {
    std::size_t most = 0;
    for (const MemoryAccount& clip : clips_) most = std::max(most, clip.layer_count());
    return most;
  }
  [[nodiscard]] std::uint64_t frame_bytes(std::size_t layers) const {
    std::uint64_t most = 0;
    for (const MemoryAccount& clip : clips_) most = std::max(most, clip.frame_bytes(layers));
    return most;
  }
  [[nodiscard]] std::uint64_t segment_bytes() const {
    std::uint64_t most = 0;
    for (const MemoryAccount& clip : clips_) most = std::max(most, clip.segment_bytes());
    return most;
  }
  /// Of the two that take most.
  [[nodiscard]] std::vector<MemoryTerm> terms(MemoryChoice choice) const {
    choice.frame_bytes = frame_bytes(choice.layers);
    choice.segment_bytes = segment_bytes();
    const MemoryAccount *most = nullptr, *second = nullptr;
    std::uint64_t most_bytes = 0, second_bytes = 0;
    for (const MemoryAccount& clip : clips_) {
      const std::uint64_t bytes = clips_.size() > 1 ? clip.own_bytes(choice) : 0;
      if (most == nullptr || bytes > most_bytes) {
        second = std::exchange(most, &clip);
        second_bytes = std::exchange(most_bytes, bytes);
      } else if (second == nullptr || bytes > second_bytes) {
        second = &clip;
        second_bytes = bytes;
      }
    }
    return most->terms(choice, second);
  }

 private:
  std::vector<MemoryAccount> clips_;
};

Result<MemoryChoice> wished(const Accounts& accounts, const MemoryWishes& wishes) {
  const MemoryAccount& account = accounts.first();
  if (wishes.threads < 1 || wishes.threads > 64) {
    return fail(ErrorCode::kInvalid, "threads are 1 to 64, not " + std::to_string(wishes.threads));
  }
  if (wishes.ring_frames == 1) {
    return fail(ErrorCode::kInvalid, "a ring has at least two frames");
  }
  if (wishes.layers == 0) return fail(ErrorCode::kInvalid, "at least one layer is needed");
  MemoryChoice choice;
  const std::uint64_t ring =
      wishes.ring_frames > 0 ? wishes.ring_frames : default_ring(account.clip());
  choice.ring_frames = std::max(kLeastRing, std::min(ring, account.clip().frame_count));
  choice.threads = wishes.threads;
  choice.path = account.drawn() ? wishes.path : CompositePath::kCpu;
  choice.light_map = wishes.light_map == gles::LightMapFormat::kAuto
                         ? gles::LightMapFormat::kHalfFloat
                         : wishes.light_map;
  choice.layers = accounts.layer_count();
  if (wishes.layers > 0) {
    choice.layers = std::min(choice.layers, static_cast<std::size_t>(wishes.layers));
  }
  return choice;
}

/// The ways in which each thing can be given up, best first.
class Search {
 public:
  Search(const Accounts& account, const MemoryChoice& wish, std::uint64_t budget)
      : account_(account), wish_(wish), budget_(budget) {
    paths_ = {wish.path};
    if (wish.path == CompositePath::kAuto) {
      paths_.insert(paths_.end(),
                    {CompositePath::kCpu, CompositePath::kTexture, CompositePath::kFused});
    }
    formats_ = {wish.light_map};
    if (account.first().drawn() && wish.light_map != gles::LightMapFormat::kSquareRoot8) {
      formats_.push_back(gles::LightMapFormat::kSquareRoot8);
    }
  }

  /// The smallest of all plans.
  [[nodiscard]] MemoryChoice least() const {
    MemoryChoice choice = wish_;
    choice.ring_frames = kLeastRing, choice.threads = 1, choice.layers = 1;
    choice.light_map = formats_.back();
    choice.path = cheapest_path(choice);
    return choice;
  }

  /// From what is given up last to what is given up first, the best that leaves room for the rest.
  /// Requires least() to fit.
  [[nodiscard]] MemoryChoice best() const {
    MemoryChoice choice = least();
    choice.layers = 1 + largest(wish_.layers - 1, [&](std::size_t more) {
                      MemoryChoice c = choice;
                      c.layers = 1 + more;
                      c.path = cheapest_path(c);
                      return c;
                    });
    choice.path = cheapest_path(choice);
    for (const gles::LightMapFormat format : formats_) {
      MemoryChoice c = choice;
      c.light_map = format;
      c.path = cheapest_path(c);
      if (!fits(c)) continue;
      choice = c;
      break;
    }
    MemoryChoice any = choice;
    any.path = wish_.path;
    if (fits(any)) choice = any;
    choice.threads = 1 + static_cast<int>(largest(static_cast<std::size_t>(wish_.threads - 1),
                                                  [&](std::size_t more) {
                                                    MemoryChoice c = choice;
                                                    c.threads = 1 + static_cast<int>(more);
                                                    return c;
                                                  }));
    choice.ring_frames =
        kLeastRing + largest(wish_.ring_frames - kLeastRing, [&](std::size_t more) {
          MemoryChoice c = choice;
          c.ring_frames = kLeastRing + more;
          return c;
        });
    return choice;
  }

  [[nodiscard]] bool fits(const MemoryChoice& choice) const {
    return total(account_.terms(choice)) <= budget_;
  }

 private:
  [[nodiscard]] CompositePath cheapest_path(MemoryChoice choice) const {
    std::uint64_t least = kUnlimited;
    CompositePath best = paths_.back();
    for (const CompositePath path : paths_) {
      choice.path = path;
      const std::uint64_t bytes = total(account_.terms(choice));
      if (bytes >= least) continue;
      least = bytes;
      best = path;
    }
    return best;
  }

  /// The largest n up to `most` whose choice fits: more of anything never takes less.
  [[nodiscard]] std::size_t largest(std::size_t most,
                                    const std::function<MemoryChoice(std::size_t)>& choice) const {
    std::size_t low = 0, high = most;
    while (low < high) {
      const std::size_t middle = high - (high - low) / 2;
      if (fits(choice(middle))) {
        low = middle;
      } else {
        high = middle - 1;
      }
    }
    return low;
  }

  const Accounts& account_;
  MemoryChoice wish_;
  std::uint64_t budget_;
  std::vector<CompositePath> paths_;
  std::vector<gles::LightMapFormat> formats_;
};

std::vector<std::string> given_up(const MemoryChoice& wish, const MemoryChoice& plan) {
  std::vector<std::string> out;
  const auto of = [](std::uint64_t now, std::uint64_t then) {
    return std::to_string(now) + " of " + std::to_string(then);
  };
  if (plan.ring_frames < wish.ring_frames)
    out.push_back("decoded ahead: " + of(plan.ring_frames, wish.ring_frames) + " frames");
  if (plan.threads < wish.threads)
    out.push_back("decode threads: " + of(static_cast<std::uint64_t>(plan.threads),
                                          static_cast<std::uint64_t>(wish.threads)));
  if (plan.path != wish.path)
    out.push_back(std::string("composite path: ") + composite_path_name(plan.path) +
                  " alone, nothing to choose from");
  if (plan.light_map != wish.light_map)
    out.push_back("light map: square roots of 8 bits in place of floats");
  if (plan.layers < wish.layers) out.push_back("layers: " + of(plan.layers, wish.layers));
  return out;
}

std::string mebibytes(std::uint64_t bytes) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%.1f MiB", static_cast<double>(bytes) / (1 << 20));
  return text.data();
}

}  // namespace

std::uint64_t MemoryPlan::heap_bytes() const {
  std::uint64_t sum = 0;
  for (const MemoryTerm& term : terms) sum += term.heap_bytes;
  return sum;
}

std::uint64_t MemoryPlan::gpu_bytes() const {
  std::uint64_t sum = 0;
  for (const MemoryTerm& term : terms) sum += term.gpu_bytes;
  return sum;
}

int MemoryPlan::layer_count() const {
  return static_cast<int>(std::count(layers.begin(), layers.end(), 1));
}

Result<std::uint64_t> smallest_budget(const container::FileContents& contents,
                                      const SegmentScale& segments, const MemoryWishes& wishes) {
  RELIT_ASSIGN(const Accounts account, Accounts::create(contents, segments, wishes));
  RELIT_ASSIGN(const MemoryChoice wish, wished(account, wishes));
  return total(account.terms(Search(account, wish, 0).least()));
}

Result<MemoryPlan> plan_memory(const container::FileContents& contents,
                               const SegmentScale& segments, const MemoryWishes& wishes,
                               std::optional<std::uint64_t> budget_bytes) {
  RELIT_ASSIGN(const Accounts account, Accounts::create(contents, segments, wishes));
  RELIT_ASSIGN(const MemoryChoice wish, wished(account, wishes));
  const std::uint64_t budget = budget_bytes.value_or(kUnlimited);
  const Search search(account, wish, budget);
  if (const MemoryChoice least = search.least(); !search.fits(least)) {
    const std::uint64_t needed = total(account.terms(least));
    return fail(ErrorCode::kOutOfMemory,
                "a memory budget of " + std::to_string(budget) +
                    " bytes does not suffice: clip \"" + account.first().clip().name +
                    "\" needs at least " + std::to_string(needed) + " (" + mebibytes(needed) + ")");
  }
  const MemoryChoice choice = search.best();
  MemoryPlan plan;
  plan.budget_bytes = budget;
  plan.ring_frames = choice.ring_frames;
  plan.frame_bytes = account.frame_bytes(choice.layers);
  plan.ring_bytes = plan.ring_frames * plan.frame_bytes;
  plan.threads = choice.threads;
  plan.decoder_threads = threads_of_decoder(choice.threads, choice.layers);
  plan.packet_bytes = account.segment_bytes();
  plan.layers.assign(account.layer_count(), 0);
  std::fill_n(plan.layers.begin(), choice.layers, std::uint8_t{1});
  plan.path = choice.path;
  plan.light_map = choice.light_map;
  plan.terms = account.terms(choice);
  plan.given_up = given_up(wish, choice);
  return plan;
}

Result<SegmentScale> largest_segment(container::Reader& reader, const container::ClipRecord& clip) {
  SegmentScale scale;
  if (!reader.seekable()) return scale;
  const auto index = reader.read_index();
  if (!index) {
    const ErrorCode code = index.error().code;
    if (code == ErrorCode::kIo || code == ErrorCode::kCancelled) return Unexpected{index.error()};
    return scale;
  }
  // A segment ends where the next one begins; only the last one has to say so itself.
  std::vector<container::IndexRecord::Entry> entries = index->segments;
  std::sort(entries.begin(), entries.end(),
            [](const auto& a, const auto& b) { return a.offset < b.offset; });
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (entries[i].clip_id != clip.id) continue;
    std::uint64_t bytes = 0;
    if (i + 1 < entries.size()) {
      bytes = entries[i + 1].offset - entries[i].offset;
    } else {
      RELIT_TRY(reader.seek_to_segment(entries[i]));
      RELIT_ASSIGN(const auto record, reader.next());
      if (!record) continue;
      if (const auto* segment = std::get_if<container::SegmentRecord>(&record->body)) {
        for (const auto& chunk : segment->chunks) bytes += chunk.chunk_bytes;
      }
    }
    scale.frames = std::max<std::uint64_t>(scale.frames, entries[i].frame_count);
    scale.bytes = std::max(scale.bytes, bytes);
  }
  return scale;
}

Result<std::uint64_t> parse_bytes(const std::string& text) {
  struct Suffix {
    const char* name;
    int shift;
  };
  constexpr std::array<Suffix, 11> kSuffixes{{{"", 0},
                                              {"B", 0},
                                              {"k", 10},
                                              {"K", 10},
                                              {"KiB", 10},
                                              {"M", 20},
                                              {"MiB", 20},
                                              {"m", 20},
                                              {"G", 30},
                                              {"GiB", 30},
                                              {"g", 30}}};
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value, std::chars_format::fixed);
  const std::string suffix(rest, end);
  const auto known = std::find_if(kSuffixes.begin(), kSuffixes.end(),
                                  [&](const Suffix& s) { return suffix == s.name; });
  const double bytes = known != kSuffixes.end() ? std::ldexp(value, known->shift) : -1.0;
  if (error != std::errc() || !(bytes >= 0) || bytes > 0x1p62) {
    return fail(ErrorCode::kInvalid,
                "\"" + text + "\" is no number of bytes such as 8388608, 512KiB, 8MiB or 1.5G");
  }
  return static_cast<std::uint64_t>(bytes);
}

}  // namespace relit::player
