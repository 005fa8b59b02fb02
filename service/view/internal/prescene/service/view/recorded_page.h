// SPDX-License-Identifier: Apache-2.0
// The page of the live view with a recording in it, as one document that needs no program: for reports.
//
//   RecordedPage page({.title = "milk.mcap"});
//   page.add(step);                                // each of a replay
//   report.set_page(page.page());
//
// Bounded, however long the recording is: of its steps and pictures every second one is kept, then every fourth, and
// so on. Steps at which a state changes stay longest.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/interfaces/reports/report.h"
#include "prescene/service/view/view_content.h"
#include "prescene/service/view/view_history.h"

namespace prescene::service {

/// Texts in their order, of which fewer and fewer are kept as they become more than so many bytes.
class ThinnedTexts {
 public:
  explicit ThinnedTexts(std::size_t most_bytes) : most_bytes_(most_bytes) {}
  struct Text {
    std::uint64_t number = 0;  ///< Of those that were added.
    std::string text;
    bool is_marked = false;   ///< Stays for now.
    bool was_marked = false;  ///< When it was added.
  };
  /// A marked one stays where others are left out, until marked ones alone are too many.
  void add(std::string text, bool is_marked);
  /// Whether add() would keep the next one at all: else skip() takes its place, without its text.
  bool wants_next(bool is_marked) const { return is_marked || added_ % stride_ == 0; }
  void skip() { ++added_; }
  const std::vector<Text>& kept() const { return kept_; }
  std::uint64_t added() const { return added_; }
  std::size_t bytes() const { return bytes_; }
  std::uint64_t stride() const { return stride_; }
  std::uint64_t marked_left_out() const { return marked_left_out_; }

 private:
  std::size_t most_bytes_, bytes_ = 0;
  std::uint64_t added_ = 0, stride_ = 1, marked_left_out_ = 0;
  std::vector<Text> kept_;
};

struct RecordedPageOptions {
  std::string title;
  std::size_t most_step_bytes = std::size_t{12} << 20;     ///< Of the steps' documents.
  std::size_t most_picture_bytes = std::size_t{12} << 20;  ///< Of the pictures of all cameras, in base64.
  std::size_t most_answer_bytes = std::size_t{4} << 20;    ///< An answer that does not fit is left out, and counted.
};

/// Not thread-safe.
class RecordedPage {
 public:
  explicit RecordedPage(RecordedPageOptions options);

  void add(const ShownStep& step);
  /// An answer as JSON that came after the last step; what is none is left out.
  void add_answer(const std::string& json);
  /// What the page is given, as JSON; "remarks" say what was left out.
  std::string data() const;
  /// Where there was no step, its document is empty.
  interfaces::PageBlock page() const;

 private:
  void add_picture(const belief::Observation& observation, bool is_change);

  RecordedPageOptions options_;
  std::shared_ptr<const belief::Scene> scene_;
  ViewHistory history_{2000, 2000};
  ThinnedTexts steps_, pictures_;
  std::map<int, belief::Observation> frames_;  // of several cameras the newest of each
  std::uint64_t count_ = 0;
  double time_ = 0.0;
  std::vector<std::string> answers_;
  std::size_t answer_bytes_ = 0;
  std::uint64_t answers_left_out_ = 0;
};

/// The page's files in one document, with the data in it. `<` of the data is escaped, so that none of its texts ends
/// it.
interfaces::PageBlock page_with_data(const std::string& data);

}  // namespace prescene::service
