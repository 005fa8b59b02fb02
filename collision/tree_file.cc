// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/tree_file.h"

#include "prescene/collision/tree_file_seal.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <new>
#include <system_error>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/core/file_descriptor.h"
#include "prescene/core/hash.h"

namespace prescene::collision {
namespace {

using core::Result;
using core::Status;
using Bytes = std::span<const std::uint8_t>;

static_assert(std::endian::native == std::endian::little, "tree files hold little-endian values as they are in memory");

constexpr std::array<char, 8> kMagic = {'P', 'R', 'S', 'C', 'T', 'R', 'E', 'E'};
constexpr std::uint32_t kFormat = 1;

struct Header {
  std::array<char, 8> magic;
  std::uint32_t format;
  std::uint32_t layout;
  std::array<char, 16> kind;
  std::uint64_t mesh_hash;
  std::uint64_t settings_hash;
  std::uint64_t file_size;
  std::uint64_t checksum;  // Of the whole file with zero here.
};
static_assert(sizeof(Header) == 64);

struct Table {
  std::uint64_t section_count;
  std::array<std::uint64_t, 3> reserved;
};

/// After the table, one for each section.
struct Entry {
  std::uint64_t offset;
  std::uint64_t count;
  std::uint64_t element_size;
  std::uint64_t reserved;
};
static_assert(sizeof(Entry) == 32);

constexpr std::size_t kEntriesAt = sizeof(Header) + sizeof(Table);

std::size_t aligned(std::size_t size) {
  return (size + kTreeFileAlignment - 1) / kTreeFileAlignment * kTreeFileAlignment;
}

template <class T>
T value_at(Bytes bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

// Words of 64 bits in four interleaved chains, each step of which is a bijection of the word: no damage within one word
// goes unseen. The size is a multiple of 64.
std::uint64_t checksum(Bytes bytes) {
  constexpr std::uint64_t kOdd = 0x9e3779b97f4a7c15ULL;
  constexpr std::size_t kChecksumAt = offsetof(Header, checksum);
  std::array<std::uint64_t, 4> chain = {1, 2, 3, 4};
  for (std::size_t at = 0; at < bytes.size(); at += 32) {
    auto words = value_at<std::array<std::uint64_t, 4>>(bytes, at);
    if (at == kChecksumAt / 32 * 32) words[kChecksumAt % 32 / 8] = 0;
    for (std::size_t i = 0; i < 4; ++i) chain[i] = std::rotl((chain[i] ^ words[i]) * kOdd, 29);
  }
  core::Hasher hasher;
  for (const std::uint64_t word : chain) hasher.value(word);
  return hasher.digest();
}

std::string reason(int error) { return std::generic_category().message(error); }

Status write_error(const std::filesystem::path& path, int error) {
  if (error == ENOENT) return core::not_found(path.string() + ": its folder does not exist; make it first");
  if (error == ENOTDIR) return core::invalid_input(path.string() + ": its folder is a file; choose another path");
  const std::string text = path.string() + ": cannot be written: " + reason(error);
  if (error == ENOSPC || error == EDQUOT || error == EFBIG)
    return core::resource_exhausted(text + "; free some space or choose another folder for trees");
  return core::unavailable(text + "; choose another folder for trees");
}

// Hardly ever the same twice, also where processes have the same number one after the other.
std::string partial_name() {
  static std::atomic<unsigned> count = 0;
  core::Hasher hasher;
  hasher.value(static_cast<std::int64_t>(::getpid())).value(count.fetch_add(1));
  hasher.value(static_cast<std::int64_t>(std::chrono::system_clock::now().time_since_epoch().count()));
  return ".tree-" + core::hash_text(hasher.digest()) + ".partial";
}

// Zero or the error.
int write_all(const std::filesystem::path& path, Bytes bytes) {
  core::FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.number() < 0) return errno;
  while (!bytes.empty()) {
    const ssize_t written = ::write(file.number(), bytes.data(), bytes.size());
    if (written < 0 && errno != EINTR) return errno;
    if (written > 0) bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  if (::fdatasync(file.number()) != 0 && errno != EINVAL && errno != EROFS) return errno;
  return file.close() ? 0 : errno;
}

struct Mapping {
  void* start;
  std::size_t size;
  Mapping(void* at, std::size_t bytes) : start(at), size(bytes) {}
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  ~Mapping() { ::munmap(start, size); }
};

constexpr const char* kRemedy = "; build the tree anew and save it there";

Status damaged(const std::string& name, const std::string& what) {
  return core::data_loss(name + ": " + what + kRemedy);
}
Status foreign(const std::string& name, const std::string& what) {
  return core::invalid_input(name + ": " + what + kRemedy);
}

// Up to its first zero; anything but letters and the like would spoil the message.
std::string readable(const std::array<char, 16>& kind) {
  std::string text(kind.begin(), std::find(kind.begin(), kind.end(), '\0'));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

void check_kind(std::string_view kind) {
  PRESCENE_CHECK_MSG(!kind.empty() && kind.size() < sizeof(Header::kind), "a kind of tree has 1 to 15 characters");
}

std::array<char, 16> padded(std::string_view kind) {
  std::array<char, 16> result{};
  std::copy(kind.begin(), kind.end(), result.begin());
  return result;
}

Status check_header(Bytes bytes, const TreeFileKey& key, const std::string& name) {
  if (bytes.size() < sizeof kMagic || value_at<std::array<char, 8>>(bytes, 0) != kMagic)
    return core::invalid_input(name + ": it is not a tree file; name the file that a tree was saved to");
  if (bytes.size() < kEntriesAt) return damaged(name, "it is cut short");
  const auto header = value_at<Header>(bytes, 0);
  if (header.format != kFormat) {
    return core::unsupported(name + ": it has format " + std::to_string(header.format) +
                             ", this version reads format " + std::to_string(kFormat) + kRemedy);
  }
  if (header.file_size != bytes.size()) {
    return damaged(name,
                   "it has " + std::to_string(bytes.size()) + " bytes instead of " + std::to_string(header.file_size));
  }
  if (bytes.size() % kTreeFileAlignment != 0 || header.checksum != checksum(bytes))
    return damaged(name, "it is damaged: its checksum is wrong");
  if (header.kind != padded(key.kind)) {
    return foreign(
        name, "it holds a tree of kind '" + readable(header.kind) + "' instead of '" + std::string(key.kind) + "'");
  }
  if (header.layout != key.layout) {
    return core::unsupported(name + ": it has version " + std::to_string(header.layout) + " of its kind of tree, not " +
                             std::to_string(key.layout) + kRemedy);
  }
  if (header.mesh_hash != key.mesh_hash) return foreign(name, "it was built over another mesh");
  if (header.settings_hash != key.settings_hash) return foreign(name, "it was built with other settings");
  return core::ok_status();
}

}  // namespace

TreeFileWriter::TreeFileWriter(const TreeFileKey& key) : kind_(key.kind), key_(key) { check_kind(kind_); }

TreeFileWriter& TreeFileWriter::add_section(Bytes bytes, std::size_t element_size) {
  PRESCENE_CHECK(sections_.size() < kMostTreeFileSections);
  sections_.push_back({bytes, element_size});
  return *this;
}

std::vector<std::uint8_t> TreeFileWriter::bytes() const {
  std::vector<Entry> entries;
  std::size_t end = aligned(kEntriesAt + sections_.size() * sizeof(Entry));
  for (const Section& section : sections_) {
    entries.push_back({end, section.bytes.size() / section.element_size, section.element_size, 0});
    end = aligned(end + section.bytes.size());
  }
  const Header header{kMagic, kFormat, key_.layout, padded(kind_), key_.mesh_hash, key_.settings_hash, end, 0};
  std::vector<std::uint8_t> bytes(end);
  std::memcpy(bytes.data(), &header, sizeof header);
  const Table table{sections_.size(), {}};
  std::memcpy(bytes.data() + sizeof header, &table, sizeof table);
  if (!entries.empty()) std::memcpy(bytes.data() + kEntriesAt, entries.data(), entries.size() * sizeof(Entry));
  for (std::size_t i = 0; i < sections_.size(); ++i)
    std::copy(sections_[i].bytes.begin(), sections_[i].bytes.end(),
              bytes.begin() + static_cast<std::ptrdiff_t>(entries[i].offset));
  seal_tree_file(bytes);
  return bytes;
}

Status TreeFileWriter::write(const std::filesystem::path& path) const {
  if (path.empty()) return core::invalid_input("no path is given to write the tree to");
  // What is no file stays what it is, and a link stays a link: the file that it leads to is written.
  std::error_code ignored;
  const std::filesystem::path target =
      std::filesystem::is_symlink(path, ignored) ? std::filesystem::weakly_canonical(path, ignored) : path;
  const std::filesystem::file_status before = std::filesystem::status(target, ignored);
  if (std::filesystem::exists(before) && !std::filesystem::is_regular_file(before))
    return core::invalid_input(path.string() + ": it is not a file; choose another path");

  const std::vector<std::uint8_t> contents = bytes();
  const std::filesystem::path folder = target.has_parent_path() ? target.parent_path() : ".";
  int error = EEXIST;
  std::filesystem::path partial;
  // Two writers of one file, threads or processes, each have their own partial file; others that were killed may have
  // left theirs.
  for (int attempt = 0; error == EEXIST && attempt < 100; ++attempt) {
    partial = folder / partial_name();
    error = write_all(partial, contents);
  }
  if (error == 0 && ::rename(partial.c_str(), target.c_str()) != 0) error = errno;
  if (error == 0) return core::ok_status();
  if (error != EEXIST) ::unlink(partial.c_str());
  return write_error(path, error);
}

Result<TreeFile> TreeFile::open(const std::filesystem::path& path, const TreeFileKey& key) {
  check_kind(key.kind);
  const std::string name = path.string();
  // Opening a named pipe must not wait for its other end.
  const core::FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.number() < 0) {
    const int error = errno;
    if (error == ENOENT) return core::not_found(name + ": no such file; build the tree and save it");
    return core::unavailable(name + ": cannot be opened: " + reason(error) + "; change its permissions");
  }
  struct stat about {};
  if (::fstat(file.number(), &about) != 0) return core::unavailable(name + ": cannot be read: " + reason(errno));
  if (!S_ISREG(about.st_mode)) return core::invalid_input(name + ": it is not a file; check the path");
  const auto size = static_cast<std::size_t>(about.st_size);
  if (size == 0) return make({}, {}, key, name);
  void* start = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file.number(), 0);
  if (start == MAP_FAILED) return core::unavailable(name + ": cannot be mapped: " + reason(errno));
  return make(std::make_shared<const Mapping>(start, size), {static_cast<const std::uint8_t*>(start), size}, key, name);
}

Result<TreeFile> TreeFile::from_bytes(Bytes bytes, const TreeFileKey& key, std::string_view name) {
  check_kind(key.kind);
  struct alignas(kTreeFileAlignment) Line {
    std::array<std::uint8_t, kTreeFileAlignment> bytes;
  };
  auto lines = std::make_shared<std::vector<Line>>(aligned(bytes.size()) / sizeof(Line));
  auto* start = reinterpret_cast<std::uint8_t*>(lines->data());
  std::copy(bytes.begin(), bytes.end(), start);
  return make(std::move(lines), {start, bytes.size()}, key, std::string(name));
}

Result<TreeFile> TreeFile::make(std::shared_ptr<const void> memory, Bytes bytes, const TreeFileKey& key,
                                std::string name) {
  PRESCENE_RETURN_IF_ERROR(check_header(bytes, key, name));
  // Behind a right checksum; still, nothing that is written there is trusted.
  const auto count = value_at<Table>(bytes, sizeof(Header)).section_count;
  if (count > kMostTreeFileSections || kEntriesAt + count * sizeof(Entry) > bytes.size())
    return damaged(name, "it claims " + std::to_string(count) + " sections");
  TreeFile file;
  std::size_t end = kEntriesAt + count * sizeof(Entry);
  for (std::size_t i = 0; i < count; ++i) {
    const auto entry = value_at<Entry>(bytes, kEntriesAt + i * sizeof(Entry));
    const bool in_order = entry.offset >= end && entry.offset <= bytes.size() && entry.offset % kTreeFileAlignment == 0;
    if (!in_order || entry.element_size == 0 || entry.count > (bytes.size() - entry.offset) / entry.element_size)
      return damaged(name, "its section " + std::to_string(i) + " is out of place");
    file.sections_.push_back({bytes.subspan(entry.offset, entry.count * entry.element_size), entry.element_size});
    end = entry.offset + entry.count * entry.element_size;
  }
  file.name_ = std::move(name);
  file.memory_ = std::move(memory);
  return file;
}

Result<Bytes> TreeFile::section_bytes(std::size_t i, std::size_t element_size) const {
  if (i >= sections_.size()) {
    return damaged(name_,
                   "section " + std::to_string(i) + " is missing: there are " + std::to_string(sections_.size()));
  }
  if (sections_[i].element_size != element_size) {
    return damaged(name_, "section " + std::to_string(i) + " holds values of " +
                              std::to_string(sections_[i].element_size) + " bytes instead of " +
                              std::to_string(element_size));
  }
  return sections_[i].bytes;
}

void seal_tree_file(std::span<std::uint8_t> bytes) {
  if (bytes.size() < sizeof(Header) || bytes.size() % kTreeFileAlignment != 0) return;
  const std::uint64_t sum = checksum(bytes);
  std::memcpy(bytes.data() + offsetof(Header, checksum), &sum, sizeof sum);
}

}  // namespace prescene::collision
