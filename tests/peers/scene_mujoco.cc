// SPDX-License-Identifier: Apache-2.0
#include "tests/peers/scene_mujoco.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "prescene/core/check.h"

namespace prescene::tests {
namespace {

using geometry::Pose;
using geometry::Vector3d;

// A box larger than this (m) is written as the plane of its upper side, for which MuJoCo's contacts are exact.
constexpr double kPlane = 3.0;
constexpr double kStandstill = 2e-3;  // m/s

std::string text(std::initializer_list<double> values) {
  std::string all;
  for (const double value : values) {
    std::array<char, 32> one;
    all.append(one.data(), static_cast<std::size_t>(std::snprintf(one.data(), one.size(), "%.17g ", value)));
  }
  return all;
}

std::string place(const Pose& X) {
  const auto& p = X.translation;
  const auto& q = X.rotation;
  return " pos='" + text({p.x(), p.y(), p.z()}) + "' quat='" + text({q.w(), q.x(), q.y(), q.z()}) + "'";
}

struct Geoms {
  std::string assets;
  int meshes = 0;

  std::string shape(const belief::CollisionShape& shape, const Pose& X_parent, bool fixed) {
    if (const auto* mesh = std::get_if<belief::MeshShape>(&shape)) {
      PRESCENE_CHECK(mesh->use == belief::MeshUse::kConvexHull);
      const std::string name = "mesh" + std::to_string(meshes++);
      assets += "<mesh name='" + name + "' vertex='";
      for (const Vector3d& v : mesh->mesh->vertices) assets += text({v.x(), v.y(), v.z()});
      assets += "'/>";
      return " type='mesh' mesh='" + name + "'" + place(X_parent * mesh->X_OS);
    }
    const auto& primitive = std::get<belief::PrimitiveShape>(shape);
    const Pose X = X_parent * primitive.X_OS;
    if (const auto* box = std::get_if<geometry::BoxShape>(&primitive.primitive)) {
      const Vector3d half = 0.5 * box->size;
      if (fixed && std::min(half.x(), half.y()) > 0.5 * kPlane)
        return " type='plane' size='0 0 1'" + place(X * Pose::from_translation({0.0, 0.0, half.z()}));
      return " type='box' size='" + text({half.x(), half.y(), half.z()}) + "'" + place(X);
    }
    if (const auto* ball = std::get_if<geometry::Sphere>(&primitive.primitive))
      return " type='sphere' size='" + text({ball->radius}) + "'" + place(X);
    const auto* cylinder = std::get_if<geometry::Cylinder>(&primitive.primitive);
    PRESCENE_CHECK(cylinder);
    return " type='cylinder' size='" + text({cylinder->radius, 0.5 * cylinder->length}) + "'" + place(X);
  }
};

std::string inertial(const belief::ObjectModel& model) {
  const double mass = belief::mean(model.mass);
  const Vector3d p = belief::mean(model.center_of_mass);
  const geometry::Matrix3d I = mass * model.unit_inertia;
  return "<inertial pos='" + text({p.x(), p.y(), p.z()}) + "' mass='" + text({mass}) + "' fullinertia='" +
         text({I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)}) + "'/>";
}

mjModel* load(const std::string& xml) {
  // Else warnings are written to a file in the working directory; they are counted in mjData all the same.
  mju_user_warning = [](const char*) {};
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  PRESCENE_CHECK(mj_makeEmptyFileVFS(files.get(), "scene.xml", static_cast<int>(xml.size())) == 0);
  std::memcpy(files->filedata[mj_findFileVFS(files.get(), "scene.xml")], xml.data(), xml.size());
  std::array<char, 512> error{};
  mjModel* model = mj_loadXML("scene.xml", files.get(), error.data(), static_cast<int>(error.size()));
  mj_deleteVFS(files.get());
  PRESCENE_CHECK_MSG(model, error.data());
  return model;
}

}  // namespace

struct MujocoScene::Impl {
  MujocoOptions options;
  mjModel* model = nullptr;
  mjData* data = nullptr;
  std::vector<int> body_of_geom;                       // objects first, then supports
  std::vector<std::pair<double, double>> of_supports;  // friction, restitution
  std::size_t objects = 0;

