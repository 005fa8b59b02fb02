// SPDX-License-Identifier: Apache-2.0
// Training data against an independent reference: boxes whose rays and corners are worked out from the files alone.
#include "prescene/service/recording/bop_dataset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "prescene/interfaces/images/png.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/load_scene.h"
#include "tests/support/paths.h"

namespace prescene::service::bop_dataset_test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using nlohmann::json;
using testing::HasSubstr;

namespace fs = std::filesystem;

/// A box that another one of the same model hides in part, and a plank that reaches out of the first camera's image.
const char* kScene = R"(name: labelled
duration: 0.5
models:
  unused: {box: [0.1, 0.1, 0.1], mass: 0.4}
  carton: {box: [0.12, 0.08, 0.1], mass: 0.4, symmetry: {axis: z, order: 2}}
  plank: {box: [0.06, 0.7, 0.02], mass: 0.4}
supports:
  table: {box: [1.6, 1.6, 0.04], pose: {position: [0, 0, -0.02]}}
objects:
  behind: {model: carton, pose: {position: [-0.1, 0.02, 0.05], rotation: {euler_deg: [0, 0, 30]}}}
  before: {model: carton, pose: {position: [0.06, -0.02, 0.05]}}
  plank: {model: plank, pose: {position: [0.2, 0.1, 0.01]}}
cameras:
  - {name: front, width: 160, height: 120, fov_deg: 45, look: {from: [0.8, 0, 0.4], at: [0, 0, 0.04]}}
  - {name: side, width: 120, height: 100, fov_deg: 60, look: {from: [-0.5, -0.7, 0.6], at: [0, 0, 0.04]}}
)";

std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_TRUE(file.good()) << path;
  return text.str();
}

json document(const fs::path& path) { return json::parse(text_of(path)); }

Vector3d vector_of(const json& values) {
  EXPECT_EQ(values.size(), 3u);
  return {values.at(0).get<double>(), values.at(1).get<double>(), values.at(2).get<double>()};
}

Matrix3d matrix_of(const json& values) {
  EXPECT_EQ(values.size(), 9u);
  Matrix3d matrix;
  for (int i = 0; i < 9; ++i) matrix(i / 3, i % 3) = values.at(static_cast<std::size_t>(i)).get<double>();
  return matrix;
}

/// A box as models_info.json has it, where scene_gt.json says it is, before the camera of scene_camera.json. All in mm.
class SeenBox {
 public:
  SeenBox(const json& camera, const json& truth, const json& model)
      : K_(matrix_of(camera["cam_K"])), R_(matrix_of(truth["cam_R_m2c"])), t_(vector_of(truth["cam_t_m2c"])) {
    const auto of = [&](const char* key) { return model.at(key).get<double>(); };
    low_ = Vector3d(of("min_x"), of("min_y"), of("min_z"));
    high_ = low_ + Vector3d(of("size_x"), of("size_y"), of("size_z"));
    ray_of_pixel_ = R_.transpose() * K_.inverse();
    from_ = -R_.transpose() * t_;
  }

  /// z where the ray of a pixel enters the box; nothing where it passes by. By slabs.
  std::optional<double> depth_at(double u, double v) const {
    const Vector3d ray = ray_of_pixel_ * Vector3d(u, v, 1.0);
    double enter = 0.0;
    double leave = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      const double one = (low_[axis] - from_[axis]) / ray[axis];
      const double other = (high_[axis] - from_[axis]) / ray[axis];
      enter = std::max(enter, std::min(one, other));
      leave = std::min(leave, std::max(one, other));
    }
    return enter < leave ? std::optional<double>(enter) : std::nullopt;
  }

  /// Whether rays near by say the same: near an edge, single precision may go either way.
  bool is_sure_at(double u, double v) const {
    const bool is_hit = depth_at(u, v).has_value();
    for (const double du : {-0.01, 0.01})
      for (const double dv : {-0.01, 0.01})
        if (depth_at(u + du, v + dv).has_value() != is_hit) return false;
    return true;
  }

  /// Of the projected corners: smallest u and v, largest u and v.
  std::array<double, 4> bounds() const {
    std::array<double, 4> bounds = {1e9, 1e9, -1e9, -1e9};
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d p_M((corner & 1) != 0 ? low_.x() : high_.x(), (corner & 2) != 0 ? low_.y() : high_.y(),
                         (corner & 4) != 0 ? low_.z() : high_.z());
      const Vector3d seen = K_ * (R_ * p_M + t_);
      EXPECT_GT(seen.z(), 0.0);
      const double u = seen.x() / seen.z();
      const double v = seen.y() / seen.z();
      bounds = {std::min(bounds[0], u), std::min(bounds[1], v), std::max(bounds[2], u), std::max(bounds[3], v)};
    }
    return bounds;
  }

 private:
  Matrix3d K_, R_, ray_of_pixel_;
  Vector3d t_, low_, high_, from_;
};

