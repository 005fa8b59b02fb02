// SPDX-License-Identifier: Apache-2.0
#include "output_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "prescene/interfaces/bytes/file.h"
#include "prescene/service/recording/recording.h"
#include "verb.h"

namespace prescene::service {
namespace {

/// Whether one of our own descriptors, such as standard output, is this pipe.
bool is_open_here(const struct stat& pipe) {
  constexpr int kMostDescriptors = 256;
  for (int descriptor = 0; descriptor < kMostDescriptors; ++descriptor) {
    struct stat of {};
    if (fstat(descriptor, &of) == 0 && of.st_dev == pipe.st_dev && of.st_ino == pipe.st_ino) return true;
  }
  return false;
}

}  // namespace

bool names_bag(const std::string& output) { return output.size() > 1 && output.ends_with('/'); }

std::filesystem::path folder_of_bag(const std::string& output) {
  const std::filesystem::path path = std::filesystem::path(output).lexically_normal();
  return path.has_filename() ? path : path.parent_path();
}

std::filesystem::path first_file_of_bag(const std::filesystem::path& folder) {
  return folder / (folder.filename().string() + "_0.mcap");
}

core::Status check_part_limits(const std::string& output, const PartLimits& limits) {
  if (!names_bag(output) || limits.keep_bytes == 0) return core::ok_status();
  return core::invalid_input("--keep-megabytes bounds files beside each other, and " + output +
                             " is a folder of its own: name a file (without the slash)");
}

std::string live_recording_path(const std::string& asked, VerbContext& context) {
  if (names_bag(asked)) {
    const std::filesystem::path folder = folder_of_bag(asked);
    std::filesystem::path unused = folder;
    std::error_code none;
    for (int i = 2; std::filesystem::exists(std::filesystem::symlink_status(unused, none)); ++i)
      unused.replace_filename(folder.filename().string() + "-" + std::to_string(i));
    if (unused != folder)
      core::log(context.log(), core::LogLevel::kWarning, asked + " exists: recording to " + unused.string() + "/");
    return first_file_of_bag(unused).string();
  }
  std::string unused = unused_recording_path(asked).string();
  if (unused != asked) core::log(context.log(), core::LogLevel::kWarning, asked + " exists: recording to " + unused);
  return unused;
}

core::Status check_apart(const std::string& option, const std::string& output, const std::string& other_option,
                         const std::string& other) {
  if (output.empty() || other.empty()) return core::ok_status();
  std::error_code none;
  const auto place = [&](const std::string& file) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(file, none), none);
  };
  if (!std::filesystem::equivalent(output, other, none) && place(output) != place(other)) return core::ok_status();
  return core::invalid_input(option + " and " + other_option + " name the same file " + other + ": name two");
}

core::Status check_output(const std::string& option, const std::string& output,
                          const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs) {
    std::error_code none;
    if (output.empty() || input.empty() || !std::filesystem::equivalent(output, input, none)) continue;
    return core::invalid_input(option + " " + output + " is the input too and would be overwritten: name another file");
  }
  if (output.empty()) return core::ok_status();
  const std::string wont = option + " " + output + ": can't be written: ";
  std::error_code none;
  if (std::filesystem::is_directory(output, none)) return core::unavailable(wont + "it is a folder; name a file in it");
  std::filesystem::path folder = std::filesystem::path(output).parent_path();
  if (folder.empty()) folder = ".";
  if (!std::filesystem::is_directory(folder, none))
    return core::unavailable(wont + "there is no folder " + folder.string() + "; make it, or name another place");
  if (std::filesystem::is_character_file(output, none)) {
    // A device that takes nothing says so when nothing is written.
    const int device = open(output.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY);
    const bool takes = device >= 0 && write(device, "", 0) == 0;
    const std::string why = std::strerror(errno);
    if (device >= 0) close(device);
    return takes ? core::ok_status() : core::unavailable(wont + why + "; name another file");
  }
  struct stat there {};
  if (stat(output.c_str(), &there) != 0 && errno != ENOENT)
    return core::unavailable(wont + std::strerror(errno) + "; name another place");
  if (std::filesystem::exists(output, none) && !S_ISREG(there.st_mode)) {
    // Nobody may read from a pipe with a name, and opening it would wait for ever. Standard output's is open already.
    if (S_ISFIFO(there.st_mode) && is_open_here(there)) return core::ok_status();
    return core::unavailable(wont + "it is no regular file; name one, or /dev/stdout to send it through a pipe");
  }
  if (std::filesystem::exists(output, none) && access(output.c_str(), W_OK) != 0)
    return core::unavailable(wont + std::strerror(errno) + "; name another place");
  const std::filesystem::path target = std::filesystem::weakly_canonical(output, none);
  const auto aside = interfaces::create_beside(none ? std::filesystem::path(output) : target, output);
  if (!aside) return core::unavailable(option + " " + aside.status().message());
  std::filesystem::remove(*aside, none);
  return core::ok_status();
}

core::Status check_png(const std::string& option, const std::string& output) {
  const std::filesystem::path extension = std::filesystem::path(output).extension();
  if (extension.empty() || extension == ".png" || extension == ".PNG") return core::ok_status();
  return core::invalid_input(option + " " + output +
                             ": the picture is written as PNG: give it a name that ends in .png");
}

core::Status check_recording(const std::string& option, const std::string& output,
                             const std::vector<std::string>& inputs) {
  if (output.empty()) return core::ok_status();
  std::error_code none;
  if (names_bag(output)) {
    const std::filesystem::path bag = folder_of_bag(output);
    const std::string name = bag.filename().string();
    if (name.empty() || name == "." || name == "..")
      return core::invalid_input(option + " " + output + ": names no new folder; a bag has one of its own");
    if (std::filesystem::exists(bag, none) && !std::filesystem::is_directory(bag, none))
      return core::invalid_input(option + " " + output + ": is no folder; name another, or a file (without the slash)");
    const std::filesystem::path above = bag.parent_path();
    if (!above.empty() && !std::filesystem::is_directory(above, none))
      return core::unavailable(option + " " + output + ": there is no folder " + above.string() + "; make it first");
    return core::ok_status();
  }
  const std::filesystem::path place = std::filesystem::absolute(output, none).lexically_normal();
  const std::filesystem::path folder = std::filesystem::weakly_canonical(place.parent_path(), none);
  const bool is_other = std::filesystem::exists(output, none) && !std::filesystem::is_regular_file(output, none);
  // Redirected to a file, /dev/stdout looks like one, but belongs to who redirected it.
  if (is_other || folder == "/dev" || folder == std::filesystem::weakly_canonical("/dev/fd", none))
    return core::invalid_input(option + " " + output + ": is no file: a recording is a file of its own; name one");
  return check_output(option, output, inputs);
}

}  // namespace prescene::service
