// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "output_files.h"
#include "prescene/belief/json.h"
#include "prescene/interfaces/bags/bag_writer.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "prescene/service/live/bus_recorder.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/recording/bop_dataset.h"
#include "prescene/service/recording/simulated_recording.h"
#include "prescene/service/tracking/camera_frames.h"
#include "verb.h"

namespace prescene::service {
namespace {

struct RecordOptions {
  std::string output;
  std::string simulate;
  std::string scene;
  std::string labels;
  std::vector<std::string> removals;
  std::vector<std::string> puts;
  bool unreported_robot = false;
  std::string stepper = "automatic";
  double step = 0.0;  // 0: the scene's
  PartLimits parts;
  SimulatedRecordingOptions simulation;
  interfaces::DdsOptions dds;
  TrackerSettings tracker;
  const CLI::App* verb = nullptr;
};

/// `status`, speaking of the recording that was asked for, not of the file beside it.
core::Status with_name(const core::Status& status, const std::filesystem::path& aside, const std::string& output) {
  std::string text = status.message();
  if (const std::size_t at = text.find(aside.string()); at != std::string::npos)
    text.replace(at, aside.string().size(), output);
  return {status.code(), text};
}

/// What the scene's recipe says and the command line does not.
core::Status take_recipe(const std::string& text, RecordOptions& options, VerbContext& context, std::uint64_t& seed) {
  PRESCENE_TRY(const interfaces::RecordingRecipe recipe, interfaces::parse_recording_recipe(text, options.simulate));
  const auto given = [&](const char* name) { return options.verb->count(name) > 0; };
  seed = context.options().seed_given ? context.options().seed : recipe.seed.value_or(context.options().seed);
  if (recipe.rate && !given("--rate")) options.simulation.rate = *recipe.rate;
  if (!recipe.stepper.empty() && !given("--stepper")) options.stepper = recipe.stepper;
  if (recipe.step && !given("--step")) options.step = *recipe.step;
  options.simulation.reports_robot = recipe.reports_robot && !options.unreported_robot;
  return core::ok_status();
}

/// Writes the recording `aside`, and labels where they are asked for; kCancelled with what is done in both, `frames` of
/// them.
core::Status simulate_to(const std::filesystem::path& aside, const belief::Scene& scene, const std::string& text,
                         FilesOfScene files, const RecordOptions& options, std::uint64_t seed, Backends& backends,
                         BopDataset* labels, std::size_t& frames, VerbContext& context) {
  RecordingInfo info{options.simulate, text, seed, "", std::move(files)};
  info.tf_static = options.simulation.topics.tf_static;
  PRESCENE_TRY(const auto recording, RecordingWriter::create(aside, info));
  SimulatedRecordingOptions simulation = options.simulation;
  simulation.on_frame = [&](const SimulatedFrame& frame) {
    ++frames;
    return labels != nullptr ? labels->add(frame) : core::ok_status();
  };
  core::Status simulated = simulate_recording(scene, simulation, seed, backends, context.cancellation(),
                                              context.progress("recording"), *recording);
  const core::Status labelled = labels != nullptr ? labels->close() : core::ok_status();
  PRESCENE_RETURN_IF_ERROR(recording->close());
  return simulated.ok() ? labelled : simulated;
}

/// The folder that `-o FOLDER/` names, while a simulation is recorded to its file. What is not finished goes.
class SimulatedBag {
 public:
  /// Names the file in the options.
  static core::Result<std::unique_ptr<SimulatedBag>> create(RecordOptions& options) {
    const std::filesystem::path folder = folder_of_bag(options.output);
    std::error_code error;
    const bool is_new = std::filesystem::create_directory(folder, error);
    if (error) return core::unavailable("-o " + options.output + ": can't be made: " + error.message());
    if (!is_new)
      return core::invalid_input("-o " + options.output + ": is there already; remove it, or name another folder");
    options.output = first_file_of_bag(folder).string();
    return std::make_unique<SimulatedBag>(options.output);
  }
  explicit SimulatedBag(std::filesystem::path file) : file_(std::move(file)) {}
  SimulatedBag(const SimulatedBag&) = delete;
  SimulatedBag& operator=(const SimulatedBag&) = delete;
  ~SimulatedBag() {
    std::error_code error;
    if (!is_finished_) std::filesystem::remove(file_.parent_path(), error);  // only if nothing is in it
  }
  core::Status finish() {
    is_finished_ = true;
    return interfaces::write_bag_metadata(file_.parent_path(), {file_});
  }

