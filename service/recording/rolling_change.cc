// SPDX-License-Identifier: Apache-2.0
// How a recording goes on in its next file.
#include <exception>
#include <iterator>
#include <system_error>
#include <utility>

#include "no_memory.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/service/recording/rolling_recording.h"
#include "recording_room.h"

namespace prescene::service {
namespace {

// Half of what McapReader reads.
constexpr std::uint64_t kMostIndexBytes = std::uint64_t{32} << 20;
constexpr std::uint64_t kMostChunks = std::uint64_t{1} << 19;

}  // namespace

bool RollingRecording::is_full(core::TimeNs now_ns) const {
  const PartLimits& limits = options_.part;
  const interfaces::McapWriter::Size size = writer_->size();
  return (limits.seconds > 0.0 && now_ns - began_ns_ >= core::ns_of(limits.seconds)) ||
         (limits.bytes > 0 && size.bytes >= own_bytes_ + limits.bytes) || size.index_bytes >= kMostIndexBytes ||
         size.chunks >= kMostChunks;
}

bool RollingRecording::wants_file(core::TimeNs now_ns) {
  const bool has_waited = !tried_ns_ || now_ns - *tried_ns_ >= core::ns_of(options_.pause);
  if (writer_) return has_waited && (is_asked_ || is_full(now_ns));
  if (!has_waited) return false;
  std::error_code error;
  const auto folder = first_.parent_path().empty() ? std::filesystem::path(".") : first_.parent_path();
  const std::filesystem::space_info space = std::filesystem::space(folder, error);
  if (error || space.available >= options_.room) return true;
  tried_ns_ = now_ns;
  ++state_.tries;
  state_.failure = folder.string() + ": " + interfaces::size_text(space.available) + " are free; from " +
                   interfaces::size_text(options_.room) + " on the recording goes on";
  return false;
}

core::Result<RollingRecording::Ready> RollingRecording::made_ready(std::uint64_t number) {
  PRESCENE_TRY(const auto file, NewFile::create(part_path(first_, number)));
  PRESCENE_TRY(auto writer, RecordingWriter::make_ready(file->path(), info_, options_.safety));
  Ready ready{std::move(writer), file->path()};
  file->keep();
  return ready;
}

void RollingRecording::begin_making_ready(core::TimeNs now_ns) {
  tried_ns_ = now_ns;
  if (!writer_) ++state_.tries;
  work([this, number = next_number_] {
    core::Result<Ready> made = result_of<core::Result<Ready>>([&] { return made_ready(number); });
    const std::lock_guard lock(mutex_);
    ready_ = std::move(made);
  });
  is_making_ready_ = true;
  ++next_number_;
}

void RollingRecording::take_snapshot() {
  std::optional<std::pair<std::uint64_t, core::Result<std::string>>> taken;
  {
    const std::lock_guard lock(mutex_);
    taken = std::exchange(snapshot_, std::nullopt);
  }
  if (!taken || !writer_ || taken->first != number_) return;
  core::Status why = taken->second.status();
  if (why.ok()) {
    own_bytes_ += taken->second->size();
    try {
      take(writer_->write_snapshot(*taken->second));
      return;
    } catch (...) {
      why = status_of_exception();
    }
  }
  assign(why.message(), state_.without_belief);
  core::log(
      log_, core::LogLevel::kWarning,
      state_.file.string() + " replays to the same bits only after the files before it: " + state_.without_belief);
}

void RollingRecording::take_results() {
  std::vector<core::Status> closed;
  std::vector<RemovedFile> removed;
  std::uint64_t unfinished = 0;
  core::Status last_unfinished;
  {
    const std::lock_guard lock(mutex_);
    closed.swap(closed_);
    removed.swap(removed_);
    unfinished = std::exchange(unfinished_, 0);
    std::swap(last_unfinished, last_unfinished_);
  }
  state_.unfinished += unfinished;
  if (unfinished > 0) assign(last_unfinished.message(), state_.last_unfinished);
  state_.interruptions += closed.size();
  if (!closed.empty() && failed_.ok()) note_first_failure(closed.front());
  for (const auto& [path, why_not] : removed) {
    assign(why_not, state_.not_removed);
    if (!why_not.empty()) continue;
    ++state_.removed;
    std::erase(kept_, path);
  }
  // All is counted by now: where there is no memory for words, some are not said.
  if (unfinished > 0)
    core::log(log_, core::LogLevel::kWarning,
              "a job of the recording was left unfinished: " + state_.last_unfinished + "; the recording goes on");
  for (const core::Status& status : closed)
    core::log(log_, core::LogLevel::kError, status.message() + "; the recording goes on in the next file");
  for (const auto& [path, why_not] : removed)
    if (!why_not.empty()) core::log(log_, core::LogLevel::kWarning, why_not);
}

bool RollingRecording::is_change_due() {
  take_results();
  take_snapshot();
  if (!is_making_ready_) {
    if (wants_file(now_ns_)) begin_making_ready(now_ns_);
    return false;
  }
  core::Status why;
  {
    const std::lock_guard lock(mutex_);
    if (!ready_) return false;
    if (*ready_) return true;
    why = ready_->status();
    ready_.reset();
  }
  is_making_ready_ = false;
  std::error_code error;
  if (!std::filesystem::exists(std::filesystem::symlink_status(part_path(first_, next_number_ - 1), error)))
    --next_number_;
  if (!writer_) {
    assign(why.message(), state_.failure);
  } else {
    core::log(log_, core::LogLevel::kWarning, "no new file could be begun: " + why.message());
  }
  return false;
}

void RollingRecording::change(Snapshot snapshot) {
  std::optional<Ready> ready;
  {
    const std::lock_guard lock(mutex_);
    if (!ready_ || !*ready_) return;
    ready = *std::move(*ready_);
    ready_.reset();
  }
  is_making_ready_ = false;
  std::function<void()> write_belief;
  try {
    if (snapshot)
      write_belief = [this, snapshot = std::move(snapshot), number = next_number_ - 1] {
        auto text = result_of<core::Result<std::string>>(snapshot);
        const std::lock_guard lock(mutex_);
        snapshot_.emplace(number, std::move(text));
      };
    kept_.push_back(ready->path);
  } catch (...) {  // There is no memory yet. The file before goes on.
    put_aside(*std::move(ready), status_of_exception());
    return;
  }
  const bool is_on_again = writer_ == nullptr;
  try {
    begin_file(*std::move(ready));
    if (write_belief && writer_) work(std::move(write_belief));
  } catch (...) {
    interrupt(status_of_exception());
  }
  if (is_on_again && writer_) core::log(log_, core::LogLevel::kInfo, "recording goes on in " + state_.file.string());
  remove_oldest();
}

void RollingRecording::put_aside(Ready ready, const core::Status& why) {
  tried_ns_ = now_ns_;
  ++state_.unfinished;
  assign(why.message(), state_.last_unfinished);
  ready.writer.reset();
  std::error_code error;
  std::filesystem::remove(ready.path, error);
  --next_number_;
  core::log(log_, core::LogLevel::kWarning, "no new file could be begun: " + why.message());
}

void RollingRecording::begin_file(Ready ready) {
  is_asked_ = false;
  close_later(std::exchange(writer_, std::move(ready.writer)), true);
  number_ = next_number_ - 1;
  ++state_.files;
  state_.file = std::move(ready.path);
  state_.failure.clear();
  state_.without_belief.clear();
  told_not_repeated_ = false;
  info_.part.number = number_;
  info_.part.first_message = next_index_;
  info_.part.began_ns = began_ns_ = now_ns_;
  info_.part.after_gap = std::exchange(has_gap_, false);
  tried_ns_.reset();
  take(writer_->begin(info_));
  if (writer_)
    take(repeated_.each([this](const interfaces::ReceivedMessage& message, MessageIndex index) {
      return writer_->write_again(message, index);
    }));
  if (writer_) take(writer_->flush());
  if (writer_) own_bytes_ = writer_->size().bytes;
}

void RollingRecording::remove_oldest() {
  if (!room_) return;
  work([this, own = std::vector<std::filesystem::path>(kept_.begin(), kept_.end())] {
    std::vector<RemovedFile> removed = room_->make_room(own);
    const std::lock_guard lock(mutex_);
    removed_.insert(removed_.end(), std::move_iterator(removed.begin()), std::move_iterator(removed.end()));
  });
}

}  // namespace prescene::service