/// The pixels that a box covers, also beyond the border of the image.
struct Covered {
  int sure = 0, unsure = 0;
  std::array<int, 4> box = {1'000'000, 1'000'000, -1'000'000, -1'000'000};  // of those that are sure: first, last

  void add(int x, int y) {
    ++sure;
    box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x), std::max(box[3], y)};
  }
};

json box_of(const geometry::LabelImage& mask) {
  int first_x = mask.width(), first_y = mask.height(), last_x = -1, last_y = -1;
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      if (mask(x, y) == 0) continue;
      first_x = std::min(first_x, x);
      last_x = std::max(last_x, x);
      first_y = std::min(first_y, y);
      last_y = std::max(last_y, y);
    }
  }
  if (last_x < 0) return {-1, -1, -1, -1};
  return {first_x, first_y, last_x - first_x, last_y - first_y};
}

int count(const geometry::LabelImage& mask) {
  return static_cast<int>(
      std::count_if(mask.data(), mask.data() + mask.size(), [](std::uint16_t pixel) { return pixel != 0; }));
}

class BopDatasetTest : public testing::Test {
 protected:
  /// A camera without errors, unless told otherwise.
  BopDatasetTest() {
    options_.rate = 6.0;
    options_.camera.quantisation_per_depth_squared = 0.0;
    options_.camera.edge_outlier = {};
    options_.camera.interior_outlier = 0.0;
    options_.camera.missing = false;
    options_.sensor.sigma_per_depth_squared = 1e-6;
  }

  void record(const std::string& yaml = kScene) {
    const auto scene = load_scene_text(yaml, "scene.yaml", {});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    const auto renderer = backends_.make_renderer();
    ASSERT_TRUE(renderer.ok());
    const auto dataset = BopDataset::create(labels_, **scene, **renderer);
    ASSERT_TRUE(dataset.ok()) << dataset.status().message();
    const auto recording = RecordingWriter::create(recording_, {"scene.yaml", yaml, 1, ""});
    ASSERT_TRUE(recording.ok()) << recording.status().message();
    options_.on_frame = [&](const SimulatedFrame& frame) { return (*dataset)->add(frame); };
    const core::Status status = simulate_recording(**scene, options_, 1, backends_, {}, {}, **recording);
    ASSERT_TRUE(status.ok()) << status.message();
    ASSERT_TRUE((*recording)->close().ok());
    ASSERT_TRUE((*dataset)->close().ok());
  }

  fs::path in_camera(const std::string& camera, const std::string& name) const { return labels_ / camera / name; }

  geometry::LabelImage mask(const std::string& camera, const std::string& kind, const std::string& name) const {
    const auto image = interfaces::read_png_label(in_camera(camera, kind) / (name + ".png"));
    EXPECT_TRUE(image.ok()) << image.status().message();
    if (!image) return {};
    for (std::size_t i = 0; i < image->size(); ++i) {
      const std::uint16_t pixel = image->data()[i];
      EXPECT_TRUE(pixel == 0 || pixel == 255) << pixel;
    }
    return *image;
  }

  tests::ScratchDir folder_;
  fs::path labels_ = folder_.path() / "labels";
  fs::path recording_ = folder_.path() / "run.mcap";
  core::ThreadPool pool_{1};
  Backends backends_{pool_};
  SimulatedRecordingOptions options_;
};

