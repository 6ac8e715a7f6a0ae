// SPDX-License-Identifier: MIT
#include "player/shared_source.hpp"

#include <algorithm>
#include <optional>
#include <vector>

namespace relit::player {

class SharedSource::Cursor final : public container::ByteSource {
 public:
  explicit Cursor(std::shared_ptr<SharedSource> shared)
      : shared_(std::move(shared)), buffer_(kBufferBytes), size_(shared_->source_->size()) {}
  ~Cursor() override {
    const std::lock_guard lock(shared_->mutex_);
    if (shared_->expects_ == this) shared_->expects_ = nullptr;
  }

  Result<std::size_t> read(std::span<std::uint8_t> out) override {
    if (position_ < buffer_begin_ || position_ >= buffer_begin_ + buffered_) {
      if (out.size() >= kBufferBytes) return read_shared(out);
      buffered_ = 0;
      buffer_begin_ = position_;
      RELIT_ASSIGN(buffered_, read_ahead());
    }
    const auto at = static_cast<std::size_t>(position_ - buffer_begin_);
    const std::size_t bytes = std::min(out.size(), buffered_ - at);
    std::copy_n(buffer_.begin() + static_cast<std::ptrdiff_t>(at), bytes, out.begin());
    position_ += bytes;
    return bytes;
  }

  [[nodiscard]] std::optional<std::uint64_t> size() const override { return size_; }
  [[nodiscard]] bool seekable() const override { return true; }

  Status seek(std::uint64_t offset_bytes) override {
    position_ = offset_bytes;
    return {};
  }

  void expect(std::uint64_t begin_bytes, std::uint64_t end_bytes) override {
    expect_begin_ = begin_bytes;
    expect_end_ = end_bytes;
    const std::lock_guard lock(shared_->mutex_);
    if (shared_->expects_ == this) shared_->expects_ = nullptr;
  }

 private:
  /// Headers are a few bytes, and every change of turns may cost a request.
  static constexpr std::size_t kBufferBytes = 16384;

  Result<std::size_t> read_shared(std::span<std::uint8_t> out) {
    RELIT_ASSIGN(const std::size_t got, shared_->read_at(*this, position_, out));
    position_ += got;
    return got;
  }
  Result<std::size_t> read_ahead() {
    // Nothing is fetched that nobody has announced.
    std::size_t bytes = kBufferBytes;
    if (position_ >= expect_begin_ && position_ < expect_end_) {
      bytes = static_cast<std::size_t>(std::min<std::uint64_t>(bytes, expect_end_ - position_));
    }
    return shared_->read_at(*this, position_, std::span(buffer_).first(bytes));
  }

  friend class SharedSource;
  std::shared_ptr<SharedSource> shared_;
  std::vector<std::uint8_t> buffer_;
  std::uint64_t buffer_begin_ = 0;
  std::size_t buffered_ = 0;
  std::optional<std::uint64_t> size_;
  std::uint64_t position_ = 0;
  std::uint64_t expect_begin_ = 0, expect_end_ = 0;
};

Result<std::shared_ptr<SharedSource>> SharedSource::create(
    std::unique_ptr<container::ByteSource> source) {
  if (!source->seekable())
    return fail(ErrorCode::kUnsupported,
                "a source that only goes forward cannot be read at several places at once");
  return std::shared_ptr<SharedSource>(new SharedSource(std::move(source)));
}

std::unique_ptr<container::ByteSource> SharedSource::cursor() {
  return std::make_unique<Cursor>(shared_from_this());
}

Result<std::size_t> SharedSource::read_at(const Cursor& cursor, std::uint64_t position,
                                          std::span<std::uint8_t> out) {
  const std::lock_guard lock(mutex_);
  if (expects_ != &cursor && cursor.expect_end_ > 0) {
    source_->expect(cursor.expect_begin_, cursor.expect_end_);
    expects_ = &cursor;
  }
  if (!position_ || *position_ != position) {
    position_.reset();
    RELIT_TRY(source_->seek(position));
    position_ = position;
  }
  auto got = source_->read(out);
  if (got)
    *position_ += *got;
  else
    position_.reset();
  return got;
}

}  // namespace relit::player
