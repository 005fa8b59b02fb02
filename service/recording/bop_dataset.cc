// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/bop_dataset.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "bop_models.h"
#include "prescene/belief/json.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/images/png.h"

namespace prescene::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr double kMetresPerUnit = 0.001;  // of depth images, as they are recorded
constexpr double kMmPerMetre = 1000.0;

std::string six_digits(std::uint64_t number) {
  const std::string digits = std::to_string(number);
  return digits.size() < 6 ? std::string(6 - digits.size(), '0') + digits : digits;
}

core::Status cannot_be_made(const fs::path& folder, const std::error_code& error) {
  return core::unavailable(folder.string() + ": cannot be made: " + error.message());
}

ordered_json row_wise(const geometry::Matrix3d& matrix) {
  ordered_json values = ordered_json::array();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) values.push_back(matrix(row, column));
  return values;
}

geometry::Matrix3d rotation_of(const geometry::Pose& X) { return X.rotation.normalized().toRotationMatrix(); }

ordered_json in_mm(const geometry::Vector3d& p) {
  return ordered_json::array({kMmPerMetre * p.x(), kMmPerMetre * p.y(), kMmPerMetre * p.z()});
}

/// One more entry of a JSON object, on a line of its own, whose end close() adds.
void append_entry(std::uint64_t image, const ordered_json& entry, std::string& document) {
  document += document.empty() ? "{\n  \"" : ",\n  \"";
  document += std::to_string(image) + "\": " + belief::json_text(entry);
}

/// Where a label is in an image, and how often.
struct Silhouette {
  int first_x = 0, last_x = 0, first_y = 0, last_y = 0;
  int pixels = 0;

  /// (x, y, width, height) as bop_toolkit has it, with pixel (x, y) as the origin.
  ordered_json box(int x, int y) const {
    return ordered_json::array({first_x - x, first_y - y, last_x - first_x, last_y - first_y});
  }
};

Silhouette silhouette_of(const geometry::LabelImage& labels, std::uint16_t label) {
  Silhouette found;
  for (int y = 0; y < labels.height(); ++y) {
    for (int x = 0; x < labels.width(); ++x) {
      if (labels(x, y) != label) continue;
      if (found.pixels++ == 0) found = {x, x, y, y, 1};
      found.first_x = std::min(found.first_x, x);
      found.last_x = std::max(found.last_x, x);
      found.last_y = y;
    }
  }
  return found;
}

core::Status write_mask(const fs::path& path, const geometry::LabelImage& labels, std::uint16_t label) {
  geometry::Image<std::uint8_t> mask(labels.width(), labels.height());
  std::transform(labels.data(), labels.data() + labels.size(), mask.data(),
                 [&](std::uint16_t pixel) { return static_cast<std::uint8_t>(pixel == label ? 255 : 0); });
  return interfaces::write_png(path, std::as_const(mask).view());
}

/// An object as if nothing stood before it.
class AloneView {
 public:
  AloneView(const rendering::RenderInstance& instance, const belief::SceneCamera& camera, rendering::Renderer& renderer)
      : camera_(camera), renderer_(renderer) {
    scene_.instances.push_back(instance);
  }

  core::Status render() {
    PRESCENE_RETURN_IF_ERROR(renderer_.render(scene_, camera_.intrinsics, camera_.X_WC, {}, &view_));
    whole_ = silhouette_of(view_.labels, 1);
    const auto& [first_x, last_x, first_y, last_y, pixels] = whole_;
    const bool ends_inside = pixels > 0 && first_x > 0 && first_y > 0 && last_x + 1 < camera_.intrinsics.width &&
                             last_y + 1 < camera_.intrinsics.height;
    return ends_inside ? core::ok_status() : render_beyond_the_border();
  }

  const geometry::LabelImage& labels() const { return view_.labels; }
  /// Also of what lies beyond the image's border.
  const Silhouette& whole() const { return whole_; }
  ordered_json whole_box() const { return whole_.box(margin_x_, margin_y_); }