TEST_F(BopDatasetTest, MasksBoxesAndDepthAreThoseOfTheProjectedBoxes) {
  record();
  const json models = document(labels_ / "models" / "models_info.json");
  int hidden = 0, cut = 0, compared = 0;
  for (const std::string camera : {"000000", "000001"}) {
    const json cameras = document(in_camera(camera, "scene_camera.json"));
    const json truths = document(in_camera(camera, "scene_gt.json"));
    const json infos = document(in_camera(camera, "scene_gt_info.json"));
    ASSERT_GE(cameras.size(), 3u);
    ASSERT_EQ(truths.size(), cameras.size());
    ASSERT_EQ(infos.size(), cameras.size());
    for (const std::string image : {"0", "2"}) {
      const std::string name = "00000" + image;
      const auto depth_file = interfaces::read_png_depth(in_camera(camera, "depth") / (name + ".png"), 1.0);
      ASSERT_TRUE(depth_file.ok()) << depth_file.status().message();
      const auto color = interfaces::read_png_size(in_camera(camera, "rgb") / (name + ".png"));
      ASSERT_TRUE(color.ok()) << color.status().message();
      EXPECT_EQ(color->width, depth_file->width());
      EXPECT_EQ(color->height, depth_file->height());
      const double scale = cameras[image]["depth_scale"].get<double>();
      ASSERT_EQ(truths[image].size(), 3u);
      ASSERT_EQ(infos[image].size(), 3u);
      for (std::size_t object = 0; object < 3; ++object) {
        SCOPED_TRACE(camera + " " + name + " " + std::to_string(object));
        const json& truth = truths[image][object];
        const json& info = infos[image][object];
        const SeenBox box(cameras[image], truth, models[std::to_string(truth["obj_id"].get<int>())]);
        const std::string mask_name = name + "_00000" + std::to_string(object);
        const geometry::LabelImage whole = mask(camera, "mask", mask_name);
        const geometry::LabelImage visible = mask(camera, "mask_visib", mask_name);
        ASSERT_EQ(whole.width(), depth_file->width());
        ASSERT_EQ(visible.height(), depth_file->height());
        const std::array<double, 4> bounds = box.bounds();
        Covered covered;
        int in_bounds = 0, valid = 0;
        for (int y = static_cast<int>(bounds[1]) - 2; y < bounds[3] + 2.0; ++y) {
          for (int x = static_cast<int>(bounds[0]) - 2; x < bounds[2] + 2.0; ++x) {
            const auto depth = box.depth_at(x, y);
            const bool is_sure = box.is_sure_at(x, y);
            if (!is_sure) ++covered.unsure;
            if (is_sure && depth) covered.add(x, y);
            if (x < 0 || y < 0 || x >= whole.width() || y >= whole.height()) continue;
            const double measured = scale * static_cast<double>((*depth_file)(x, y));
            in_bounds += whole(x, y) != 0 ? 1 : 0;
            valid += whole(x, y) != 0 && measured > 0.0 ? 1 : 0;
            if (is_sure) {
              EXPECT_EQ(whole(x, y) != 0, depth.has_value()) << x << " " << y;
            }
            if (visible(x, y) == 0) continue;
            EXPECT_NE(whole(x, y), 0) << x << " " << y;
            if (!is_sure || !depth) continue;
            ++compared;
            EXPECT_NEAR(measured, *depth, 0.6) << x << " " << y;  // rounded to 1 mm
          }
        }
        EXPECT_EQ(in_bounds, count(whole)) << "nothing is covered outside of the corners";
        const int all = info["px_count_all"].get<int>();
        EXPECT_GE(all, covered.sure);
        EXPECT_LE(all, covered.sure + covered.unsure);
        EXPECT_EQ(info["px_count_valid"].get<int>(), valid);
        EXPECT_EQ(info["px_count_visib"].get<int>(), count(visible));
        EXPECT_EQ(info["bbox_visib"], box_of(visible));
        ASSERT_GT(count(visible), 0);
        EXPECT_DOUBLE_EQ(info["visib_fract"].get<double>(), static_cast<double>(count(visible)) / all);
        const std::vector<int> bbox = info["bbox_obj"].get<std::vector<int>>();
        ASSERT_EQ(bbox.size(), 4u);
        EXPECT_NEAR(bbox[0], covered.box[0], 1);
        EXPECT_NEAR(bbox[1], covered.box[1], 1);
        EXPECT_NEAR(bbox[0] + bbox[2], covered.box[2], 1);
        EXPECT_NEAR(bbox[1] + bbox[3], covered.box[3], 1);
        if (bounds[0] < 0.0 || bounds[1] < 0.0 || bounds[2] > whole.width() - 1.0 || bounds[3] > whole.height() - 1.0) {
          ++cut;
          EXPECT_GT(all, count(whole));
        } else {
          EXPECT_EQ(all, count(whole));
          EXPECT_EQ(info["bbox_obj"], box_of(whole));
        }
        if (count(visible) < count(whole)) ++hidden;
      }
    }
  }
  // Else the scene shows too little.
  EXPECT_GT(compared, 2000);
  EXPECT_GE(hidden, 2);
  EXPECT_GE(cut, 2);
}

