// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>
#include <span>

#include "inspect_recording.h"
#include "output_files.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/scene_files/mesh_use.h"
#include "prescene/service/calibration/depth_noise.h"
#include "prescene/service/mesh_inspection.h"
#include "prescene/service/pictures/prediction_report.h"
#include "verb.h"

namespace prescene::service {
namespace {

using core::fixed_text;

struct InspectOptions {
  std::string file;
  std::string model;
  std::string use;
  std::string report;
  bool y_up = false;
  MeshInspectionOptions inspection;
  RecordingInspection recording;
  std::string scene;
  bool depth_noise = false;
  std::string camera;
  const CLI::App* verb = nullptr;
};

constexpr const char* kMeshOptions[] = {"--output", "--use", "--density", "--scale", "--y-up", "--report"};
/// What says which frame is looked at, and how.
std::vector<std::string> frame_options(const CLI::App& verb) {
  std::vector<std::string> names = {"--frame", "--scene", "--overlay", "--likelihood-map"};
  for (const char* group : {"Topics", "Camera"})
    for (const CLI::Option* option : verb.get_option_group(group)->get_options())
      names.push_back("--" + option->get_lnames().front());
  return names;
}
constexpr const char* kOtherRecordingOptions[] = {"--depth-scale", "--depth-noise", "--of-camera"};

bool is_recording(const std::filesystem::path& path) {
  return path.extension() == ".mcap" || path.extension() == ".db3" || std::filesystem::is_directory(path);
}

/// kInvalidInput for an option that is for the other kind of file.
core::Status check_options(const InspectOptions& options, bool recording) {
  std::vector<std::string> others(std::begin(kMeshOptions), std::end(kMeshOptions));
  if (!recording) {
    others = frame_options(*options.verb);
    others.insert(others.end(), std::begin(kOtherRecordingOptions), std::end(kOtherRecordingOptions));
  }
  for (const std::string& name : others)
    if (options.verb->count(name) > 0)
      return core::invalid_input(name + " is for " + (recording ? "meshes" : "recordings") + ", and " + options.file +
                                 " is " + (recording ? "a recording" : "no recording (.mcap, .db3, or a folder)") +
                                 ": leave it out, or name another file");
  return core::ok_status();
}

std::string text_of(const MeshInspection& found) {
  const auto size = found.box.sizes();
  // All that follows is of no use where the unit is wrong.
  std::string text = found.doubtful_scale ? "warning: " + *found.doubtful_scale + " (--scale)\n" : "";
  text += found.path.string() + ": " + std::to_string(found.loaded.mesh.triangles.size()) + " triangles, " +
          fixed_text(size.x(), 4) + " x " + fixed_text(size.y(), 4) + " x " + fixed_text(size.z(), 4) + " m, " +
          (found.inside_out              ? "closed, but inside out"
           : found.topology.watertight() ? "closed"
                                         : "not closed") +
          "\n";
  const auto& mass = found.mass ? found.mass : found.hull_mass;
  if (mass) {
    const geometry::Vector3d& com = mass->p_BoBcm;
    text += std::string(found.mass ? "volume " : "volume of its convex hull ") +
            fixed_text(1e6 * mass->mass / found.density, 1) + " cm^3, mass " + fixed_text(mass->mass, 4) + " kg at " +
            fixed_text(found.density, 0) + " kg/m^3, centre of mass (" + fixed_text(com.x(), 4) + ", " +
            fixed_text(com.y(), 4) + ", " + fixed_text(com.z(), 4) + ") m\n";
  }
  if (const auto& hull = found.lockstep_hull; hull && hull->error > 0.0)
    text += "convex hull: " + std::to_string(hull->vertices) + " vertices, in lockstep " + std::to_string(hull->kept) +
            ", which stay up to " + fixed_text(1e3 * hull->error, 2) + " mm behind\n";
  text += "symmetry: " + symmetry_text(found.symmetry) + "\n";
  if (!found.resting_poses.empty()) {
    std::vector<std::vector<std::string>> rows = {
        {"lies with (body axis down)", "probability", "falls over at, deg", "centre of mass at, mm", "origin at, mm"}};
    for (std::size_t i = 0; i < std::min<std::size_t>(found.resting_poses.size(), 8); ++i) {
      const geometry::RestingPose& pose = found.resting_poses[i];
      const geometry::Vector3d down = pose.R_WB.inverse() * -geometry::Vector3d::UnitZ();
      rows.push_back({fixed_text(down.x(), 2) + " " + fixed_text(down.y(), 2) + " " + fixed_text(down.z(), 2),
                      fixed_text(pose.probability, 3), fixed_text(pose.tip_angle * 180.0 / std::numbers::pi, 1),
                      fixed_text(1e3 * pose.height, 1), fixed_text(1e3 * origin_height(found, pose), 1)});
    }
    text += "\n" + table(rows);
    double rest = 0.0;
    for (std::size_t i = rows.size() - 1; i < found.resting_poses.size(); ++i)
      rest += found.resting_poses[i].probability;
    if (rest > 0.0)
      text += "and " + std::to_string(found.resting_poses.size() + 1 - rows.size()) + " more, together " +
              fixed_text(rest, 3) + "\n";
  }
  for (const std::string& remark : found.remarks)
    if (remark != found.doubtful_scale) text += "remark: " + remark + "\n";
  return text;
}

std::string scene_yaml(const rendering::SensorModelOptions& settings) {
  const auto list = [](std::span<const double> values) {
    std::string text;
    for (const double value : values) text += (text.empty() ? "[" : ", ") + core::rounded_text(value);
    return text + "]";
  };
  return "depth_noise:\n  sigma_per_depth_squared: " + core::rounded_text(settings.sigma_per_depth_squared) +
         "\n  incidence_knee: " + core::rounded_text(settings.incidence_knee) +
         "\n  incidence_missing: " + list(settings.incidence_missing) +
         "\n  outline_missing: " + list(settings.outline_missing) + "\n";
}

std::string text_of(const DepthNoise& noise) {
  std::vector<std::vector<std::string>> rows = {{"class", "up to", "pixels", "sigma / depth^2, 1/m", "missing, %"}};
  const auto add = [&rows](const char* name, const std::vector<DepthNoiseClass>& classes) {
    for (const DepthNoiseClass& c : classes)
      rows.push_back({name, fixed_text(c.limit, 2), std::to_string(c.pixels), fixed_text(c.sigma, 5),
                      fixed_text(100.0 * c.missing, 1)});
  };
  add("depth, m", noise.by_depth);
  add("cosine of incidence", noise.by_incidence);
  add("pixels from an edge", noise.by_edge);
  std::string text = std::to_string(noise.frames) + " frames, " + std::to_string(noise.pixels) + " pixels\n" +
                     table(rows) + "\nsigma over time " + fixed_text(noise.sigma_over_time, 5) + " / m x depth^2, " +
                     fixed_text(100.0 * noise.missing, 1) + " % missing, " + fixed_text(100.0 * noise.outliers, 2) +
                     " % outliers (frontal, far from edges)\n";
  if (noise.quantisation_per_depth_squared)
    text += "steps of " + fixed_text(*noise.quantisation_per_depth_squared, 5) + " / m x depth^2\n";
  if (noise.step) text += "steps of " + fixed_text(1e3 * *noise.step, 2) + " mm\n";
  text += "for the scene file:\n\n" + scene_yaml(noise.settings) + "\n";
  for (const std::string& remark : noise.remarks) text += "remark: " + remark + "\n";
  return text;
}

core::Status inspect_mesh(InspectOptions& options, VerbContext& context) {
  if (!options.use.empty() && options.model.empty())
    return core::invalid_input("--use is written into the model file: name one with -o, or leave it out");
  PRESCENE_RETURN_IF_ERROR(check_output("-o", options.model, {options.file}));
  PRESCENE_RETURN_IF_ERROR(check_apart("-o", options.model, "--report", options.report));
  PRESCENE_RETURN_IF_ERROR(check_output("--report", options.report, {options.file}));
  if (options.y_up) options.inspection.read.up_axis = interfaces::UpAxis::kY;
  if (!options.use.empty()) {
    for (const auto& [word, use] : interfaces::mesh_uses())
      if (word == options.use) options.inspection.use = use;
  }
  options.inspection.read.cancellation = &context.cancellation();
  // Of smaller meshes all is printed before anybody could read how far it is.
  constexpr std::uintmax_t kTakesSeconds = std::uintmax_t{4} << 20;
  std::error_code ignored;
  if (const auto bytes = std::filesystem::file_size(options.file, ignored); !ignored && bytes > kTakesSeconds)
    options.inspection.progress = context.progress("inspecting");
  const core::Result<MeshInspection> inspected = service::inspect_mesh(options.file, options.inspection);
  context.end_progress();
  PRESCENE_TRY(const MeshInspection found, inspected);
  if (!options.model.empty()) {
    PRESCENE_TRY(const interfaces::ModelFile model, model_file(found, options.inspection, options.model));
    PRESCENE_RETURN_IF_ERROR(interfaces::write_model(options.model, model));
  }
  if (!options.report.empty()) PRESCENE_RETURN_IF_ERROR(write_mesh_report(options.report, found));
  context.print(to_json(found),
                text_of(found) + (options.model.empty() ? "" : "model written to " + options.model + "\n"));
  return core::ok_status();
}

core::Status run(InspectOptions& options, VerbContext& context) {
  const bool recording = is_recording(options.file);
  PRESCENE_RETURN_IF_ERROR(check_options(options, recording));
  if (!recording) return inspect_mesh(options, context);
  PRESCENE_RETURN_IF_ERROR(check_folder_options(*options.verb, options.file));
  const std::vector<std::string> of_frames = frame_options(*options.verb);
  const auto given = [&options](const std::string& name) { return options.verb->count(name) > 0; };
  if (options.depth_noise) {
    for (const std::string& name : of_frames)
      if (given(name)) return core::invalid_input(name + " does not go with --depth-noise: leave one of them out");
    if (!options.camera.empty() && !interfaces::is_bag(options.file))
      return core::invalid_input("--of-camera is for recordings of several cameras, and " + options.file +
                                 " is a folder of images: leave it out");
    PRESCENE_TRY(const DepthNoise noise,
                 depth_noise_of(options.file, options.recording.input.metres_per_unit, context.progress("reading"),
                                context.cancellation(), options.camera));
    context.print(to_json(noise), text_of(noise));
    return core::ok_status();
  }
  if (interfaces::is_bag(options.file) && std::none_of(of_frames.begin(), of_frames.end(), given))
    return describe_recording(options.file, context);
  options.recording.verb = options.verb;
  options.recording.input.path = options.file;
  options.recording.input.scene_file = options.scene;
  return inspect_recording(options.recording, context);
}

}  // namespace

Verb add_inspect_verb(CLI::App& app) {
  auto* verb = app.add_subcommand(
      "inspect",
      "What a mesh holds (scale, closedness, mass, symmetry, how it can lie), and a model file of it; what a recording "
      "holds (topics, rates, gaps, cameras, problems); or what is believed at one of its frames, and why");
  auto options = std::make_shared<InspectOptions>();
  verb->add_option("FILE", options->file,
                   "Mesh (PLY, OBJ, STL, glTF, COLLADA), or recording (.mcap, .db3, folder of rosbag2 or of images)")
      ->required();
  verb->add_option("-o,--output", options->model, "Write a model file that scene files can name")->check(file_name());
  verb->add_option("--use", options->use,
                   "With -o: what the mesh collides as; default: by its shape, hollow objects as spheres")
      ->check(one_of({"convex_hull", "convex_parts", "decompose", "spheres"}));
  verb->add_option("--density", options->inspection.density, "kg/m^3")
      ->check(number_between(0.1, 25000.0))
      ->capture_default_str();
  verb->add_option("--scale", options->inspection.read.metres_per_unit,
                   "Metres per unit of the file: 0.001 for millimetres")
      ->check(number_between(1e-6, 1e6))
      ->capture_default_str();
  verb->add_flag("--y-up", options->y_up, "The file's y axis points up");
  verb->add_option("--report", options->report, "Write an HTML page with pictures")->check(file_name());
  verb->add_option("--frame", options->recording.frame, "Of a recording: from 0, over the frames that can be used")
      ->check(CLI::Range(0, 1 << 30))
      ->capture_default_str();
  verb->add_option("--scene", options->scene, "Of a recording: scene file; default: the one that it holds");
  verb->add_option("--depth-scale", options->recording.input.metres_per_unit,
                   "Of a folder: metres per unit of the depth images")
      ->check(positive_number())
      ->capture_default_str();
  verb->add_flag("--depth-noise", options->depth_noise,
                 "Of a recording in which nothing moves: the depth camera's noise, and the sensor model's settings");
  verb->add_option("--of-camera", options->camera, "With --depth-noise: which of the cameras that the scene lists")
      ->check(utf8_text())
      ->needs("--depth-noise");
  verb->add_option("--overlay", options->recording.overlay,
                   "Of a recording: write a PNG of the camera's picture with the belief drawn over it")
      ->check(file_name());
  verb->add_option("--likelihood-map", options->recording.likelihood_map,
                   "Of a recording: write a PNG of what each pixel says for or against the poses believed")
      ->check(file_name());
  add_topic_options(*verb, options->recording.tracker);
  add_camera_options(*verb, options->recording.tracker.assembler);
  options->verb = verb;
  verb->footer(
      "Examples: prescene inspect cup.stl --scale 0.001 -o cup.yaml --report cup.html\n"
      "          prescene inspect milk.mcap\n"
      "          prescene inspect milk.mcap --frame 40 --overlay seen.png --likelihood-map why.png");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
