// SPDX-License-Identifier: Apache-2.0
// What the verbs of the command line share: options that every verb has, output, progress, exit codes.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/validation.h"
#include "prescene/core/log.h"
#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"
#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/rendering/gpu/likelihood_choice.h"
#include "prescene/service/recording/replay_input.h"
#include "prescene/service/recording/rolling_recording.h"
#include "prescene/service/tracking/tracker_settings.h"
#include "prescene/service/view/view_server.h"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's own
class App;
class Validator;
}  // namespace CLI

namespace prescene::service {

/// 0 = done, 1 = could not do it (stopped, an output that can't be written, no memory), 2 = bad arguments or bad input
/// (a file that is not there, can't be opened or read as what it should be, or is larger than a limit).
enum class ExitCode { kDone = 0, kFailed = 1, kBadInput = 2 };
ExitCode exit_code_of(const core::Status& status);
/// {"error": text, "code": ...} and a line's end, see belief::error_to_json. `status` is not ok.
std::string error_document(const core::Status& status);

/// Options that every verb takes.
struct CommonOptions {
  bool json = false;  ///< stdout is one JSON document; everything else goes to stderr.
  std::uint64_t seed = 1;
  bool seed_given = false;  ///< By the user, rather than the default.
  int threads = 0;          ///< 0 = as many as the machine has.
  bool quiet = false;       ///< No progress, warnings and errors only.
};

/// What a verb is given to run with.
class VerbContext {
 public:
  VerbContext(const CommonOptions& options, const core::Cancellation& cancellation);
  ~VerbContext();

  const CommonOptions& options() const { return options_; }
  /// To stderr.
  const core::LogSink& log() const { return log_; }
  core::ThreadPool& pool();
  /// Set by Ctrl-C: long work stops cleanly and keeps what is done.
  const core::Cancellation& cancellation() const { return cancellation_; }
  /// A bar when stderr is a terminal, a plain line every ten per cent otherwise; `what` begins each line.
  core::ProgressSink progress(const std::string& what);
  /// Ends a progress bar's line.
  void end_progress();

  /// One JSON document to stdout with --json, the text otherwise.
  void print(const nlohmann::ordered_json& document, const std::string& text);
  /// One of several: with --json, each document is a line of its own.
  void print_line(const nlohmann::ordered_json& document, const std::string& text);
  /// The verb's end: what went wrong to stderr, and with --json as error_document() to stdout where nothing was
  /// printed, or as one more line. Output that could not be written (a full disk, a closed pipe) is a failure too.
  ExitCode finish(const std::string& verb, core::Status status);

 private:
  void write_out(const std::string& out);

  CommonOptions options_;
  const core::Cancellation& cancellation_;
  core::LogSink log_;
  std::unique_ptr<core::ThreadPool> pool_;
  bool bar_open_ = false;
  bool printed_ = false;
  bool printed_lines_ = false;
  bool print_failed_ = false;
};

/// One verb: adds its subcommand with its options to the app and returns what runs it. The options live in the returned
/// function's captures.
struct Verb {
  CLI::App* app = nullptr;
  std::function<core::Status(VerbContext&)> run;
};

Verb add_validate_verb(CLI::App& app);
Verb add_predict_verb(CLI::App& app);
Verb add_inspect_verb(CLI::App& app);
Verb add_evaluate_verb(CLI::App& app);
Verb add_explain_verb(CLI::App& app);
Verb add_calibrate_verb(CLI::App& app);
Verb add_train_verb(CLI::App& app);
Verb add_record_verb(CLI::App& app);
Verb add_replay_verb(CLI::App& app);
Verb add_serve_verb(CLI::App& app);
Verb add_ask_verb(CLI::App& app);
Verb add_view_verb(CLI::App& app);
Verb add_achieve_verb(CLI::App& app);
Verb add_doctor_verb(CLI::App& app);
Verb add_demo_verb(CLI::App& app);

/// What add_domain_option() adds.
inline constexpr std::array kDomainOptions = {"--domain", "--interface", "--peer", "--ros-distro", "--security"};
void add_domain_option(CLI::App& verb, interfaces::DdsOptions& dds);
/// The domain that ROS_DOMAIN_ID names, unless one was given; to be called by what joins the bus. kInvalidInput where
/// the variable holds none.
core::Status take_domain(const CLI::App& verb, interfaces::DdsOptions& dds);
/// --camera and the names of the robot's topics; --camera also sets whether images are rectified.
void add_topic_options(CLI::App& verb, TrackerSettings& tracker);
/// kInvalidInput if an option that describes the camera is given although the scene lists its cameras.
core::Status check_topics_once(const CLI::App& verb, const belief::Scene& scene);
/// Both.
void add_bus_options(CLI::App& verb, interfaces::DdsOptions& dds, TrackerSettings& tracker);
/// Of a recording that is read: --depth-scale and --frame-rate of a folder of images, --salvage, --all-parts.
void add_input_options(CLI::App& verb, double& depth_scale, double& frame_rate, RecordingReadOptions& read);
/// Says that the recording goes on in another file, which is not read.
void tell_what_goes_on(const ReplayInput& input, VerbContext& context);
/// Of a recording that is made live: when a new file begins, and how much is kept.
void add_part_options(CLI::App& verb, PartLimits& limits);
/// kInvalidInput for --depth-scale and --frame-rate where the input is no folder of images.
core::Status check_folder_options(const CLI::App& verb, const std::string& input);
/// --world-frame and --camera-pose.
void add_camera_options(CLI::App& verb, AssemblerSettings& assembler);
/// --view-address, --view-token and --view-origin, with `prefix` in place of "view-"; the port is the verb's own.
void add_web_options(CLI::App& verb, const std::string& prefix, ViewOptions& view);
/// --likelihood and --graphics-device.
void add_likelihood_options(CLI::App& verb, rendering::LikelihoodChoice& choice);
/// --proposals.
void add_proposals_option(CLI::App& verb, std::string& path);
/// --learned and --new-objects.
void add_belief_options(CLI::App& verb, TrackerSettings& settings, std::string& learned);
/// Reads the file that --learned names into the settings, if there is one, after checking that it can be written.
/// `inputs`: files that it must not be.
core::Status take_learned(const std::string& file, const std::vector<std::string>& inputs, TrackerSettings& settings);
/// `settings` (of a recording) with those of the options above that were on the command line.
TrackerSettings with_given(const CLI::App& verb, TrackerSettings settings, const TrackerSettings& given);

/// An answer as JSON, for a person; what has no short form stays JSON.
std::string answer_text(const nlohmann::ordered_json& answer);

/// Checks of options: finite numbers only (CLI11's own let NaN pass).
CLI::Validator positive_number();
CLI::Validator number_between(double low, double high);
/// As questions over the bus and in JSON are checked: belief::check_number.
CLI::Validator in_range(const belief::ScalarRange& range);
/// One of these words; the message says which of them was probably meant.
CLI::Validator one_of(std::vector<std::string> words);
/// Text that others can read: UTF-8.
CLI::Validator utf8_text();
/// A name that is not empty, nor an option that took the place of one.
CLI::Validator file_name();

/// "1 object", "2 objects".
std::string counted(std::size_t number, const std::string& thing);
/// Rows of text with columns padded to equal width; the first row is underlined.
std::string table(const std::vector<std::vector<std::string>>& rows);

}  // namespace prescene::service