 private:
  core::Status render_beyond_the_border() {
    const int most = renderer_.info().max_image_size;
    geometry::PinholeCamera wide = camera_.intrinsics;
    margin_x_ = std::clamp((most - wide.width) / 2, 0, wide.width);
    margin_y_ = std::clamp((most - wide.height) / 2, 0, wide.height);
    wide.width += 2 * margin_x_;
    wide.height += 2 * margin_y_;
    wide.cx += margin_x_;
    wide.cy += margin_y_;
    rendering::RenderedView view;
    PRESCENE_RETURN_IF_ERROR(renderer_.render(scene_, wide, camera_.X_WC, {}, &view));
    whole_ = silhouette_of(view.labels, 1);
    return core::ok_status();
  }

  const belief::SceneCamera& camera_;
  rendering::Renderer& renderer_;
  rendering::RenderScene scene_;
  rendering::RenderedView view_;
  Silhouette whole_;
  int margin_x_ = 0, margin_y_ = 0;
};

}  // namespace

BopDataset::BopDataset(const fs::path& folder, const belief::Scene& scene, rendering::Renderer& renderer)
    : folder_(folder), renderer_(renderer), models_(scene.models), ids_(scene.models.size(), 0) {
  for (const belief::SceneObject& object : scene.objects) ids_[static_cast<std::size_t>(object.model)] = 1;
  int used = 0;
  for (int& id : ids_) id = id > 0 ? ++used : 0;
  for (int i = 0; i < belief::camera_count(scene); ++i)
    cameras_.push_back({folder / six_digits(static_cast<std::uint64_t>(i)), 0, "", "", ""});
}

core::Result<std::unique_ptr<BopDataset>> BopDataset::create(const fs::path& folder, const belief::Scene& scene,
                                                             rendering::Renderer& renderer) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error))
    return core::invalid_input(folder.string() + ": is no folder; name one that is new or empty");
  fs::create_directories(folder, error);
  if (error) return cannot_be_made(folder, error);
  const bool is_empty = fs::is_empty(folder, error);
  if (error) return core::unavailable(folder.string() + ": cannot be looked at: " + error.message());
  if (!is_empty)
    return core::invalid_input(folder.string() +
                               ": is not empty; name a folder that is new or empty, as labels of two runs would mix");
  PRESCENE_TRY(const fs::path trial, interfaces::create_beside(folder / "models", folder));
  fs::remove(trial, error);
  return std::unique_ptr<BopDataset>(new BopDataset(folder, scene, renderer));
}

core::Status BopDataset::begin() {
  if (has_begun_) return core::ok_status();
  has_begun_ = true;
  std::error_code error;
  std::vector<fs::path> folders = {folder_ / "models"};
  for (const CameraFolder& camera : cameras_)
    for (const char* name : {"rgb", "depth", "mask", "mask_visib"}) folders.push_back(camera.path / name);
  for (const fs::path& folder : folders) {
    fs::create_directories(folder, error);
    if (error) return cannot_be_made(folder, error);
  }
  return write_models();
}

core::Status BopDataset::write_models() const {
  ordered_json infos = ordered_json::object();
  ordered_json names = ordered_json::object();
  for (std::size_t i = 0; i < models_.size(); ++i) {
    if (ids_[i] == 0) continue;
    const std::string id = std::to_string(ids_[i]);
    infos[id] = bop_model_info(models_[i]);
    names[id] = models_[i].name;
    const fs::path path = folder_ / "models" / ("obj_" + six_digits(static_cast<std::uint64_t>(ids_[i])) + ".ply");
    PRESCENE_RETURN_IF_ERROR(interfaces::write_file(path, std::string_view(bop_model_ply(models_[i]))));
  }
  for (const auto& [name, document] : {std::pair{"models_info.json", infos}, {"names.json", names}}) {
    const std::string text = belief::json_text(document, 2) + "\n";
    PRESCENE_RETURN_IF_ERROR(interfaces::write_file(folder_ / "models" / name, std::string_view(text)));
  }
  return core::ok_status();
}

