// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/rolling_recording.h"

#include <unistd.h>

#include <algorithm>
#include <exception>
#include <system_error>
#include <utility>

#include "prescene/core/clock.h"
#include "prescene/core/hash.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::service {
namespace {

// Half of what McapReader reads.
constexpr std::uint64_t kMostIndexBytes = std::uint64_t{32} << 20;
constexpr std::uint64_t kMostChunks = std::uint64_t{1} << 19;

/// Of no other recording.
std::string new_series(const std::filesystem::path& path) {
  core::Hasher hasher;
  hasher.text(path.string()).value(core::wall_now_ns()).value(core::steady_now_ns()).value(::getpid());
  return core::hash_text(hasher.digest());
}

/// What a job gives, also where it ends in an exception.
template <class Result>
Result result_of(const std::function<Result()>& job) {
  try {
    return job();
  } catch (const std::exception& error) {
    return core::unavailable(error.what());
  }
}

}  // namespace

core::Result<std::unique_ptr<RollingRecording>> RollingRecording::create(const std::filesystem::path& path,
                                                                         RecordingInfo info,
                                                                         const RollingOptions& options,
                                                                         core::LogSink log) {
  info.part = {new_series(path), 0, 0, core::steady_now_ns(), false};
  PRESCENE_TRY(auto writer, RecordingWriter::create(path, info, options.safety));
  std::unique_ptr<RollingRecording> recording(new RollingRecording(path, std::move(info), options, std::move(log)));
  recording->writer_ = std::move(writer);
  recording->own_bytes_ = recording->writer_->size().bytes;
  try {
    recording->thread_ = std::thread([raw = recording.get()] { raw->run(); });
  } catch (const std::system_error& error) {
    return core::unavailable(std::string("no thread can be started for the recording: ") + error.what());
  }
  return recording;
}

RollingRecording::RollingRecording(std::filesystem::path first, RecordingInfo info, const RollingOptions& options,
                                   core::LogSink log)
    : first_(std::move(first)),
      info_(std::move(info)),
      options_(options),
      log_(std::move(log)),
      repeated_(options.tf_static) {
  state_.file = first_;
  kept_.push_back(first_);
}

RollingRecording::~RollingRecording() { static_cast<void>(close()); }

void RollingRecording::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ends_ || !jobs_.empty(); });
    if (jobs_.empty()) return;
    const std::function<void()> job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    job();
    lock.lock();
  }
}

void RollingRecording::work(std::function<void()> job) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  changed_.notify_one();
}

void RollingRecording::fail(const core::Status& why) {
  if (!writer_) return;
  ++state_.interruptions;
  state_.failure = why.message();
  if (failed_.ok()) {
    failed_ = why;
    state_.first_failure = why.message();
  }
  core::log(log_, core::LogLevel::kError,
            why.message() + "; going on without recording, until a new file can be begun");
  has_gap_ = true;
  tried_ns_ = now_ns_;
  // Closing waits for the disk, and its errors were told.
  work([writer = std::shared_ptr<RecordingWriter>(std::move(writer_))]() mutable { writer.reset(); });
}

void RollingRecording::take(const core::Status& written) {
  if (!written.ok()) fail(written);
}

MessageIndex RollingRecording::write(const interfaces::ReceivedMessage& message) {
  now_ns_ = std::max(now_ns_, message.received_ns);
  if (began_ns_ == 0) began_ns_ = now_ns_;
  if (writer_) {
    take(writer_->write(message).status());
    if (!writer_) ++state_.lost_messages;
  } else {
    ++state_.lost_messages;
  }
  const MessageIndex index = next_index_++;
  try {
    repeated_.note(message, index);
  } catch (const std::exception&) {
    // There is no memory. The message is in the recording; a file that begins in the next seconds may lack it.
  }
  return index;
}

void RollingRecording::write_json(const std::string& topic, const std::string& json, core::TimeNs time_ns) {
  if (writer_) take(writer_->write_json(topic, json, time_ns));
}

void RollingRecording::write_output(const std::string& topic, const std::string& type,
                                    std::span<const std::uint8_t> cdr, core::TimeNs stamp_ns, core::TimeNs time_ns) {
  if (writer_) take(writer_->write_output(topic, type, cdr, stamp_ns, time_ns));
}

void RollingRecording::write_due(core::TimeNs now_ns) {
  now_ns_ = std::max(now_ns_, now_ns);
  if (began_ns_ == 0) began_ns_ = now_ns_;
  if (writer_) take(writer_->write_due(now_ns));
}

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

void RollingRecording::begin_making_ready(core::TimeNs now_ns) {
  is_making_ready_ = true;
  tried_ns_ = now_ns;
  if (!writer_) ++state_.tries;
  const std::uint64_t number = next_number_++;
  work([this, number] {
    std::filesystem::path path = part_path(first_, number);
    core::Result<Ready> made = result_of<core::Result<Ready>>([&]() -> core::Result<Ready> {
      std::error_code error;
      if (std::filesystem::exists(path, error))
        return core::unavailable(path.string() + ": is there already, and is not written over");
      auto writer = RecordingWriter::make_ready(path, info_, options_.safety);
      if (!writer) {
        std::filesystem::remove(path, error);
        return writer.status();
      }
      return Ready{*std::move(writer), path};
    });
    const std::lock_guard lock(mutex_);
    ready_ = std::move(made);
  });
}

