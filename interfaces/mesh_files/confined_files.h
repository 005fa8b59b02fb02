// SPDX-License-Identifier: Apache-2.0
// The files that an importer may open: the model, and regular files in its folder and the folders below. A model in a
// file of somebody else could otherwise name a pipe, a device or a private file.
#pragma once

#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <cstddef>
#include <filesystem>
#include <string>

#include "prescene/core/status.h"
#include "prescene/interfaces/bytes/file.h"

namespace prescene::interfaces {

class ConfinedFiles final : public Assimp::IOSystem {
 public:
  /// Where the model is a link, files beside what it names may be opened too. Files are refused above `max_bytes`.
  ConfinedFiles(const std::filesystem::path& model, std::size_t max_bytes);

  /// Why the last file that was refused was; empty when none was.
  const std::string& refusal() const { return refusal_; }

  bool Exists(const char* path) const override;
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* path, const char* mode) override;
  void Close(Assimp::IOStream* stream) override;
  bool CreateDirectory(const std::string& /*path*/) override { return false; }
  bool ChangeDirectory(const std::string& /*path*/) override { return false; }
  bool DeleteFile(const std::string& /*file*/) override { return false; }

 private:
  core::Result<InputFile> open_file(const std::filesystem::path& path) const;

  std::filesystem::path model_, folder_, folder_of_target_;
  std::size_t max_bytes_;
  std::string refusal_;
};

}  // namespace prescene::interfaces