TEST_F(BopDatasetTest, CamerasAgreeOnWhereThingsAreAndWithTheRecording) {
  options_.camera = {};  // with its noise
  options_.sensor = {};
  record();
  std::vector<std::vector<Vector3d>> places;
  for (const std::string camera : {"000000", "000001"}) {
    const json cameras = document(in_camera(camera, "scene_camera.json"));
    const json truths = document(in_camera(camera, "scene_gt.json"));
    const Matrix3d R_CW = matrix_of(cameras["0"]["cam_R_w2c"]);
    const Vector3d p_CW = vector_of(cameras["0"]["cam_t_w2c"]);
    for (std::size_t object = 0; object < 3; ++object) {
      const Vector3d p_WO = R_CW.transpose() * (vector_of(truths["0"][object]["cam_t_m2c"]) - p_CW);
      places.resize(3);
      places[object].push_back(p_WO);
    }
  }
  const std::array<Vector3d, 3> in_scene = {Vector3d(-100, 20, 50), Vector3d(60, -20, 50), Vector3d(200, 100, 10)};
  for (std::size_t object = 0; object < 3; ++object)
    for (const Vector3d& place : places[object]) EXPECT_LT((place - in_scene[object]).norm(), 1.0) << object;

  const auto reader = RecordingReader::open(recording_);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  std::array<int, 2> frames{};
  for (auto entry = (*reader)->next(); entry.ok() && entry->has_value(); entry = (*reader)->next()) {
    const interfaces::ReceivedMessage& message = (*entry)->message;
    if ((*entry)->is_json || message.type != "sensor_msgs/msg/Image") continue;
    const auto image = interfaces::decode_cdr<interfaces::RosImage>(message.cdr);
    ASSERT_TRUE(image.ok());
    if (image->encoding != "16UC1") continue;
    const std::size_t camera = message.topic.rfind("/front/", 0) == 0 ? 0 : 1;
    const fs::path path =
        in_camera("00000" + std::to_string(camera), "depth") / ("00000" + std::to_string(frames[camera]++) + ".png");
    const auto written = interfaces::read_png_label(path);
    ASSERT_TRUE(written.ok()) << written.status().message();
    ASSERT_EQ(image->data.size(), 2 * written->size());
    for (std::size_t i = 0; i < written->size(); ++i)
      ASSERT_EQ(image->data[2 * i] + 256 * image->data[2 * i + 1], written->data()[i]) << path << " " << i;
  }
  for (std::size_t camera = 0; camera < 2; ++camera) {
    const json cameras = document(in_camera("00000" + std::to_string(camera), "scene_camera.json"));
    EXPECT_EQ(cameras.size(), static_cast<std::size_t>(frames[camera]));
    EXPECT_GE(frames[camera], 3);
  }
}