  void set_contacts(const belief::WorldState& start);
  bool nothing_moves() const;
};

// The force -k x - c v of what arrives at x = 0 becomes 0 at phase pi - 2 asin(z) of the damped oscillation, when the
// speed has fallen by exp(-z / sqrt(1 - z^2) phase).
double damping_ratio_of(double restitution) {
  double low = 0.0, high = 1.0 - 1e-9;
  for (int i = 0; i < 60; ++i) {
    const double z = 0.5 * (low + high);
    const double root = std::sqrt(1.0 - z * z);
    const double left = std::exp(-z / root * (std::numbers::pi - 2.0 * std::asin(z)));
    (left > restitution ? low : high) = z;
  }
  return 0.5 * (low + high);
}

MujocoScene::MujocoScene(const belief::Scene& scene, const MujocoOptions& options) : impl_(std::make_unique<Impl>()) {
  PRESCENE_CHECK(scene.robot.empty() && scene.actions.empty());
  impl_->options = options;
  impl_->objects = scene.objects.size();
  Geoms geoms;
  std::string bodies;
  std::vector<std::vector<std::string>> names;
  const auto geom = [&](const belief::CollisionShape& shape, const Pose& X, bool fixed) {
    const std::string name = "g" + std::to_string(names.size() - 1) + "_" + std::to_string(names.back().size());
    names.back().push_back(name);
    bodies += "<geom name='" + name + "' contype='0' conaffinity='0'" + geoms.shape(shape, X, fixed) + "/>";
  };
  for (const belief::SceneObject& object : scene.objects) {
    names.emplace_back();
    bodies += "<body><freejoint/>" + inertial(scene.model_of(object));
    for (const belief::CollisionShape& shape : scene.model_of(object).collision) geom(shape, Pose{}, false);
    bodies += "</body>";
  }
  for (const belief::Support& support : scene.supports) {
    names.emplace_back();
    for (const belief::CollisionShape& shape : support.collision) geom(shape, support.X_WS, true);
    impl_->of_supports.emplace_back(belief::mean(support.contact.friction), belief::mean(support.contact.restitution));
  }
  std::string pairs;
  for (std::size_t a = 0; a < impl_->objects; ++a) {
    for (std::size_t b = a + 1; b < names.size(); ++b) {
      for (const std::string& one : names[a]) {
        for (const std::string& other : names[b])
          pairs += "<pair condim='3' geom1='" + one + "' geom2='" + other + "'/>";
      }
    }
  }
  const Vector3d& g = scene.gravity_W;
  impl_->model =
      load("<mujoco><compiler inertiafromgeom='false'/><option timestep='" + text({options.step}) + "' gravity='" +
           text({g.x(), g.y(), g.z()}) + "' cone='" + (options.elliptic_cone ? "elliptic" : "pyramidal") +
           "' impratio='" + text({options.impedance_ratio}) + "'><flag multiccd='enable'/></option><asset>" +
           geoms.assets + "</asset><worldbody>" + bodies + "</worldbody><contact>" + pairs + "</contact></mujoco>");
  // MuJoCo sorts geoms and pairs in its own way.
  impl_->body_of_geom.resize(static_cast<std::size_t>(impl_->model->ngeom));
  for (std::size_t body = 0; body < names.size(); ++body)
    for (const std::string& name : names[body])
      impl_->body_of_geom[static_cast<std::size_t>(mj_name2id(impl_->model, mjOBJ_GEOM, name.c_str()))] =
          static_cast<int>(body);
  impl_->data = mj_makeData(impl_->model);
}

MujocoScene::MujocoScene(MujocoScene&&) noexcept = default;
MujocoScene::~MujocoScene() {
  if (!impl_) return;
  mj_deleteData(impl_->data);
  mj_deleteModel(impl_->model);
}

