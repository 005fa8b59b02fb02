// SPDX-License-Identifier: Apache-2.0
// Whatever a mesh file holds: it is read or refused with a reason; no crash, no hang, no more than 1 GB. Each file is
// read by a process of its own, which is watched.
//
// PRESCENE_HOSTILE_MESHES=500 build/release/tests/interfaces_mesh_files_tests --gtest_filter='*HostileMeshes*' reads
// 500 mutated files a format and the largest files that are allowed; without the variable it is a part of these.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <functional>

#include "hostile_meshes.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/mesh_files/limited_child.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"
#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using tests::MeshKind;

constexpr std::int64_t kMostMemory = 1'000'000'000;
constexpr rlim_t kMostSeconds = 10;  // Of the processor's time: the wall clock is also that of other tests.

std::size_t mutated_files() {
  std::size_t count = child_memory_is_limited() ? 60 : 15;
  if (const char* wanted = std::getenv("PRESCENE_HOSTILE_MESHES"))
    std::from_chars(wanted, wanted + std::strlen(wanted), count);
  return count;
}

struct Watched {
  int status = 0;  // As wait() gives it; 0: read or refused with a reason, and the importer did not linger.
  double seconds = 0.0;
  std::int64_t bytes = 0;
};

// Sanitizers slow the reading down and take memory of their own; there the importer has less time to take memory in.
Watched read_alone(const std::filesystem::path& path) {
  const pid_t process = ::fork();
  if (process == 0) {
    if (child_memory_is_limited()) {
      const rlimit limit{kMostSeconds, kMostSeconds};
      ::setrlimit(RLIMIT_CPU, &limit);
    }
    MeshReadOptions options;
    if (!child_memory_is_limited()) options.max_importer_time = std::chrono::seconds(1);
    const auto mesh = read_mesh(path, options);
    bool sound = mesh ? !mesh->mesh.triangles.empty() : mesh.status().message().size() > path.string().size();
    if (mesh) {
      for (const auto& vertex : mesh->mesh.vertices) sound = sound && vertex.allFinite();
      for (const auto& triangle : mesh->mesh.triangles)
        sound = sound && *std::ranges::max_element(triangle) < mesh->mesh.vertices.size();
    }
    ::_exit(sound ? 0 : 1);
  }
  Watched watched;
  rusage use{};
  while (::wait4(process, &watched.status, 0, &use) < 0 && errno == EINTR) continue;
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  watched.seconds = seconds(use.ru_utime) + seconds(use.ru_stime);
  watched.bytes = std::int64_t{1024} * use.ru_maxrss;  // The largest of the process and its importer.
  return watched;
}

class HostileMeshes : public testing::TestWithParam<MeshKind> {
 protected:
  void SetUp() override {
    ASSERT_EQ(::mkfifo((scratch_.path() / "pipe").c_str(), 0600), 0);
    ASSERT_TRUE(std::filesystem::create_directory(scratch_.path() / "folder"));
  }

  // Files that `make` gives, written by a process of its own: what it takes to make them would count as taken to read.
  void write_files(const std::function<std::vector<std::string>()>& make) const {
    const pid_t process = ::fork();
    if (process == 0) {
      std::size_t number = 0;
      bool written = true;
      for (const std::string& bytes : make()) written = written && write_file(path_of(number++), bytes).ok();
      ::_exit(written ? 0 : 1);
    }
    int status = 1;
    while (::waitpid(process, &status, 0) < 0 && errno == EINTR) continue;
    ASSERT_EQ(status, 0);
  }

  std::filesystem::path path_of(std::size_t number) const {
    return scratch_.path() / (std::to_string(number) + tests::extension_of(GetParam()));
  }

  void read_files(const std::string& what) {
    for (std::size_t i = 0; std::filesystem::exists(path_of(i)); ++i) {
      SCOPED_TRACE(what + " " + std::to_string(i) + " of " + tests::name_of(GetParam()));
      const Watched watched = read_alone(path_of(i));
      EXPECT_EQ(watched.status, 0) << (WIFSIGNALED(watched.status) ? ::strsignal(WTERMSIG(watched.status)) : "unsound");
      if (child_memory_is_limited()) {
        EXPECT_LE(watched.bytes, kMostMemory);
      }
      ++files_;
      slowest_ = std::max(slowest_, watched.seconds);
      most_ = std::max(most_, watched.bytes);
    }
  }

  void TearDown() override {
    if (files_ == 0) return;
    std::printf("compared: %zu %s files: at most %.2f s of the processor and %.0f MB each\n", files_,
                tests::name_of(GetParam()), slowest_, 1e-6 * static_cast<double>(most_));
  }

  tests::ScratchDir scratch_;
  std::size_t files_ = 0;
  double slowest_ = 0.0;
  std::int64_t most_ = 0;
};

TEST_P(HostileMeshes, SoundFilesAreRead) {
  for (const std::string& bytes : tests::sound_files(GetParam())) {
    const std::filesystem::path path = scratch_.path() / (std::string("a") + tests::extension_of(GetParam()));
    ASSERT_TRUE(write_file(path, bytes).ok());
    const auto mesh = read_mesh(path);
    EXPECT_TRUE(mesh.ok()) << mesh.status().message();
  }
}

TEST_P(HostileMeshes, MutatedFilesAreReadOrRefused) {
  write_files([] {
    const std::vector<std::string> sound = tests::sound_files(GetParam());
    std::vector<std::string> files;
    for (std::size_t i = 0; i < mutated_files(); ++i) {
      core::RandomStream stream(17 * i + static_cast<std::size_t>(GetParam()), core::Purpose::kTest);
      files.push_back(tests::mutated_file(sound, &stream));
    }
    return files;
  });
  read_files("mutated file");
}

TEST_P(HostileMeshes, CraftedFilesAreReadOrRefused) {
  write_files([] { return tests::crafted_files(GetParam()); });
  read_files("crafted file");
  EXPECT_GE(files_, 80U);
}

INSTANTIATE_TEST_SUITE_P(Kinds, HostileMeshes,
                         testing::Values(MeshKind::kObj, MeshKind::kPlyText, MeshKind::kPlyBinary, MeshKind::kStlText,
                                         MeshKind::kStlBinary, MeshKind::kGltf, MeshKind::kGlb, MeshKind::kCollada),
                         [](const auto& kind) { return std::string(tests::name_of(kind.param)); });

class LargestMeshes : public HostileMeshes {};

TEST_P(LargestMeshes, AreReadWithinTheLimits) {
  const bool all = std::getenv("PRESCENE_HOSTILE_MESHES") != nullptr;
  const std::size_t triangles = all ? MeshReadOptions{}.max_triangles : 200'000;
  write_files([&] {
    return std::vector{tests::largest_file(GetParam(), triangles, false),
                       tests::largest_file(GetParam(), triangles, true)};
  });
  read_files("largest file");
}

INSTANTIATE_TEST_SUITE_P(HostileMeshes, LargestMeshes, testing::Values(MeshKind::kPlyBinary, MeshKind::kStlBinary),
                         [](const auto& kind) { return std::string(tests::name_of(kind.param)); });

}  // namespace
}  // namespace prescene::interfaces