TEST_F(BopDatasetTest, ModelsAreInMillimetresAndNamed) {
  record();
  EXPECT_EQ(document(labels_ / "models" / "names.json"), json({{"1", "carton"}, {"2", "plank"}}));
  const json infos = document(labels_ / "models" / "models_info.json");
  ASSERT_EQ(infos.size(), 2u);
  const json& carton = infos["1"];
  EXPECT_NEAR(carton["diameter"].get<double>(), std::sqrt(120.0 * 120.0 + 80.0 * 80.0 + 100.0 * 100.0), 1e-6);
  EXPECT_NEAR(carton["min_x"].get<double>(), -60.0, 1e-9);
  EXPECT_NEAR(carton["min_y"].get<double>(), -40.0, 1e-9);
  EXPECT_NEAR(carton["min_z"].get<double>(), -50.0, 1e-9);
  EXPECT_NEAR(carton["size_x"].get<double>(), 120.0, 1e-9);
  EXPECT_NEAR(carton["size_y"].get<double>(), 80.0, 1e-9);
  EXPECT_NEAR(carton["size_z"].get<double>(), 100.0, 1e-9);
  for (const auto& [id, info] : infos.items()) {
    const fs::path path = labels_ / "models" / ("obj_00000" + id + ".ply");
    const auto mesh = interfaces::read_mesh(path, {.metres_per_unit = 0.001});
    ASSERT_TRUE(mesh.ok()) << mesh.status().message();
    const geometry::Box box = geometry::bounding_box(mesh->mesh);
    EXPECT_NEAR(1000.0 * box.sizes().x(), info["size_x"].get<double>(), 1e-9);
    EXPECT_NEAR(1000.0 * box.min().z(), info["min_z"].get<double>(), 1e-9);
    EXPECT_EQ(mesh->colors.size(), mesh->mesh.vertices.size());
    EXPECT_THAT(text_of(path), HasSubstr("property double nx\n"));
  }
  const json truth = document(in_camera("000000", "scene_gt.json"))["0"];
  EXPECT_EQ(truth[0]["obj_id"].get<int>(), 1);
  EXPECT_EQ(truth[1]["obj_id"].get<int>(), 1);
  EXPECT_EQ(truth[2]["obj_id"].get<int>(), 2);
  // The half turn about z, row by row.
  ASSERT_EQ(carton["symmetries_discrete"].size(), 1u);
  const std::array<double, 16> half_turn = {-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  for (std::size_t i = 0; i < half_turn.size(); ++i)
    EXPECT_NEAR(carton["symmetries_discrete"][0][i].get<double>(), half_turn[i], 1e-12) << i;
}

TEST_F(BopDatasetTest, WhatIsNotThereHasNoLabel) {
  options_.changes = {*removal_from_text("0.25:behind")};
  record();
  const json truths = document(in_camera("000000", "scene_gt.json"));
  EXPECT_EQ(truths["0"].size(), 3u);
  EXPECT_EQ(truths["2"].size(), 2u);
  EXPECT_TRUE(fs::exists(in_camera("000000", "mask/000002_000001.png")));
  EXPECT_FALSE(fs::exists(in_camera("000000", "mask/000002_000002.png")));
}

TEST_F(BopDatasetTest, OnlyANewOrEmptyFolderIsTaken) {
  const auto scene = load_scene_text(kScene, "scene.yaml", {});
  ASSERT_TRUE(scene.ok());
  const auto renderer = backends_.make_renderer();
  ASSERT_TRUE(BopDataset::create(labels_, **scene, **renderer).ok());
  ASSERT_TRUE(BopDataset::create(labels_, **scene, **renderer).ok()) << "nothing was written yet";
  std::ofstream(labels_ / "mine") << "precious";
  const auto full = BopDataset::create(labels_, **scene, **renderer);
  EXPECT_EQ(full.status().code(), core::StatusCode::kInvalidInput);
  EXPECT_THAT(full.status().message(), HasSubstr(labels_.string() + ": is not empty"));
  const auto file = BopDataset::create(labels_ / "mine", **scene, **renderer);
  EXPECT_EQ(file.status().code(), core::StatusCode::kInvalidInput);
  EXPECT_EQ(text_of(labels_ / "mine"), "precious");
}

TEST_F(BopDatasetTest, WhatIsDiscardedIsGone) {
  record();
  ASSERT_TRUE(fs::exists(in_camera("000000", "scene_gt.json")));
  const auto scene = load_scene_text(kScene, "scene.yaml", {});
  ASSERT_TRUE(scene.ok());
  const auto renderer = backends_.make_renderer();
  const auto discarded_of = [&](const fs::path& folder) {
    auto dataset = BopDataset::create(folder, **scene, **renderer);
    EXPECT_TRUE(dataset.ok()) << dataset.status().message();
    fs::create_directories(folder / "models");
    std::ofstream(folder / "models" / "obj_000001.ply") << "a part";
    return (*dataset)->discard();
  };
  const fs::path gone = labels_ / "gone", kept = labels_ / "kept";
  EXPECT_TRUE(discarded_of(gone).ok());
  EXPECT_FALSE(fs::exists(gone));
  // What somebody else wrote meanwhile stays.
  auto dataset = BopDataset::create(kept, **scene, **renderer);
  ASSERT_TRUE(dataset.ok()) << dataset.status().message();
  fs::create_directories(kept / "000000" / "rgb");
  std::ofstream(kept / "mine") << "precious";
  EXPECT_TRUE((*dataset)->discard().ok());
  EXPECT_FALSE(fs::exists(kept / "000000"));
  EXPECT_EQ(text_of(kept / "mine"), "precious");
}

TEST_F(BopDatasetTest, ThroughALensThereAreNoLabels) {
  const auto scene = load_scene_text(kScene, "scene.yaml", {});
  ASSERT_TRUE(scene.ok());
  options_.lens = *geometry::LensDistortion::brown({-0.28, 0.07, 0.001, -0.0005, 0.0, 0.0, 0.0, 0.0});
  options_.on_frame = [](const SimulatedFrame&) { return core::ok_status(); };
  const auto recording = RecordingWriter::create(recording_, {"scene.yaml", kScene, 1, ""});
  ASSERT_TRUE(recording.ok());
  const core::Status status = simulate_recording(**scene, options_, 1, backends_, {}, {}, **recording);
  EXPECT_EQ(status.code(), core::StatusCode::kInvalidInput);
  EXPECT_THAT(status.message(), HasSubstr("lens"));
}

}  // namespace
}  // namespace prescene::service::bop_dataset_test