void MujocoScene::Impl::set_contacts(const belief::WorldState& start) {
  const auto of = [&](int body) {
    const auto i = static_cast<std::size_t>(body);
    if (i >= objects) return of_supports[i - objects];
    return std::pair(start.objects[i].physical.friction, start.objects[i].physical.restitution);
  };
  for (int i = 0; i < model->npair; ++i) {
    const int a = body_of_geom[static_cast<std::size_t>(model->pair_geom1[i])];
    const int b = body_of_geom[static_cast<std::size_t>(model->pair_geom2[i])];
    const double friction = std::max(1e-5, of(a).first * of(b).first);
    const double restitution = of(a).second * of(b).second;
    const double ratio = restitution > 0.01 ? damping_ratio_of(restitution) : 1.0;
    model->pair_friction[5 * i] = model->pair_friction[5 * i + 1] = friction;
    // What bounces meets a spring whose frequency, 1 / (time * ratio), is the same whatever its damping.
    model->pair_solref[mjNREF * i] = ratio < 1.0 ? 0.5 * options.contact_time / ratio : options.contact_time;
    model->pair_solref[mjNREF * i + 1] = ratio;
    const mjtNum impedance[mjNIMP] = {0.99, 0.999, 0.001, 0.5, 2.0};
    std::memcpy(model->pair_solimp + mjNIMP * i, impedance, sizeof impedance);
  }
}

bool MujocoScene::Impl::nothing_moves() const {
  for (std::size_t i = 0; i < objects; ++i) {
    const double* v = data->qvel + 6 * i;
    double reach = 0.0;  // m, of the object's points from its origin
    for (int g = 0; g < model->ngeom; ++g)
      if (body_of_geom[static_cast<std::size_t>(g)] == static_cast<int>(i))
        reach = std::max(reach, model->geom_rbound[g] + mju_norm3(model->geom_pos + 3 * g));
    if (mju_norm3(v) + reach * mju_norm3(v + 3) > kStandstill) return false;
  }
  return true;
}

belief::Trajectory MujocoScene::run(const belief::WorldState& start, double duration) {
  impl_->set_contacts(start);
  const mjModel* model = impl_->model;
  mjData* data = impl_->data;
  mj_resetData(model, data);
  for (mjWarningStat& warning : data->warning) warning.number = 0;
  for (std::size_t i = 0; i < impl_->objects; ++i) {
    const belief::ObjectState& object = start.objects[i];
    const auto& p = object.X_WO.translation;
    const auto& q = object.X_WO.rotation;
    const double state[7] = {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()};
    std::memcpy(data->qpos + 7 * i, state, sizeof state);
    // A free joint's angular velocity is in the body's frame.
    const Vector3d w_B = q.conjugate() * object.V_WO.angular;
    for (int k = 0; k < 3; ++k) {
      data->qvel[6 * i + static_cast<std::size_t>(k)] = object.V_WO.linear[k];
      data->qvel[6 * i + 3 + static_cast<std::size_t>(k)] = w_B[k];
    }
  }
  double still_since = 0.0;
  while (data->time < duration) {
    mj_step(model, data);
    if (impl_->options.rest_time <= 0.0) continue;
    if (!impl_->nothing_moves()) still_since = data->time;
    if (data->time - still_since > impl_->options.rest_time) break;
  }
  belief::Trajectory run;
  run.states = {start, start};
  run.simulated_seconds = run.states[1].time = data->time;
  // MuJoCo starts over by itself after it blew up.
  if (data->warning[mjWARN_BADQACC].number > 0 || data->warning[mjWARN_BADQPOS].number > 0 ||
      data->warning[mjWARN_BADQVEL].number > 0)
    run.end = belief::TrajectoryEnd::kDiverged;
  for (std::size_t i = 0; i < impl_->objects; ++i) {
    const double* q = data->qpos + 7 * i;
    belief::ObjectState& object = run.states[1].objects[i];
    object.X_WO.translation = {q[0], q[1], q[2]};
    object.X_WO.rotation = geometry::Quaterniond(q[3], q[4], q[5], q[6]).normalized();
    object.V_WO.linear = Vector3d(data->qvel[6 * i], data->qvel[6 * i + 1], data->qvel[6 * i + 2]);
    object.V_WO.angular =
        object.X_WO.rotation * Vector3d(data->qvel[6 * i + 3], data->qvel[6 * i + 4], data->qvel[6 * i + 5]);
  }
  return run;
}

}  // namespace prescene::tests