 private:
  std::filesystem::path file_;
  bool is_finished_ = false;
};

core::Status record_simulation(RecordOptions& options, VerbContext& context) {
  for (const char* name : kDomainOptions)
    if (options.verb->count(name) > 0)
      return core::invalid_input(std::string(name) +
                                 " is for recording the bus, and --simulate needs none: leave one of them out");
  PRESCENE_RETURN_IF_ERROR(check_recording("-o", options.output, {options.simulate}));
  for (const std::string& text : options.removals) {
    PRESCENE_TRY(UnannouncedChange change, removal_from_text(text));
    options.simulation.changes.push_back(std::move(change));
  }
  for (const std::string& text : options.puts) {
    PRESCENE_TRY(UnannouncedChange change, put_from_text(text));
    options.simulation.changes.push_back(std::move(change));
  }
  PRESCENE_TRY(const std::string text, read_scene_text(options.simulate));
  FilesOfScene files;
  PRESCENE_TRY(auto scene, load_scene_text(text, options.simulate, context.log(), &files));
  std::uint64_t seed = 0;
  PRESCENE_RETURN_IF_ERROR(take_recipe(text, options, context, seed));
  if (options.step > 0.0) {
    auto with_step = std::make_shared<belief::Scene>(*scene);
    with_step->step = options.step;
    scene = std::move(with_step);
  }
  PRESCENE_RETURN_IF_ERROR(check_topics_once(*options.verb, *scene));
  BackendSettings settings;
  if (options.stepper == "bullet") settings.stepper = Stepper::kBullet;
  if (options.stepper == "lockstep") settings.stepper = Stepper::kLockstep;
  Backends backends(context.pool(), settings);
  PRESCENE_TRY(const auto renderer, backends.make_renderer());
  std::unique_ptr<BopDataset> labels;
  if (!options.labels.empty()) {
    std::error_code none;
    if (std::filesystem::weakly_canonical(options.labels, none) ==
        std::filesystem::weakly_canonical(options.output, none))
      return core::invalid_input("--labels " + options.labels + ": is the recording's name; name a folder");
    PRESCENE_TRY(labels, BopDataset::create(options.labels, *scene, *renderer));
  }
  std::unique_ptr<SimulatedBag> bag;
  if (names_bag(options.output)) {
    PRESCENE_TRY(bag, SimulatedBag::create(options));
  }
  // An older recording of that name stays until this one is whole. Where there is none, what is done is kept.
  std::error_code error;
  const bool replaces = std::filesystem::exists(options.output, error);
  const std::filesystem::path target =
      replaces ? std::filesystem::canonical(options.output, error) : std::filesystem::path(options.output);
  PRESCENE_TRY(const std::filesystem::path aside, interfaces::create_beside(target, options.output));
  std::size_t frames = 0;
  core::Status status =
      simulate_to(aside, *scene, text, std::move(files), options, seed, backends, labels.get(), frames, context);
  const bool cancelled = status.code() == core::StatusCode::kCancelled;
  const bool keeps = status.ok() || (cancelled && !replaces && frames > 0);
  if (keeps) std::filesystem::rename(aside, target, error);
  if (keeps && error) status = core::unavailable(options.output + ": cannot be replaced: " + error.message());
  if (!keeps || error) std::filesystem::remove(aside, error);
  // Labels of frames that are not recorded would be taken for whole.
  if (labels && (!keeps || !(status.ok() || cancelled))) {
    const core::Status discarded = labels->discard();
    if (!discarded.ok()) core::log(context.log(), core::LogLevel::kWarning, discarded.message());
  }
  if (cancelled && replaces) return core::cancelled("stopped on request; " + options.output + " is as it was");
  if (cancelled && !keeps) return core::cancelled("stopped on request before the first frame; nothing was recorded");
  if (keeps && bag) {
    const core::Status written = bag->finish();
    if (status.ok()) status = written;
  }
  if (!status.ok()) return with_name(status, aside, options.output);
  nlohmann::ordered_json document = {{"recording", options.output}, {"scene", scene->name}, {"simulated", true}};
  std::string said = "recorded " + options.output + "\n";
  if (labels) {
    document["labels"] = options.labels;
    said += "labels are in " + options.labels + "\n";
  }
  context.print(document, said);
  return core::ok_status();
}

core::Status record_bus(RecordOptions& options, VerbContext& context) {
  PRESCENE_RETURN_IF_ERROR(take_domain(*options.verb, options.dds));
  PRESCENE_RETURN_IF_ERROR(check_recording("-o", options.output, {options.scene}));
  PRESCENE_RETURN_IF_ERROR(check_part_limits(options.output, options.parts));
  const std::string output = live_recording_path(options.output, context);
  // With the names of the topics, so that a replay knows them.
  RecordingInfo info{"", "", context.options().seed, belief::json_text(to_json(options.tracker))};
  std::vector<CameraInput> cameras = {{"", options.tracker.topics, options.tracker.assembler}};
  if (!options.scene.empty()) {
    FilesOfScene files;
    PRESCENE_TRY(info.scene_text, read_scene_text(options.scene));
    PRESCENE_TRY(const auto scene, load_scene_text(info.scene_text, options.scene, context.log(), &files));
    PRESCENE_RETURN_IF_ERROR(check_topics_once(*options.verb, *scene));
    cameras = camera_inputs(options.tracker, *scene);
    PRESCENE_RETURN_IF_ERROR(validate(cameras));
    info.scene_file = options.scene;
    info.files = std::move(files);
  }
  info.tf_static = cameras.front().topics.tf_static;
  PRESCENE_TRY(
      const auto recording,
      RollingRecording::create(output, std::move(info),
                               {.part = options.parts, .asked = options.output, .as_bag = names_bag(options.output)},
                               context.log()));
  PRESCENE_TRY(const std::uint64_t messages,
               record_topics(options.dds, cameras, context.cancellation(), context.log(), *recording));
  context.print({{"recording", output}, {"messages", messages}, {"simulated", false}},
                "recorded " + std::to_string(messages) + " messages to " + output + "\n");
  return core::ok_status();
}

}  // namespace

Verb add_record_verb(CLI::App& app) {
  auto* verb = app.add_subcommand("record", "Record the robot's topics, or a scene as a simulated robot would see it");
  auto options = std::make_shared<RecordOptions>();
  verb->add_option("-o,--output", options->output,
                   "Recording to write (MCAP); with a slash at its end, a folder as of `ros2 bag record`")
      ->check(file_name())
      ->required();
  verb->add_option("--simulate", options->simulate,
                   "Scene file to play with a simulated RGB-D camera, instead of listening")
      ->check(file_name());
  verb->add_option("--scene", options->scene,
                   "Scene file that is recorded with the topics: those of the cameras that it lists, and what a replay "
                   "needs")
      ->check(file_name())
      ->excludes("--simulate");
  verb->add_option("--rate", options->simulation.rate, "Simulated frames a second, of each camera")
      ->check(number_between(0.1, 240.0))
      ->needs("--simulate")
      ->capture_default_str();
  verb->add_option("--remove", options->removals,
                   "SECONDS:OBJECT: somebody takes the object away, unreported; at 0: it is not there until it is put "
                   "in")
      ->needs("--simulate");
  verb->add_option("--put", options->puts,
                   "SECONDS:OBJECT:X,Y,Z[,YAW_DEG]: somebody puts the object there (m, its frame's origin), unreported")
      ->needs("--simulate");
  verb->add_option("--labels", options->labels,
                   "New or empty folder for training data: images, masks, poses and models in the layout of the BOP "
                   "benchmark")
      ->check(file_name())
      ->needs("--simulate");
  verb->add_flag("--unreported-robot", options->unreported_robot,
                 "The robot moves and acts, but neither its poses nor its actions are published")
      ->needs("--simulate");
  verb->add_option("--stepper", options->stepper,
                   "Who simulates what is recorded: lockstep, bullet, or automatic: lockstep where it can, else bullet")
      ->check(one_of({"automatic", "bullet", "lockstep"}))
      ->needs("--simulate")
      ->capture_default_str();
  verb->add_option("--step", options->step, "Of the simulation that is recorded, s; default: the scene's")
      ->check(number_between(1e-5, 0.02))
      ->needs("--simulate");
  add_part_options(*verb, options->parts);
  for (const char* name : {"--part-seconds", "--part-megabytes", "--keep-megabytes"})
    verb->get_option(name)->excludes(verb->get_option("--simulate"));
  add_bus_options(*verb, options->dds, options->tracker);
  options->verb = verb;
  verb->footer(
      "Examples: prescene record -o run.mcap                  (until Ctrl-C)\n"
      "          prescene record --simulate scenarios/milk_on_bin.yaml -o milk.mcap --seed 1");
  return {verb, [options](VerbContext& context) {
            PRESCENE_RETURN_IF_ERROR(validate(options->tracker.topics));
            options->simulation.topics = options->tracker.topics;
            return options->simulate.empty() ? record_bus(*options, context) : record_simulation(*options, context);
          }};
}

}  // namespace prescene::service
