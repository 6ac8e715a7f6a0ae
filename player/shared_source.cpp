// SPDX-License-Identifier: MIT
#include "player/shared_source.hpp"
namespace relit::player {
class SharedSource::Cursor final : public container::ByteSource {
 public:
  explicit Cursor(std::shared_ptr<SharedSource> s) : s_(std::move(s)) {}
  Result<std::size_t> read(std::span<std::uint8_t> out) override {
    const std::scoped_lock l(s_->mutex_);
    RELIT_TRY(s_->source_->seek(at_));
    RELIT_ASSIGN(const std::size_t n, s_->source_->read(out));
    at_ += n;
    return n;
  }
  std::optional<std::uint64_t> size() const override { return s_->source_->size(); }
  bool seekable() const override { return true; }
  Status seek(std::uint64_t o) override {
    at_ = o;
    return {};
  }
  std::shared_ptr<SharedSource> s_;
  std::uint64_t at_ = 0;
};
Result<std::shared_ptr<SharedSource>> SharedSource::create(
    std::unique_ptr<container::ByteSource> s) {
  return std::shared_ptr<SharedSource>(new SharedSource(std::move(s)));
}
std::unique_ptr<container::ByteSource> SharedSource::cursor() {
  return std::make_unique<Cursor>(shared_from_this());
}
}  // namespace relit::player