core::Status BopDataset::add(const SimulatedFrame& frame) {
  PRESCENE_RETURN_IF_ERROR(begin());
  CameraFolder& to = cameras_[static_cast<std::size_t>(frame.camera)];
  const belief::SceneCamera& camera = *belief::camera_at(frame.scene, frame.camera);
  const std::uint64_t image = to.images++;
  const std::string name = six_digits(image);

  PRESCENE_RETURN_IF_ERROR(interfaces::write_png(to.path / "rgb" / (name + ".png"), frame.color.view()));
  const std::vector<std::uint8_t> depth = interfaces::encode_png_depth(frame.depth.view(), kMetresPerUnit);
  PRESCENE_RETURN_IF_ERROR(interfaces::write_file(to.path / "depth" / (name + ".png"), depth));
  PRESCENE_TRY(const geometry::Image<std::uint16_t> units, interfaces::decode_png_gray16(depth));

  const geometry::Pose X_CW = camera.X_WC.inverse();
  const geometry::PinholeCamera& k = camera.intrinsics;
  append_entry(image,
               {{"cam_K", ordered_json::array({k.fx, 0.0, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0})},
                {"cam_R_w2c", row_wise(rotation_of(X_CW))},
                {"cam_t_w2c", in_mm(X_CW.translation)},
                {"depth_scale", kMmPerMetre * kMetresPerUnit}},
               to.camera);
  ordered_json truth = ordered_json::array();
  ordered_json info = ordered_json::array();
  for (std::size_t i = 0; i < frame.scene.objects.size(); ++i) {
    const rendering::RenderInstance& instance = frame.view.scene.instances[i];
    const auto label = static_cast<std::uint16_t>(i + 1);
    AloneView alone(instance, camera, renderer_);
    PRESCENE_RETURN_IF_ERROR(alone.render());
    const std::string mask_name = name + "_" + six_digits(i) + ".png";
    PRESCENE_RETURN_IF_ERROR(write_mask(to.path / "mask" / mask_name, alone.labels(), 1));
    PRESCENE_RETURN_IF_ERROR(write_mask(to.path / "mask_visib" / mask_name, frame.images.labels, label));

    const geometry::Pose X_CO = X_CW * instance.X_WM;
    truth.push_back({{"cam_R_m2c", row_wise(rotation_of(X_CO))},
                     {"cam_t_m2c", in_mm(X_CO.translation)},
                     {"obj_id", ids_[static_cast<std::size_t>(frame.scene.objects[i].model)]}});
    const Silhouette visible = silhouette_of(frame.images.labels, label);
    int measured = 0;
    for (std::size_t pixel = 0; pixel < units.size(); ++pixel)
      if (alone.labels().data()[pixel] != 0 && units.data()[pixel] != 0) ++measured;
    const ordered_json nowhere = ordered_json::array({-1, -1, -1, -1});
    const int all = alone.whole().pixels;
    info.push_back({{"bbox_obj", visible.pixels > 0 ? alone.whole_box() : nowhere},
                    {"bbox_visib", visible.pixels > 0 ? visible.box(0, 0) : nowhere},
                    {"px_count_all", all},
                    {"px_count_valid", measured},
                    {"px_count_visib", visible.pixels},
                    {"visib_fract", all > 0 ? static_cast<double>(visible.pixels) / all : 0.0}});
  }
  append_entry(image, truth, to.truth);
  append_entry(image, info, to.info);
  return core::ok_status();
}

core::Status BopDataset::close() {
  if (!has_begun_) return core::ok_status();
  for (const CameraFolder& camera : cameras_) {
    for (const auto& [name, document] : {std::pair{"scene_camera.json", &camera.camera},
                                         {"scene_gt.json", &camera.truth},
                                         {"scene_gt_info.json", &camera.info}}) {
      const std::string text = document->empty() ? "{}\n" : *document + "\n}\n";
      PRESCENE_RETURN_IF_ERROR(interfaces::write_file(camera.path / name, std::string_view(text)));
    }
  }
  return core::ok_status();
}

core::Status BopDataset::discard() {
  std::error_code error, failed;
  std::vector<fs::path> written = {folder_ / "models"};
  for (const CameraFolder& camera : cameras_) written.push_back(camera.path);
  for (const fs::path& path : written) {
    fs::remove_all(path, error);
    if (error && !failed) failed = error;
  }
  if (failed)
    return core::unavailable(folder_.string() + ": can't be removed: " + failed.message() +
                             "; remove it, what is in it is not complete");
  fs::remove(folder_, error);  // only if nothing is in it
  return core::ok_status();
}

}  // namespace prescene::service