void RollingRecording::take_results() {
  std::optional<std::pair<std::uint64_t, core::Result<std::string>>> snapshot;
  std::vector<core::Status> closed;
  std::vector<std::pair<std::filesystem::path, std::string>> removed;
  {
    const std::lock_guard lock(mutex_);
    snapshot = std::exchange(snapshot_, std::nullopt);
    closed.swap(closed_);
    removed.swap(removed_);
  }
  for (const core::Status& status : closed) {
    ++state_.interruptions;
    if (failed_.ok()) {
      failed_ = status;
      state_.first_failure = status.message();
    }
    core::log(log_, core::LogLevel::kError, status.message() + "; the recording goes on in the next file");
  }
  for (const auto& [path, why_not] : removed) {
    state_.not_removed = why_not;
    if (!why_not.empty()) {
      core::log(log_, core::LogLevel::kWarning, why_not);
      continue;
    }
    if (std::erase(kept_, path) > 0) ++state_.removed;
  }
  if (!snapshot || !writer_ || snapshot->first != number_) return;
  if (snapshot->second) {
    own_bytes_ += snapshot->second->size();
    take(writer_->write_snapshot(*snapshot->second));
    return;
  }
  state_.without_belief = snapshot->second.status().message();
  core::log(
      log_, core::LogLevel::kWarning,
      state_.file.string() + " replays to the same bits only after the files before it: " + state_.without_belief);
}

bool RollingRecording::is_change_due() {
  take_results();
  if (!is_making_ready_) {
    if (wants_file(now_ns_)) begin_making_ready(now_ns_);
    return false;
  }
  const std::lock_guard lock(mutex_);
  if (!ready_) return false;
  if (*ready_) return true;
  const core::Status why = ready_->status();
  ready_.reset();
  is_making_ready_ = false;
  std::error_code error;
  if (!std::filesystem::exists(part_path(first_, next_number_ - 1), error)) --next_number_;
  if (!writer_) {
    state_.failure = why.message();
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
  is_making_ready_ = is_asked_ = false;
  if (writer_) {
    work([this, old = std::shared_ptr<RecordingWriter>(std::move(writer_))] {
      const core::Status closed = result_of<core::Status>([&] { return old->close(); });
      const std::lock_guard lock(mutex_);
      if (!closed.ok()) closed_.push_back(closed);
    });
  } else {
    core::log(log_, core::LogLevel::kInfo, "recording goes on in " + ready->path.string());
  }
  writer_ = std::move(ready->writer);
  number_ = next_number_ - 1;
  ++state_.files;
  state_.file = ready->path;
  state_.failure.clear();
  state_.without_belief.clear();
  kept_.push_back(ready->path);
  info_.part = {info_.part.series, number_, next_index_, now_ns_, std::exchange(has_gap_, false)};
  began_ns_ = now_ns_;
  tried_ns_.reset();
  take(writer_->begin(info_));
  if (writer_)
    take(repeated_.each([this](const interfaces::ReceivedMessage& message, MessageIndex index) {
      return writer_->write_again(message, index);
    }));
  if (writer_) take(writer_->flush());
  if (writer_) own_bytes_ = writer_->size().bytes;
  if (snapshot && writer_) {
    work([this, snapshot = std::move(snapshot), number = number_] {
      auto text = result_of<core::Result<std::string>>(snapshot);
      const std::lock_guard lock(mutex_);
      snapshot_.emplace(number, std::move(text));
    });
  }
  remove_oldest();
}

void RollingRecording::remove_oldest() {
  if (options_.part.keep_bytes == 0) return;
  work([this, files = std::vector<std::filesystem::path>(kept_.begin(), kept_.end())] {
    std::uint64_t sum = 0;
    std::error_code error;
    const auto size_of = [&error](const std::filesystem::path& file) {
      const std::uintmax_t bytes = std::filesystem::file_size(file, error);
      return error ? std::uint64_t{0} : std::uint64_t{bytes};
    };
    for (const std::filesystem::path& file : files) sum += size_of(file);
    for (std::size_t i = 0; i + 2 < files.size() && sum > options_.part.keep_bytes; ++i) {
      const std::uint64_t bytes = size_of(files[i]);
      std::filesystem::remove(files[i], error);
      sum -= error ? 0 : bytes;
      const std::lock_guard lock(mutex_);
      removed_.emplace_back(files[i], error ? files[i].string() + " can't be removed: " + error.message() : "");
    }
  });
}

core::Status RollingRecording::close() {
  if (thread_.joinable()) {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    changed_.notify_one();
    thread_.join();  // after all that waits
    if (ready_ && *ready_) {
      const std::filesystem::path unused = (*ready_)->path;
      ready_.reset();
      std::error_code error;
      std::filesystem::remove(unused, error);
    }
    take_results();
  }
  if (writer_) {
    const core::Status closed = writer_->close();
    writer_.reset();
    if (failed_.ok()) failed_ = closed;
  }
  return failed_;
}

}  // namespace prescene::service
