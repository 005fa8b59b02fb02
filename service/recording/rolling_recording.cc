// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/rolling_recording.h"

#include <unistd.h>

#include <algorithm>
#include <exception>
#include <system_error>
#include <utility>

#include "no_memory.h"
#include "prescene/core/clock.h"
#include "prescene/core/hash.h"
#include "prescene/interfaces/bags/bag_writer.h"
#include "prescene/interfaces/bytes/text.h"
#include "recording_room.h"

namespace prescene::service {
namespace {

/// Of no other recording.
std::string new_series(const std::filesystem::path& path) {
  core::Hasher hasher;
  hasher.text(path.string()).value(core::wall_now_ns()).value(core::steady_now_ns()).value(::getpid());
  return core::hash_text(hasher.digest());
}

}  // namespace

core::Result<std::unique_ptr<RollingRecording>> RollingRecording::create(const std::filesystem::path& path,
                                                                         RecordingInfo info,
                                                                         const RollingOptions& options,
                                                                         core::LogSink log) {
  info.part = {.series = new_series(path), .began_ns = core::steady_now_ns()};
  if (options.part.keep_bytes > 0) {
    info.part.bounded_as = (options.asked.empty() ? path : options.asked).filename().string();
    info.part.first_file = path.filename().string();
  }
  std::unique_ptr<NewBagFolder> folder;
  if (options.as_bag) {
    PRESCENE_TRY(folder, NewBagFolder::create(path.parent_path()));
  }
  PRESCENE_TRY(const auto file, NewFile::create(path));
  PRESCENE_TRY(auto writer, RecordingWriter::create(path, info, options.safety));
  std::unique_ptr<RollingRecording> recording(new RollingRecording(path, std::move(info), options, std::move(log)));
  recording->writer_ = std::move(writer);
  recording->own_bytes_ = recording->writer_->size().bytes;
  try {
    recording->thread_ = std::thread([raw = recording.get()] { raw->run(); });
  } catch (const std::system_error& error) {
    return core::unavailable(std::string("no thread can be started for the recording: ") + error.what());
  }
  file->keep();
  if (folder) folder->keep();
  recording->remove_oldest();
  return recording;
}

RollingRecording::RollingRecording(std::filesystem::path first, RecordingInfo info, const RollingOptions& options,
                                   core::LogSink log)
    : first_(std::move(first)),
      info_(std::move(info)),
      options_(options),
      log_(std::move(log)),
      repeated_(info_.tf_static) {
  state_.file = first_;
  kept_.push_back(first_);
  if (options_.part.keep_bytes > 0)
    room_ = std::make_unique<RecordingRoom>(first_.parent_path().empty() ? "." : first_.parent_path(), info_.part,
                                            options_.part.keep_bytes);
}

RollingRecording::~RollingRecording() {
  static_cast<void>(result_of<core::Status>([this] { return close(); }));
}

void RollingRecording::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ends_ || !jobs_.empty(); });
    if (jobs_.empty()) return;
    std::function<void()> job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    core::Status why;
    try {
      job();
    } catch (...) {
      why = status_of_exception();
    }
    job = nullptr;  // with what it holds, while nobody waits
    lock.lock();
    if (why.ok()) continue;
    ++unfinished_;
    last_unfinished_ = std::move(why);
  }
}

void RollingRecording::work(std::function<void()> job) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  changed_.notify_one();
}

void RollingRecording::close_later(std::unique_ptr<RecordingWriter> writer, bool reports) {
  if (!writer) return;
  try {
    work([this, reports, old = std::shared_ptr<RecordingWriter>(std::move(writer))] {
      const core::Status closed = old->close();
      const std::lock_guard lock(mutex_);
      if (reports && !closed.ok()) closed_.push_back(closed);
    });
  } catch (const std::exception&) {  // It is closed by now, without a word of how.
    const std::lock_guard lock(mutex_);
    ++unfinished_;
    last_unfinished_ = status_of_exception();
  }
}

void RollingRecording::interrupt(const core::Status& why) {
  ++state_.interruptions;
  has_gap_ = true;
  tried_ns_ = now_ns_;
  close_later(std::move(writer_), false);  // Its errors were told.
  assign(why.message(), state_.failure);
  if (failed_.ok()) note_first_failure(why);
  core::log(log_, core::LogLevel::kError,
            why.message() + "; going on without recording, until a new file can be begun");
}

void RollingRecording::note_first_failure(const core::Status& why) {
  assign(why.message(), state_.first_failure);
  failed_ = result_of<core::Status>([&why] { return why; });
}

void RollingRecording::fail(const core::Status& why) {
  if (writer_) interrupt(why);
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
  note(message, index);
  return index;
}

void RollingRecording::note(const interfaces::ReceivedMessage& message, MessageIndex index) {
  const std::uint64_t before = state_.not_repeated;
  try {
    repeated_.note(message, index);
  } catch (const std::exception&) {  // There is no memory. The message itself is in the recording.
    ++not_noted_;
  }
  state_.not_repeated = not_noted_ + repeated_.dropped();
  if (state_.not_repeated == before || told_not_repeated_) return;
  told_not_repeated_ = true;
  core::log(
      log_, core::LogLevel::kWarning,
      "the next file of the recording will not repeat all that its first frames need: there is no memory, or it is "
      "more than " +
          interfaces::size_text(RepeatedMessages::kMostBytes) +
          "; the frames at its beginning are replayed to the same bits only after the files before it");
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

core::Status RollingRecording::close() {
  if (thread_.joinable()) {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    changed_.notify_one();
    thread_.join();  // after all that waits
    if (ready_ && *ready_) {
      (*ready_)->writer.reset();
      std::error_code error;
      std::filesystem::remove((*ready_)->path, error);
      ready_.reset();
    }
    static_cast<void>(result_of<core::Status>([this] {
      take_results();
      take_snapshot();
      return core::ok_status();
    }));
  }
  if (writer_) {
    const core::Status closed = writer_->close();
    writer_.reset();
    if (failed_.ok()) failed_ = closed;
  }
  if (std::exchange(options_.as_bag, false)) {
    const core::Status written = result_of<core::Status>([this] { return write_bag_metadata(); });
    if (failed_.ok()) failed_ = written;
  }
  return failed_;
}

core::Status RollingRecording::write_bag_metadata() const {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const std::filesystem::path& file : kept_)
    if (std::filesystem::exists(file, error)) files.push_back(file);
  return interfaces::write_bag_metadata(first_.parent_path(), files);
}

}  // namespace prescene::service
